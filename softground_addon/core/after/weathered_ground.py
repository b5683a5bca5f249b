"""A ground under weather: from what a bake left at each place, its age, and the rates, to heights and shading.

z = rest + (1 - filled)·relief(sigma) + level. The level is that of untouched ground, which the weather has acted on
from the start, and in a print that of its own age; relief and bounds of prints lose their edges as variances add up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import weather as w

Array = NDArray[np.float64]

SIGMAS = (0.01, 0.03, 0.09)
"""Standard deviations at which the relief is known besides its own [m]; in between, linear in the variance."""
BOUNDS = (0.0, *(sigma**2 for sigma in SIGMAS))
KNOTS = 6
"""Shares of a hollow's depth that are known: at even steps of the root of what it holds."""


@dataclass(frozen=True)
class Weather:
    """Rates that stay the same, from the first frame of a bake on.

    Attributes
    ----------
    snowfall : float
        New snow [m/s].
    temperature : float
        Of the air [°C].
    wind : float
        At 10 m [m/s].
    rain : float
        [m/s].
    drying : float
        Evaporation [m/s].
    time_scale : float
        How many times faster it goes than the animation.
    """

    snowfall: float = 0.0
    temperature: float = 0.0
    wind: float = 0.0
    rain: float = 0.0
    drying: float = 0.0
    time_scale: float = 1.0


@dataclass(frozen=True)
class Matter:
    """How a ground takes weather.

    Attributes
    ----------
    snow_depth : float
        Depth of the snow that it is made of [m], 0 of all else.
    blown : Blown or None
        What wind does to it.
    soaking : Soaking or None
        How it takes up rain; None where no water stands.
    section : float
        Volume of a print over its width [m²].
    wet : bool
        Whether it is wet to begin with.
    """

    snow_depth: float
    blown: w.Blown | None
    soaking: w.Soaking | None
    section: float
    wet: bool


def matter_of(surface: str, layer_depth: float, section: float) -> Matter:
    """How a surface of the presets takes weather; `layer_depth` of its loose layer [m]."""
    snow = surface == "snow"
    return Matter(
        snow_depth=layer_depth if snow else 0.0,
        blown={"snow": w.SNOW, "sand": w.SAND}.get(surface),
        soaking=w.SOAKING.get(surface),
        section=section,
        wet=surface in ("wet_sand", "mud"),
    )


@dataclass(frozen=True)
class WeatherPlaces:
    """What a bake left at K places, as far as weather needs it.

    Attributes
    ----------
    blur : (K, 3) float array
        What the final relief changes by from its own to each of `SIGMAS`, one after the other [m].
    trodden : (K, 3) float array
        Share of ground in contact at the first of them, and its changes to the next.
    times : (K, 3) float array
        First frame of the first contact there, and last frame that something happened, both from the contacts around
        where there was none; compression at the first of the sigmas [m].
    pool : (K, 3) float array
        What the hollow there holds as a depth of water on it [m], 0 where there is none; height above its bottom [m];
        how much of its soaking is left.
    levels : (K, 6) float array
        Rise of the water at each sixth of the root of the share of what the hollow holds [m].
    """

    blur: Array
    trodden: Array
    times: Array
    pool: Array
    levels: Array


@dataclass(frozen=True)
class Weathered:
    """The ground at a frame, each (K,).

    Attributes
    ----------
    height : array
        What weather changed of it [m].
    wetness, fresh, water : arrays
        How wet it looks and how much of it new snow covers, 0 to 1; depth of standing water [m].
    """

    height: Array
    wetness: Array
    fresh: Array
    water: Array


COVERED = 0.01
"""New snow that hides what is below [m]."""


def weathered(
    places: WeatherPlaces,
    relief: Array,
    weather: Weather,
    matter: Matter,
    *,
    frame: float,
    first_frame: float,
    frame_rate: float,
) -> Weathered:
    """The ground under weather at a frame; `relief` (K,) is what the bake shows there at that frame [m]."""
    pace = weather.time_scale / frame_rate
    pressed, since, compression = places.times.T
    age = np.maximum(frame - since, 0.0) * pace
    of_all = np.full_like(age, max(frame - first_frame, 0.0) * pace)
    fall = {"rate": weather.snowfall, "temperature": weather.temperature}

    cover = np.maximum(w.level_of_snow(age, **fall, depth=0.0), 0.0)
    thawed = w.thawed_depth(age, **fall) if matter.snow_depth else 0.0
    variance = w.drape_variance(cover + thawed) + w.rain_variance(age, weather.rain)
    gone = np.zeros_like(age)
    if matter.blown:
        variance = variance + w.blown_variance(age, weather.wind, matter.blown)
        gone = w.filled_share(age, weather.wind, matter.section, matter.blown)
    share = shares(variance)
    soft = (1.0 - gone) * (relief + (places.blur * share).sum(axis=-1))

    inside = places.trodden[:, 0] + (places.trodden[:, 1:] * share[:, 1:]).sum(axis=-1)
    inside = np.where(frame >= pressed, np.clip(inside, 0.0, 1.0), 0.0)
    left = np.maximum(matter.snow_depth + soft, 0.0) if matter.snow_depth else 0.0
    snow: dict[str, Any] = {**fall, "depth": matter.snow_depth, "left": left}
    around = w.level_of_snow(of_all, **snow)
    level = (1.0 - inside) * around + inside * w.level_of_snow(age, **snow, compression=compression)

    water = _standing(places, soft - relief + level, weather, matter, age)
    return Weathered(
        height=soft - relief + level + water,
        wetness=np.where(water > 0, 1.0, _wetness(weather, matter, of_all, (1.0 - inside) * of_all + inside * age)),
        fresh=np.clip(level / COVERED, 0.0, 1.0),
        water=water,
    )


def _standing(places: WeatherPlaces, change: Array, weather: Weather, matter: Matter, age: Array) -> Array:
    """Depth of the water above ground that has changed by so much (K,) [m]."""
    if matter.soaking is None:
        return np.zeros_like(age)
    capacity, above, left = places.pool.T
    excess = w.rain_excess(age, weather.rain, matter.soaking, left)
    full = np.sqrt(np.clip(np.divide(excess, capacity, out=np.zeros_like(age), where=capacity > 0), 0.0, 1.0))
    rise = (np.clip(full[:, None] * KNOTS - np.arange(KNOTS), 0.0, 1.0) * places.levels).sum(axis=-1)
    return np.where(rise > 0, np.maximum(rise - above - change, 0.0), 0.0)


def _wetness(weather: Weather, matter: Matter, of_all: Array, exposed: Array) -> Array:
    """How wet the ground itself looks; `exposed` is how long each place has dried [s]."""
    dried = w.wetness(exposed, weather.drying) if matter.wet else np.zeros_like(exposed)
    melted = w.melted_water(of_all, weather.temperature)
    if not matter.snow_depth:  # there is no more of it than has fallen
        melted = np.minimum(melted, w.snow_water(of_all, weather.snowfall, weather.temperature))
    return np.maximum(dried, w.wetted(weather.rain * of_all + melted))


def shares(variance: Array) -> Array:
    """How far a variance (K,) [m²] is through each of the spans between `BOUNDS`, (K, 3), 0 to 1."""
    low, high = np.array(BOUNDS[:-1]), np.array(BOUNDS[1:])
    return np.asarray(np.clip((np.asarray(variance)[..., None] - low) / (high - low), 0.0, 1.0))
