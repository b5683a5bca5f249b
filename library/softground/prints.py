"""Footprints: a ground, and what loads leave in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core.checks.volumes import check_volumes
from ._core.composers.simulation import simulate
from ._core.errors import InputError
from ._core.ground import field_tests
from ._core.ground import presets as presets_of_core
from ._core.ground.heightfield import FlatTerrain, Terrain
from ._core.ground.material import GroundMaterial, Pressure
from ._core.ground.soft_ground import SoftGround
from ._core.loads.cell_limits import Fineness, check_cell_size
from ._core.motion.motion import shortest_sole
from ._core.record.footprints import Footprint, extent
from ._core.record.ground_history import GroundHistory
from .forces import Loads, as_terrain

Array = NDArray[np.float64]

CELLS_ALONG_SOLE = 55
"""Cells along the shortest sole where no size is given: 5 mm for a foot of 27 cm."""

HARDNESSES = {"fist": 1.0, "four fingers": 2.0, "one finger": 3.0, "pencil": 4.0, "knife": 5.0}
"""Hand hardness of snow by what can just be pushed into it."""


@dataclass(frozen=True)
class Ground:
    """A ground that gives way.

    Attributes
    ----------
    material : GroundMaterial
        From `snow` or `presets`, or of its own numbers.
    terrain : float or Terrain
        Height of a level ground [m], or anything whose `heights(x, y)` gives heights [m].
    pressure : 'CENTRE_OF_PRESSURE' or 'UNIFORM'
        True if a sole presses most where its force acts, or evenly.
    """

    material: GroundMaterial
    terrain: float | Terrain = 0.0
    pressure: Pressure = "CENTRE_OF_PRESSURE"


@dataclass(frozen=True)
class Print:
    """What one contact of a sole left.

    Attributes
    ----------
    sole : str
    start, end : float
        When it touched down and left [s].
    position : (3,) float array
        Middle of the pressure on the undisturbed ground [m].
    heading : float
        Direction of the toes, anticlockwise from x [rad].
    depth : float
        Largest compression [m], on top of earlier prints.
    area : float
        Largest area of contact [m²].
    peak_force : float
        Largest normal force [N].
    compressed, raised : float
        Volume that it compressed, and that of its rim [m³].
    """

    sole: str
    start: float
    end: float
    position: Array
    heading: float
    depth: float
    area: float
    peak_force: float
    compressed: float
    raised: float


@dataclass(frozen=True)
class Prints:
    """The pressed ground over time.

    Attributes
    ----------
    prints : tuple of Print
        In the order in which they began.
    cell_size : float
        Side of the cells that were pressed [m].
    rate : float
        Frames per second [Hz].
    terrain : Terrain
        The undisturbed ground.
    record : tuple of Footprint
        The same as the core records it.
    """

    prints: tuple[Print, ...]
    cell_size: float
    rate: float
    terrain: Terrain
    record: tuple[Footprint, ...]

    def heights(self, x: ArrayLike, y: ArrayLike, time: float = np.inf) -> Array:
        """Heights of the ground at places [m], arrays of one shape, at a time [s]; after all steps if not given."""
        across, along = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        history = GroundHistory(self.terrain, self.record)
        return history.heights(across, along, np.full(across.shape, time * self.rate))

    def grid(self, time: float = np.inf) -> tuple[Array, Array, Array]:
        """The cells around all prints: x (C,) and y (R,) of their centres, heights (R, C) at a time [s]; all in [m]."""
        if not self.record:
            return np.zeros(0), np.zeros(0), np.zeros((0, 0))
        low, high = extent(self.record)
        x, y = (
            np.arange(round((b - a) / self.cell_size)) * self.cell_size + a + self.cell_size / 2
            for a, b in zip(low, high, strict=True)
        )
        return x, y, self.heights(x[None], y[:, None], time)

    @property
    def volumes(self) -> tuple[float, float]:
        """Volume that all steps compressed, and that of their rims [m³]."""
        return sum(each.compressed for each in self.prints), sum(each.raised for each in self.prints)


def snow(hardness: float | str, layer_depth: float | None = None) -> GroundMaterial:
    """Snow of a hand hardness.

    Parameters
    ----------
    hardness : float or str
        From 1 to 5, or one of `HARDNESSES`: fist, four fingers, one finger, pencil, knife.
    layer_depth : float, optional
        Depth of the snow [m]; at least what a boot needs if not given.

    Raises
    ------
    InputError
        If there is no such hardness.

    References
    ----------
    Fierz et al. 2009, "The International Classification for Seasonal Snow on the Ground"; depths of boots in 19,811
    snow pits (SnowPilot.org).

    Examples
    --------
    >>> soft, hard = snow("fist"), snow("knife")
    >>> soft.youngs_modulus < hard.youngs_modulus
    True
    """
    if isinstance(hardness, str):
        name = hardness.strip().lower().replace("-", " ").replace("_", " ")
        if name not in HARDNESSES:
            raise InputError(f"no hardness {hardness!r}: give {', '.join(HARDNESSES)}, or 1 to 5", "hardness")
        hardness = HARDNESSES[name]
    if not 1.0 <= hardness <= 5.0 or (layer_depth is not None and not layer_depth > 0):
        raise InputError("the hardness of snow is from 1 (fist) to 5 (knife), and its depth positive", "hardness")
    return field_tests.snow(hardness, layer_depth)


def presets() -> dict[str, GroundMaterial]:
    """The grounds that come with the library, by name.

    Examples
    --------
    >>> sorted(presets())[:2]
    ['Clayey Soil (field)', 'Crust over Powder']
    """
    every = map(presets_of_core.load, sorted(presets_of_core.FOLDER.glob("*.json")))
    return {preset.name: preset.material for preset in every}


def press(
    loads: Loads,
    ground: Ground,
    *,
    cell_size: float | None = None,
    longest: float = 3600.0,
    progress: Callable[[float], None] | None = None,
) -> Prints:
    """Press loads into a ground.

    Parameters
    ----------
    loads : Loads
    ground : Ground
        On the terrain that the loads were estimated on.
    cell_size : float, optional
        Side of a cell [m]; 1/55 of the shortest sole if not given.
    longest : float, optional
        What is estimated to take longer is refused [s].
    progress : callable, optional
        Called with the part that is done, 0 to 1.

    Raises
    ------
    InputError
        If the terrain is another one, or the cells are too small for memory or time, or larger than a sole.
    BakeError
        If a print breaks a conservation law.

    References
    ----------
    Alvarado, Paliard, Rohmer, Cani 2022, "Real-Time Locomotion on Soft Grounds With Dynamic Footprints",
    10.3389/frvir.2022.801856; docs/model.md of the project says what goes beyond it.
    """
    terrain = as_terrain(ground.terrain)
    if terrain is not loads.terrain and _level(terrain) != _level(loads.terrain):
        raise InputError("the ground's terrain is another one than the loads': estimate them on it", "other_terrain")
    motion = loads.steps.motion
    size = shortest_sole([motion]) / CELLS_ALONG_SOLE if cell_size is None else cell_size
    soft = SoftGround(loads.terrain, ground.material, ground.pressure)
    if size > 0:
        check_cell_size([loads.steps], Fineness(size, ground.material.rim_reach), longest)
    record: list[Footprint] = []
    for result in simulate([loads.steps], soft, size):
        record += result.footprints
        if progress:
            progress((result.frame - motion.frames[0]) / max(motion.frames[-1] - motion.frames[0], 1.0))
    check_volumes(record, soft)
    record.sort(key=lambda footprint: (footprint.start_frame, footprint.end_frame, footprint.sole))
    prints = tuple(_print(footprint, motion.frame_rate) for footprint in record)
    return Prints(prints, size, motion.frame_rate, loads.terrain, tuple(record))


def _level(terrain: Terrain) -> object:
    """The height of a level terrain; any other is itself."""
    return terrain.height if isinstance(terrain, FlatTerrain) else terrain


def _print(footprint: Footprint, rate: float) -> Print:
    return Print(
        footprint.sole,
        footprint.start_frame / rate,
        footprint.end_frame / rate,
        footprint.position,
        footprint.heading,
        footprint.max_depth_m,
        footprint.area_m2,
        footprint.peak_force_n,
        footprint.compressed_m3,
        footprint.rim_m3,
    )
