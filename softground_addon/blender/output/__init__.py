"""What takes a bake out of Blender, or makes curves of it."""
