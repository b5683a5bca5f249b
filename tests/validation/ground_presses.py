"""Soles and wheels that stand on a ground for two seconds, pressed through the real solver."""

from __future__ import annotations

import numpy as np

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.loads.estimate import CharacterLoads
from tests.core.prop_bodies import prop_sole, wheel
from tests.core.walkers import box_sole, loads_of, pose, standing

SECONDS, RATE = 2.0, 60.0
CELLS_ACROSS = 8
"""Cells along the narrow side of what presses."""
LONGEST = 12.0
"""Longer soles are cut at so many widths: their ends have no part in how deep they sink."""


def sole_depth(material: GroundMaterial, pressure: float, width: float, length: float) -> float:
    """How deep a flat sole sinks [m], that stands under a pressure [Pa]; its sizes in metres."""
    length = min(length, LONGEST * width)
    sole = box_sole(length, width, spacing=min(0.005, width / 20))
    loads = standing(sole, [[0.0, 0.0, 0.0]], pressure * length * width, seconds=SECONDS)
    return _depth(loads, material, width / CELLS_ACROSS)


def wheel_depth(material: GroundMaterial, force: float, radius: float, width: float) -> float:
    """How deep a wheel sinks [m], that stands under a force [N]."""
    count = round(SECONDS * RATE) + 1
    poses = np.broadcast_to(pose(np.array([0.0, 0.0, radius])), (count, 1, 4, 4))
    loads = loads_of(
        [prop_sole(*wheel(radius, width))], [poses], np.full((count, 1), force), np.ones((count, 1), bool), RATE
    )
    return _depth(loads, material, width / CELLS_ACROSS)


def _depth(loads: CharacterLoads, material: GroundMaterial, cell_size: float) -> float:
    results = simulate([loads], SoftGround(FlatTerrain(), material), cell_size)
    return max(footprint.max_depth_m for result in results for footprint in result.footprints)
