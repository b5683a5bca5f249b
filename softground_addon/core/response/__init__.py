"""Response of the character to the pressed ground: tilt, sinking feet, legs."""
