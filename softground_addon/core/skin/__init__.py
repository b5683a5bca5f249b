"""Parts of a character that touch the ground, and their times, from its deformed skin alone."""
