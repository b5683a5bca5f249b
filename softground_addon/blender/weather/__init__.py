"""Weather on a baked ground: added, keyed, renewed, and read at points."""
