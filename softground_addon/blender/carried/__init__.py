"""Marks of what soles carry onto hard floors: one mesh beside the ground, which plays by nodes."""
