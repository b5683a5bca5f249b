"""Meshes: grids that fit a walk, refinement along the trail, raster images over UVs."""
