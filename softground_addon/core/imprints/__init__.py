"""What of a sole or a rigid body meets the ground, point by point and cell by cell, and how deep bodies press."""
