"""How the record plays: height over time at each vertex, as tables and curves."""
