"""The debris of a bake: computed from its loads and its record, booked out of the rims, and put beside the ground."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.after import debris as core
from ...core.after import flight
from ...core.after.debris import Debris
from ...core.after.felt_weather import weathering_of
from ...core.errors import InputError
from ...core.ground.heightfield import SparseGrid, Terrain
from ...core.loads.estimate import CharacterLoads
from ...core.record.footprints import recompose
from ...core.record.record import BakeRecord
from ...core.settings import BakeSettings
from ..after import debris_object

Array = NDArray[np.float64]


def thrown(
    wanted: BakeSettings, terrain: Terrain, loads: Sequence[CharacterLoads], left: BakeRecord
) -> tuple[BakeRecord, Debris | None]:
    """What the steps of a record throw, and the record with it booked; None where debris is off."""
    if not wanted.debris or not left.footprints:
        return left, None
    throws = core.throws_of(loads, left.footprints, surface=wanted.surface)
    return thrown_again(wanted, wanted.surface, terrain, replace(left, throws=throws))


def thrown_again(
    made_with: BakeSettings, surface: str, terrain: Terrain, left: BakeRecord
) -> tuple[BakeRecord, Debris]:
    """What the steps of a record throw as the artist leaves them, from what the record keeps of how they do.

    Raises
    ------
    InputError
        If that is damaged.
    """
    left, gravity = replace(left, thrown={}), made_with.gravity_m_s2
    try:
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            sources = core.sources(left.throws, left.steps, surface=surface, gravity=gravity)
            left = replace(left, thrown=core.volumes(sources))
            ground = recompose(left.edited, cell_size=made_with.cell_size_m)
            bare = flight.SampledHeights(terrain.heights, made_with.cell_size_m)  # thousands fall side by side

            def height(x: Array, y: Array) -> Array:
                compression, rim = ground.sample(x, y)
                return np.asarray(bare(x, y) + rim - compression)

            in_weather = _in_weather(made_with, left, height)
            return left, core.throw(sources, surface=surface, gravity=gravity, height=height, height_at=in_weather)
    except (ArithmeticError, IndexError, MemoryError, ValueError) as error:
        raise InputError(
            f"The stored steps of the footprints are damaged ({error}): clear the bake and bake again."
        ) from None


def _in_weather(
    made_with: BakeSettings, left: BakeRecord, height: core.Height
) -> Callable[[float], core.Height] | None:
    """Heights at scene frames, where steps feel weather: new snow raises open ground, and steps press it down."""
    weathering = weathering_of(made_with.weather, made_with.material.layer_depth)
    if weathering is None:
        return None
    trodden = SparseGrid(made_with.cell_size_m, channels=1)
    for one in left.edited:
        values = trodden.read(one.window)
        values.reshape(-1)[one.contact_cells] = 1.0
        trodden.write(one.window, values)

    def height_at(frame: float) -> core.Height:
        level = weathering.level(frame)
        return lambda x, y: (
            np.asarray(height(x, y) + (1.0 - trodden.sample(x, y)[0]) * level) if level else height(x, y)
        )

    return height_at


def put(ground: bpy.types.Object, debris: Debris | None, wanted: BakeSettings, surface: str = "") -> None:
    """Let a ground have the debris of its bake, or none; of a surface other than the wanted one where it says so."""
    debris_object.put(
        ground,
        debris,
        surface=surface or wanted.surface,
        frame_rate=wanted.frame_rate,
        time_stretch=wanted.time_stretch,
        gravity=wanted.gravity_m_s2,
        unit_scale=wanted.unit_scale_m,
    )
