"""Layers of keys on top of a rig's animation, and the animation of an object."""
