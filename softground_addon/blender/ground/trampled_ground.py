"""Data of a bake for plants: the table by which they give way, and how often each vertex was trodden on."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.plants.tramplings import Tramplings
from ...core.settings import SceneUnits
from ..plants import give_way, trampling_table, wind_nodes
from ..playback import own_data
from . import baked_ground, ground_mesh, ground_surface


def write(ground: bpy.types.Object, trampled: Tramplings | None, units: SceneUnits) -> None:
    """Write what soles trample, where plants give way on a ground; elsewhere nothing happens."""
    table = trampling_table.of(ground)
    if table is None:
        return
    trampling_table.write(table, ground, trampled, units)
    shown = baked_ground.display_mesh_of(ground)
    give_way.follow(table, {shown})
    wind_nodes.follow(table, shown)
    if trampled is None:
        return
    place = ground_surface.rest_vertices(shown, units.unit_scale_m, units.frame)
    latest = trampled.latest(place[:, 0], place[:, 1])
    passes = np.where(latest >= 0, trampled.by.passes[latest], 0.0)
    ground_mesh.write_shading(shown, own_data.PASSES, np.arange(len(passes)), passes)
