"""The debris of a bake: computed from its loads and its record, and booked out of the rims."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..ground.heightfield import SparseGrid
from ..ground.soft_ground import SoftGround, Weathering
from ..loads.estimate import CharacterLoads
from ..record.footprints import recompose
from ..record.record import BakeRecord
from . import flight
from .debris import Debris, Height, sources, throw, throws_of, volumes

Array = NDArray[np.float64]


def thrown(
    left: BakeRecord,
    loads: Sequence[CharacterLoads],
    ground: SoftGround,
    *,
    surface: str,
    cell_size: float,
    gravity: float,
) -> tuple[BakeRecord, Debris | None]:
    """What the steps of a record throw, and the record with it booked; None where there are no steps."""
    if not left.footprints:
        return left, None
    left = replace(left, throws=throws_of(loads, left.footprints, surface=surface))
    return thrown_again(left, ground, surface=surface, cell_size=cell_size, gravity=gravity)


def thrown_again(
    left: BakeRecord, ground: SoftGround, *, surface: str, cell_size: float, gravity: float
) -> tuple[BakeRecord, Debris]:
    """What the steps of a record throw as the artist leaves them, from what the record keeps of how they do.

    Parameters
    ----------
    left : BakeRecord
    ground : SoftGround
        Before anything pressed it.
    surface : str
        See `ground.presets.SURFACES`.
    cell_size : float
        [m]
    gravity : float
        [m/s²]

    Raises
    ------
    InputError
        If what the record keeps is damaged.
    """
    left = replace(left, thrown={})
    try:
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            thrown_by = sources(left.throws, left.steps, surface=surface, gravity=gravity)
            left = replace(left, thrown=volumes(thrown_by))
            pressed = recompose(left.edited, cell_size=cell_size)
            bare = flight.SampledHeights(ground.terrain.heights, cell_size)  # thousands fall side by side

            def height(x: Array, y: Array) -> Array:
                compression, rim = pressed.sample(x, y)
                return np.asarray(bare(x, y) + rim - compression)

            in_weather = _in_weather(left, ground.weathering, height, cell_size)
            return left, throw(thrown_by, surface=surface, gravity=gravity, height=height, height_at=in_weather)
    except (ArithmeticError, IndexError, MemoryError, ValueError) as error:
        raise InputError(
            f"The stored steps of the footprints are damaged ({error}): clear the bake and bake again."
        ) from None


def _in_weather(
    left: BakeRecord, weathering: Weathering | None, height: Height, cell_size: float
) -> Callable[[float], Height] | None:
    """Heights at scene frames, where steps feel weather: new snow raises open ground, and steps press it down."""
    if weathering is None:
        return None
    trodden = SparseGrid(cell_size, channels=1)
    for one in left.edited:
        values = trodden.read(one.window)
        values.reshape(-1)[one.contact_cells] = 1.0
        trodden.write(one.window, values)

    def height_at(frame: float) -> Height:
        level = weathering.level(frame)
        return lambda x, y: (
            np.asarray(height(x, y) + (1.0 - trodden.sample(x, y)[0]) * level) if level else height(x, y)
        )

    return height_at
