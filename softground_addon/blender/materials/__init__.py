"""Materials of the ground."""
