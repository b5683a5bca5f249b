"""What grows and lies on the ground in Blender: it gives way to the soles of a bake by a modifier of its own."""
