"""Motion of a rig: of a character, of its soles and of props."""
