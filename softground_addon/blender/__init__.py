"""The Blender side of SoftGround: everything that imports bpy."""
