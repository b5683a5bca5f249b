"""What soles carry from soft ground to hard floors, and the marks that they leave there."""
