"""Motion capture into Blender: a rig from joint centres, and the plates that were stepped on."""
