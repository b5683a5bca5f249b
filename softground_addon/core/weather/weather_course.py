"""Effects of weather from any moment to now, at rates that change: sums over the time between moments.

All that depends on an age is computed once for each moment and holds for all places. Rates are those of each part;
between moments every integral but that over the settling of its own layer is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array
from . import weather as w
from .weather import MOMENTS, NO_WATER, PARTS, Span

Rate = float | Sequence[float] | Array

KEYED = ("snowfall", "temperature", "wind", "rain", "drying", "time_scale")
"""Rates that are summed up over time."""


@dataclass(frozen=True)
class Weather:
    """Rates, each a number, or PARTS + 1 of them: the mean of each part of a span, and the value from its end on.

    Attributes
    ----------
    snowfall : float or sequence of float
        New snow [m/s].
    temperature : float or sequence of float
        Of the air [°C].
    wind : float or sequence of float
        At 10 m [m/s].
    rain : float or sequence of float
        [m/s].
    drying : float or sequence of float
        Evaporation [m/s].
    time_scale : float or sequence of float
        Times faster than the animation.
    water_table : float
        Depth below the brim of each print at which water from below stands now [m].
    halo : float
        Paleness of wet sand around a loaded foot, 0 to 1.
    """

    snowfall: Rate = 0.0
    temperature: Rate = 0.0
    wind: Rate = 0.0
    rain: Rate = 0.0
    drying: Rate = 0.0
    time_scale: Rate = 1.0
    water_table: float = NO_WATER
    halo: float = 0.0


@dataclass(frozen=True)
class Course:
    """Effects of weather from each of N frames to now; the last of them is now.

    Attributes
    ----------
    frames : array
        Ascending.
    cover : array
        New snow that lies there [m].
    thawed : array
        Melt of untrodden snow, were it deep enough [m].
    variance : array
        Variance of the blur that edges have undergone [m²].
    unfilled : array
        Share of a print that is not blown full.
    wet : array
        Wet look of the ground, where no water stands.
    seeped : array
        Share of its height that water from below has reached.
    pale : array
        Remaining share of its paleness around a foot.
    """

    frames: Array
    cover: Array
    thawed: Array
    variance: Array
    unfilled: Array
    wet: Array
    seeped: Array
    pale: Array
    _rained: Array
    _soaked: Array
    _wet_since: Array

    def excess(self, share: float) -> Array:
        """Rain that ground with a share of its soaking has not taken up (N,) [m]."""
        return _to_now(np.maximum(self._rained - share * self._soaked, 0.0))

    def since(self, frame: Array, values: Array) -> Array:
        """One of the attributes from other frames on; later frames count as now."""
        return np.interp(frame, self.frames, values)


def course_of(weather: Weather, matter: w.Matter, *, frame: float, span: Span, moments: int = MOMENTS) -> Course:
    """The course of a weather up to a frame, from each of so many moments on into which a span is divided.

    Examples
    --------
    A night at -5 °C with 3 cm of new snow an hour, and a day that melts all of it:

    >>> cold, warm = np.arange(257) // 86 != 1, np.arange(257) // 86 == 1
    >>> nights = Weather(snowfall=np.where(cold, 3e-2 / 3600, 0.0), temperature=np.where(warm, 20.0, -5.0))
    >>> sand = w.matter_of("sand", 0.2, 0.01)
    >>> course_of(nights, sand, frame=86 * 360, span=Span(0, 256 * 360, 1.0)).cover[0].round(2)
    0.25
    >>> course_of(nights, sand, frame=86 * 720, span=Span(0, 256 * 360, 1.0)).cover[0].round(2)
    0.0
    """
    begin = np.linspace(span.first, span.last, moments + 1)
    past = np.clip(frame - begin, 0.0, np.append(np.full(moments, span.step * PARTS / moments), np.inf))
    rates = (
        np.broadcast_to(getattr(weather, name), PARTS + 1)[np.arange(moments + 1) * PARTS // moments] for name in KEYED
    )
    snowfall, temperature, wind, rain, drying, scale = rates
    time = past * scale / span.frame_rate
    density = w.new_snow_density(temperature)
    fallen = snowfall * density / w.WATER_DENSITY * time
    melted = w.melting_rate(temperature) * time

    # The snow that fell last melts first: a layer remains as far as the reserve never fell below it again.
    reserve = _before(fallen - melted)
    lowest = _least_to_come(reserve)
    layers = np.diff(lowest) * w.WATER_DENSITY
    settling = w.settling_rate(temperature) * time
    since = _to_now(settling)[1:]
    depth = sum(
        weight / 2 * layers / w.settled_density(since + (1.0 - at) / 2 * settling, density)
        for at, weight in zip(*np.polynomial.legendre.leggauss(3), strict=True)
    )
    cover = _to_now(np.asarray(depth))
    thawed = (reserve - lowest) * w.WATER_DENSITY / matter.density

    variance = w.DRAPE * (cover + thawed if matter.snow_depth else cover) + w.RAIN_ROUNDING * _to_now(rain * time)
    unfilled = np.ones_like(cover)
    if matter.drifts_from:
        flux = w.blown_flux(wind, matter.drifts_from)
        variance = variance + _to_now(w.spread_rate(flux, matter.density) * time)
        unfilled = np.exp(-_to_now(w.fill_rate(flux, matter.section, matter.density) * time))

    rained, age = rain * time, _to_now(time)
    soaked, seeped = np.zeros_like(rained), np.zeros_like(age)
    if matter.soaking:
        soaked = np.diff(w.soaked(_before(np.where(rain > 0, time, 0.0)), matter.soaking))
        seeped = w.seeped(age, matter.soaking)
    wet = _wetness(matter, fallen, melted, rained, drying * time, reserve[-1] - lowest)
    return Course(
        frames=np.append(np.minimum(begin, frame), frame),
        cover=cover,
        thawed=thawed,
        variance=variance,
        unfilled=unfilled,
        wet=wet if matter.wet else np.full_like(wet, wet[0]),
        seeped=seeped,
        pale=w.halo(age),
        _rained=rained,
        _soaked=soaked,
        _wet_since=wet,
    )


def steady_table(
    weather: Weather, matter: w.Matter, soaking: tuple[float, float], *, ages: int, per_frame: int, frame_rate: float
) -> dict[str, Array]:
    """Effects of a weather that does not change after 0, 1, 2 ... times a part of a frame, each (ages + 1, 3).

    Parameters
    ----------
    weather : Weather
        Of numbers.
    soaking : (float, float)
        Remaining shares of the hollows' soaking at which water is known.
    per_frame : int
        Ages in a frame.

    Returns
    -------
    dict of arrays
        *look*: cover [m], variance [m²], wet look. *loss*: minus the share of a print that is blown full, melt of
        untrodden snow [m], paleness. *hollows*: excess at either share [m] of the time since the first frame, and the
        share that has seeped in.
    """
    last = ages / per_frame
    course = course_of(weather, matter, frame=last, span=Span(0.0, last, frame_rate), moments=ages)
    excess = [course.excess(share) for share in soaking]
    since = {
        "look": (course.cover, course.variance, course._wet_since),
        "loss": (course.unfilled - 1.0, course.thawed, course.pale),
    }
    table = {name: np.stack(three, axis=-1)[ages::-1] for name, three in since.items()}
    soaked = [(taken[0] - taken)[: ages + 1] for taken in excess]
    return table | {"hollows": np.stack([*soaked, course.seeped[ages::-1]], axis=-1)}


def _wetness(matter: w.Matter, fallen: Array, melted: Array, rained: Array, dried: Array, lying: Array) -> Array:
    """Wet look of ground on which weather acts since each moment; `lying` is the water in the new snow [m]."""
    water = _before(dried - rained - (melted if matter.snow_depth else 0.0))
    wet = w.wetness(water[-1] - _least_to_come(water))
    if matter.wet:
        return wet
    gone = _to_now(melted) if matter.snow_depth else _to_now(fallen) - lying
    return wet * w.wetted(_to_now(rained) + gone)


def _before(parts: Array) -> Array:
    """Sum of all parts before each moment."""
    return np.concatenate([[0.0], np.cumsum(parts)])


def _to_now(parts: Array) -> Array:
    """Sum of all parts from each moment on."""
    before = _before(parts)
    return np.asarray(before[-1] - before)


def _least_to_come(values: Array) -> Array:
    return np.asarray(np.minimum.accumulate(values[::-1])[::-1])
