"""Many shots, side by side: their manifest, the finished ones, and the processes that bake them. Knows no Blender."""
