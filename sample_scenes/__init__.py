"""The project's own characters, motions and scenes: what the demo shows and what the tests walk on."""
