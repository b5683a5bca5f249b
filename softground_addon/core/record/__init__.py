"""What a bake leaves: footprints, their bytes, and the ground that they make."""
