"""What the pressed ground does to the character: tilt, sinking feet, legs."""
