"""A shot as it is read from the scene, and whether the scene still is as it was read."""
