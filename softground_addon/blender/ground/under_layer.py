"""Depth of the layer at each vertex, for prints that show the ground below it."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.ground.variation import CHANNELS
from ...core.numerics.arrays import Array
from ...core.settings import BakeSettings
from .. import ground_slots, mesh_arrays
from . import ground_mesh, painted_ground

THIN = 0.08
"""Depth of a layer up to which what lies below shows by default [m]: a shoe goes through some centimetres of snow, and
through a deep layer only where it packs less than any does."""

DEEP = 1e3
"""Depth that no print goes through [m]."""


def layers(display_mesh: bpy.types.Object, made_with: BakeSettings) -> Array | None:
    """Depth of the layer at the vertices of a display mesh (V,) [m], `DEEP` where what lies below it does not show.

    Where faces of several materials meet, the least of them. None if it shows nowhere.
    """
    of_slots = {region.slot: region.material.layer_depth if region.material else DEEP for region in made_with.regions}
    default, mesh = made_with.material.layer_depth, ground_mesh.mesh_of(display_mesh)
    name = made_with.painted[CHANNELS.index("depth")]
    is_painted = painted_ground.is_there(display_mesh, name)
    least = min([default, *of_slots.values()])
    if made_with.under == "NEVER" or (made_with.under == "AUTO" and least > THIN and not is_painted):
        return None
    depth = np.full(len(mesh.vertices), default)
    if of_slots:
        slots = ground_slots.of_faces(mesh)
        of_faces = np.full(max([*of_slots, int(slots.max(initial=0))]) + 1, default)
        of_faces[list(of_slots)] = list(of_slots.values())
        depth[:] = np.inf
        np.minimum.at(depth, *mesh_arrays.of_corners(mesh, of_faces[slots]))
        depth[np.isinf(depth)] = default
    if is_painted and (factors := painted_ground.factors(display_mesh, mesh, (name,))) is not None:
        depth *= factors[:, 0]
    if made_with.under == "AUTO":
        depth[depth > THIN] = DEEP
    return depth if (depth < DEEP).any() else None
