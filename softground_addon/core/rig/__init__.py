"""Data read from a rig, as plain arrays, and its motion."""
