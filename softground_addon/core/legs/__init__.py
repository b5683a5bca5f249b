"""Legs that put feet where they belong: placement on the ground, locks, knees."""
