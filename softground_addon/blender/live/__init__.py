"""Live mode: the ground gives way while the timeline plays."""
