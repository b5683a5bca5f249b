"""Debris of a bake, as an object of points that plays by itself."""
