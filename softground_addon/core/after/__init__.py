"""What follows from a bake once it is done: events, sound and debris, from its record and its loads."""
