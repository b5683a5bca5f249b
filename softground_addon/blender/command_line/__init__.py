"""`softground bake`, `softground batch` and the others."""
