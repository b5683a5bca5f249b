"""PC2 point caches as other programs take them: read by their format, and played by Blender's Mesh Cache modifier."""

import struct

import numpy as np

from softground_addon.blender.ground import baked_ground
from softground_addon.blender.playback import playback

HEADER = struct.Struct("<12siiffi")


def read(path):
    """First frame, and positions (samples, points, 3), of a cache."""
    content = path.read_bytes()
    kind, version, points, start, step, count = HEADER.unpack_from(content)
    assert (kind, version, step) == (b"POINTCACHE2\0", 1, 1.0)
    assert len(content) == HEADER.size + count * points * 12
    return start, np.frombuffer(content, dtype="<f4", offset=HEADER.size).reshape(count, points, 3)


def play(ground, path, start, time_stretch=1.0):
    """Let what carries a ground's bake play a cache in place of the nodes; it counts the animation's frames."""
    display_mesh = baked_ground.display_mesh_of(ground)
    playback.modifier_of(display_mesh).show_viewport = False
    modifier = display_mesh.modifiers.new("Cache", "MESH_CACHE")
    modifier.cache_format, modifier.filepath, modifier.frame_start = "PC2", str(path), start
    modifier.frame_scale = 1 / time_stretch
    display_mesh.modifiers.move(len(display_mesh.modifiers) - 1, 0)
