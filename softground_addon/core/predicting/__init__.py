"""What a prediction follows: the contacts of a shot as the ground feels them, whatever it is made of."""
