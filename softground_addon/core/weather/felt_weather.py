"""Weather that steps feel: prints as weather has changed them by the time somebody steps there again.

The law is that of `weather_places` and the node group: z = unfilled·relief(sigma) + level, by the age of each cell.
Depths are measured from open ground, which new snow raises and melt lowers; on ground that is not snow, steps tread
new snow down to the ground.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..ground.display_blur import CUT_OFF, blurred_window
from ..ground.heightfield import HeightField
from ..ground.regions import Regions
from ..ground.sparse_grid import SparseGrid, Window
from ..numerics.arrays import Array, Mask
from .weather import PARTS, Span, matter_of
from .weather_course import Course, Weather, course_of
from .weather_places import SIGMAS, shares

LARGEST = 1e9
"""Largest number of a stored weather, in SI units and frames: a larger one is damage."""


@dataclass(frozen=True)
class FeltWeather(Weather):
    """Weather that a bake depends on: its rates over time, and on what ground.

    Attributes
    ----------
    first, last : float
        The scene frames that it is known in parts of.
    frame_rate : float
        Scene frames per second [Hz].
    """

    surface: str = ""
    first: float = 0.0
    last: float = float(PARTS)
    frame_rate: float = 24.0


def felt_in(inputs: Mapping[str, Any]) -> FeltWeather | None:
    """The weather that a bake felt, from the inputs that its record has; None if it felt none.

    Raises
    ------
    TypeError, ValueError, OverflowError
        If they are damaged.
    """
    known = inputs.get("weather")
    if known is None:
        return None
    if not isinstance(known, Mapping):
        raise TypeError("the weather is no table")
    values: Any = {
        name: str(raw) if name == "surface" else tuple(map(float, raw)) if isinstance(raw, list | tuple) else float(raw)
        for name, raw in known.items()
    }
    weather = FeltWeather(**values)
    numbers = [np.ravel(value) for name, value in values.items() if name != "surface"]
    if not all((np.abs(value) <= LARGEST).all() and len(value) in (1, PARTS + 1) for value in numbers):
        raise ValueError("the weather is of no such numbers")
    if not (weather.first < weather.last and weather.frame_rate > 0):
        raise ValueError("the weather takes no time")
    return weather


def weathering_of(
    weather: FeltWeather | None, layer_depth: float, regions: Regions | None = None
) -> PrintsInWeather | RegionsInWeather | None:
    """Prints under weather, in each region by its own surface and layer; None if steps feel none."""
    if weather is None:
        return None
    return RegionsInWeather(weather, regions) if regions else PrintsInWeather(weather, layer_depth)


class PrintsInWeather:
    """Prints under weather; a `ground.soft_ground.Weathering`.

    Parameters
    ----------
    layer_depth : float
        Of the loose layer [m].
    region : str
        Surface of the prints by whose volume wind fills them; see `ground.soft_ground.Weathering.aged`.

    Examples
    --------
    Ten hours at 3 cm of new snow an hour, which settles:

    >>> snowfall = FeltWeather(snowfall=3e-2 / 3600, temperature=-5.0, time_scale=3600.0, surface="snow", last=256)
    >>> round(PrintsInWeather(snowfall, 0.5).level(240), 3)
    0.289
    """

    def __init__(self, weather: FeltWeather, layer_depth: float, region: str = "") -> None:
        self._region = region
        self._weather, self._span = weather, Span(weather.first, weather.last, weather.frame_rate)
        self._matter = matter_of(weather.surface, layer_depth, 0.0)
        self._levels: dict[float, float] = {}

    @property
    def reach(self) -> float:
        """Radius of the ground that a weathered cell depends on [m]."""
        return (CUT_OFF + 1.0) * SIGMAS[-1]

    def levels(self, frame: float, *_places: Array) -> float:
        """Rise of open ground by a scene frame, the same at all places [m]."""
        return self.level(frame)

    def level(self, frame: float) -> float:
        """Rise of open ground by a scene frame [m]; 0 where steps tread new snow down to the ground."""
        if not self._matter.snow_depth:
            return 0.0
        if frame not in self._levels:
            course = self._course(frame, None)
            self._levels[frame] = float(course.cover[0] - min(course.thawed[0], self._matter.snow_depth))
        return self._levels[frame]

    def aged(
        self,
        ground: HeightField,
        window: Window,
        *,
        since: Array,
        trodden: SparseGrid,
        pressed: Array,
        frame: float,
        sections: Mapping[str, float],
    ) -> Array:
        """Compression and rim of cells, as weather has left them by a frame; see `ground.soft_ground.Weathering`."""
        course = self._course(frame, sections.get(self._region))
        share = np.moveaxis(shares(course.since(since, course.variance)), -1, 0)
        unfilled = course.since(since, course.unfilled)
        weathered = _rounded(ground, window, SIGMAS, share) * unfilled
        layer = self._matter.snow_depth
        if layer:
            contact = trodden.read(window)[0]
            ratio = np.maximum(1.0 - pressed / layer, 0.0)
            deep = np.maximum(layer + weathered[1] - weathered[0], 0.0)
            thawed = np.minimum(course.since(since, course.thawed) * ratio**2, deep)
            lower = self.level(frame) - (course.since(since, course.cover) - thawed)
            inside = _rounded(trodden, window, SIGMAS[1:], share[1:])[0]
            weathered[0] += unfilled * inside * lower - contact * self.level(frame)
        return weathered

    def _course(self, frame: float, section: float | None) -> Course:
        matter = replace(self._matter, section=section) if section else replace(self._matter, drifts_from=None)
        return course_of(self._weather, matter, frame=frame, span=self._span)


class RegionsInWeather:
    """Prints under weather on a ground of several kinds; a `ground.soft_ground.Weathering`.

    Each cell is as on a ground that is all of its kind. Hard floors, and what is beside the ground, stay as they are.

    Parameters
    ----------
    weather : FeltWeather
        Of any surface.
    """

    def __init__(self, weather: FeltWeather, regions: Regions) -> None:
        self._regions = regions
        self._of_kinds = [
            PrintsInWeather(replace(weather, surface=kind.surface), kind.material.layer_depth, kind.surface)
            for kind in regions.kinds
        ]

    @property
    def reach(self) -> float:
        """Radius of the ground that a weathered cell depends on [m]."""
        return self._of_kinds[0].reach

    def levels(self, frame: float, x: Array, y: Array, /) -> Array:
        """Rise of open ground by a scene frame at places [m]."""
        levels = np.zeros(np.shape(x))
        for covered, kind in self._parts(x, y):
            levels[covered] = kind.level(frame)
        return levels

    def aged(self, ground: HeightField, window: Window, **known: Any) -> Array:
        """Compression and rim of cells, as weather has left them by a frame; see `ground.soft_ground.Weathering`."""
        weathered = ground.read(window)
        for covered, kind in self._parts(*np.meshgrid(*window.centres(ground.cell_size))):
            weathered[:, covered] = kind.aged(ground, window, **known)[:, covered]
        return weathered

    def _parts(self, x: Array, y: Array) -> Iterator[tuple[Mask, PrintsInWeather]]:
        """Places of each kind of ground that is among them, and what weather does to it."""
        number = self._regions.where.interpolated(x, y)[-1]
        for kind in np.unique(number[number >= 0]):
            yield number == kind, self._of_kinds[int(kind)]


def _rounded(grid: SparseGrid, window: Window, sigmas: Sequence[float], share: Array) -> Array:
    """Values of a window, blended into each of the blurs by a share (K, rows, columns), 0 to 1."""
    rounded = before = grid.read(window)
    for sigma, part in zip(sigmas, share, strict=True):
        if not part.any():
            break
        wider = blurred_window(grid, window, sigma)
        rounded, before = rounded + part * (wider - before), wider
    return rounded
