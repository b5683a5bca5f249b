"""What prints: undersides, outlines, how a foot lies, the pieces of a sole."""
