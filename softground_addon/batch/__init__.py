"""Many shots, side by side: which, what is done, and the processes that bake them. Knows no Blender."""
