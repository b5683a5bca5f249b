"""Soles that print: undersides, outlines, the attitude of a foot, the pieces of a sole."""
