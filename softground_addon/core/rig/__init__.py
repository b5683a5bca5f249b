"""What was read of a rig, as plain arrays, and the motion that it comes to."""
