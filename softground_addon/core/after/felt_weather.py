"""Weather that steps feel: what it has left of a print by the time somebody steps there again.

The law is that of `weather_places` and the node group: z = kept·relief(sigma) + level, by the age of each cell. Depths
are measured from open ground, which new snow raises and melt lowers; on ground that is not snow, steps tread new snow
down to the ground.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..ground.display_blur import CUT_OFF, blurred_window
from ..ground.heightfield import HeightField, Window
from .weather import Span, matter_of
from .weather_course import Course, Weather, course_of
from .weather_places import SIGMAS, shares

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FeltWeather(Weather):
    """Weather that a bake depends on: its rates, and on what ground.

    Attributes
    ----------
    surface : str
        See `core.ground.presets.SURFACES`.
    """

    surface: str = ""


class PrintsInWeather:
    """What weather leaves of prints; a `ground.soft_ground.Weathering`.

    Parameters
    ----------
    weather : FeltWeather
    span : Span
        In scene frames.
    layer_depth : float
        Of the loose layer [m].

    Examples
    --------
    Ten hours at 3 cm of new snow an hour, which settles:

    >>> snowfall = FeltWeather(snowfall=3e-2 / 3600, temperature=-5.0, time_scale=3600.0, surface="snow")
    >>> round(PrintsInWeather(snowfall, Span(0, 240, 24.0), 0.5).level(240), 3)
    0.289
    """

    def __init__(self, weather: FeltWeather, span: Span, layer_depth: float) -> None:
        self._weather, self._span = weather, span
        self._matter = matter_of(weather.surface, layer_depth, 0.0)
        self._levels: dict[float, float] = {}

    @property
    def reach(self) -> float:
        """How far around it what a cell becomes depends on the ground [m]."""
        return (CUT_OFF + 1.0) * SIGMAS[-1]

    def level(self, frame: float) -> float:
        """How much higher open ground is at a scene frame than without weather, where steps press what fell [m]."""
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
        trodden: NDArray[np.bool_],
        frame: float,
        section: float | None,
    ) -> Array:
        """Compression and rim of cells, as weather has left them by a frame; see `ground.soft_ground.Weathering`."""
        course = self._course(frame, section)
        share = shares(course.since(since, course.variance))
        left = before = ground.read(window)
        compression = before[0]
        for sigma, part in zip(SIGMAS, np.moveaxis(share, -1, 0), strict=True):
            if not part.any():
                break
            wider = blurred_window(ground, window, sigma)
            left, before = left + part * (wider - before), wider
        left = left * course.since(since, course.kept)
        layer = self._matter.snow_depth
        if layer:
            frames, which = np.unique(since[trodden], return_inverse=True)
            stepped_on = np.zeros_like(since)
            stepped_on[trodden] = np.array([self.level(one) for one in frames.tolist()])[which]
            ratio = np.maximum(1.0 - (compression + stepped_on) / layer, 0.0)
            deep = np.maximum(layer + left[1] - left[0], 0.0)
            thawed = np.minimum(course.since(since, course.thawed) * ratio**2, deep)
            left[0] -= trodden * (course.since(since, course.cover) - thawed)
        return left

    def _course(self, frame: float, section: float | None) -> Course:
        matter = replace(self._matter, section=section) if section else replace(self._matter, blown=None)
        return course_of(self._weather, matter, frame=frame, span=self._span)
