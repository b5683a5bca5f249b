"""The debris of a bake: computed from its loads and its record, booked out of the rims, and put beside the ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.after import debris as core
from ...core.after.debris import Debris
from ...core.ground.heightfield import Terrain
from ...core.loads.estimate import CharacterLoads
from ...core.record.edits import edits_by_number
from ...core.record.footprints import recompose
from ...core.record.record import BakeRecord
from ...core.settings import BakeSettings
from ..after import debris_object

Array = NDArray[np.float64]


def thrown(
    wanted: BakeSettings, terrain: Terrain, loads: Sequence[CharacterLoads], left: BakeRecord
) -> tuple[BakeRecord, Debris | None]:
    """What the steps of a record throw, and the record without it; None where debris is off.

    Steps that the artist has changed throw nothing: they were pressed elsewhere, or not at all.
    """
    if not wanted.debris or not left.footprints:
        return left, None
    ground = recompose(left.edited, cell_size=wanted.cell_size_m)

    def height(x: Array, y: Array) -> Array:
        compression, rim = ground.sample(x, y)
        return np.asarray(terrain.heights(x, y) + rim - compression)

    changed = changed_steps(left)
    debris = core.throw(loads, left.footprints, surface=wanted.surface, height=height, without=changed)
    pairs = zip(left.footprints, debris.volume.tolist(), strict=True)
    return replace(left, footprints=[core.booked(one, volume) for one, volume in pairs]), debris


def changed_steps(left: BakeRecord) -> set[int]:
    """Numbers of the steps that the artist has changed."""
    return {*edits_by_number(left.footprints, left.edits), *left.pressed_again}


def put(ground: bpy.types.Object, debris: Debris | None, wanted: BakeSettings) -> None:
    """Let a ground have the debris of its bake, or none."""
    debris_object.put(
        ground,
        debris,
        surface=wanted.surface,
        frame_rate=wanted.frame_rate,
        time_stretch=wanted.time_stretch,
        gravity=wanted.gravity_m_s2,
        unit_scale=wanted.unit_scale_m,
    )
