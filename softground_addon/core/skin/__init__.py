"""Which parts of a character touch the ground, and when, from its deformed skin alone."""
