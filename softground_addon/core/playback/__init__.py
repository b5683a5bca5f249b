"""Playback of the record: height over time at each vertex, as tables and curves."""
