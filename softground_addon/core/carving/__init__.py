"""What bodies do to deep ground beside their prints: legs and whatever else is in the ground carve it."""
