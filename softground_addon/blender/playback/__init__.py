"""Playback of a bake without the add-on: keys, node groups and weather on a mesh."""
