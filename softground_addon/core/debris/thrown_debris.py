"""The debris of a bake: computed from its loads and its record, and booked out of the rims."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..errors import damaged_record
from ..ground.heightfield import FlatTerrain
from ..ground.soft_ground import SoftGround, Weathering
from ..ground.sparse_grid import SparseGrid
from ..loads.estimate import CharacterLoads
from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced, without_warnings
from ..record.footprints import recompose
from ..record.record import BakeRecord
from . import flight
from .debris import Debris, Height, sources, throw, volumes
from .step_throws import throws_of


@sliced
def thrown(
    record: BakeRecord,
    ground: SoftGround,
    *,
    surface: str,
    cell_size: float,
    gravity: float,
    loads: Sequence[CharacterLoads] | None = None,
) -> Slices[tuple[BakeRecord, Debris | None]]:
    """Debris of a record's steps after the artist's edits, and the record with it booked; None if nothing may throw.

    Parameters
    ----------
    ground : SoftGround
        Before anything pressed it.
    cell_size : float
        [m]
    gravity : float
        [m/s²]
    loads : sequence of CharacterLoads, optional
        From which it follows how steps throw; by default it is what the record says of that.

    Raises
    ------
    InputError
        If what the record says is damaged.
    """
    if not (record.throws if loads is None else record.footprints):
        return record, None
    if loads is not None:
        of_steps = yield from throws_of.slices(loads, record.footprints, surface=surface)
        record = replace(record, throws=[*record.throws, *of_steps])  # beside those of what ploughs
    try:
        return (yield from without_warnings(_thrown(record, ground, surface, cell_size, gravity)))
    except (ArithmeticError, IndexError, MemoryError, ValueError) as error:
        raise damaged_record(error, "motion") from None


def _thrown(
    record: BakeRecord, ground: SoftGround, surface: str, cell_size: float, gravity: float
) -> Slices[tuple[BakeRecord, Debris]]:
    record = replace(record, thrown={})
    thrown_by = yield from sources.slices(
        record.throws, record.steps, surface=surface, gravity=gravity, carves=record.laid_carves
    )
    record = replace(record, thrown=volumes(thrown_by))
    pressed = recompose(record.shaping, cell_size=cell_size)
    yield
    is_flat = isinstance(ground.terrain, FlatTerrain)  # else thousands fall side by side
    bare = flight.SampledHeights(ground.terrain.heights, cell_size, is_quick=is_flat)

    def height(x: Array, y: Array) -> Array:
        compression, rim = pressed.sample(x, y)
        return np.asarray(bare(x, y) + rim - compression)

    in_weather = _in_weather(record, ground.weathering, height, cell_size)
    pieces = throw.slices(thrown_by, surface=surface, gravity=gravity, height=height, height_at=in_weather)
    return record, (yield from pieces)


def _in_weather(
    record: BakeRecord, weathering: Weathering | None, height: Height, cell_size: float
) -> Callable[[float], Height] | None:
    """Heights at scene frames, where steps feel weather: new snow raises open ground, and steps press it down."""
    if weathering is None:
        return None
    trodden = SparseGrid(cell_size, channels=1)
    for footprint in record.edited:
        values = trodden.read(footprint.window)
        values.reshape(-1)[footprint.contact_cells] = 1.0
        trodden.write(footprint.window, values)

    def height_at(frame: float) -> Height:
        return lambda x, y: np.asarray(height(x, y) + (1.0 - trodden.sample(x, y)[0]) * weathering.levels(frame, x, y))

    return height_at
