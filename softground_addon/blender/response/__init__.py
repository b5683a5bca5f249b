"""Response of the characters to the pressed ground, as keys on their rigs."""
