"""The dynamics of a body: its centre of mass, its inertia, and how feet share what they bear."""
