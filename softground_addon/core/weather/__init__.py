"""Weather over the prints of a bake, process by process and over time, and as later steps feel it."""
