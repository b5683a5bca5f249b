"""What a character does to the ground: contacts over time and the force in each."""
