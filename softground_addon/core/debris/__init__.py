"""Debris that feet throw: clods in flight, booked by step, and where they come down."""
