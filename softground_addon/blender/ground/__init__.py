"""The ground: created, painted, read, and written with the prints of a bake."""
