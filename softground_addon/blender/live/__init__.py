"""The ground that gives way while the timeline plays."""
