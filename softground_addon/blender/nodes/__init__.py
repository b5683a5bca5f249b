"""Geometry nodes and materials as code: what all that plays or shades is made with."""
