"""Record of a bake: footprints, their bytes, and the ground that they make."""
