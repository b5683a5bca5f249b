"""What a bake throws, as native data that plays without the add-on."""
