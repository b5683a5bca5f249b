"""Export of a bake to other programs, or to curves."""
