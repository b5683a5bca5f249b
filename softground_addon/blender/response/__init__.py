"""What the pressed ground does to the characters, as keys on their rigs."""
