"""The commands `softground bake`, `clean`, `export` and `batch`."""
