"""What a rig did: the motion of a character, of its soles and of props."""
