"""A ground under weather: from what a bake left at each place, its age, and the rates, to heights and shading.

z = rest + unfilled·relief(sigma) + level. The level is that of untouched ground, which weather has acted on from the
start, and in a print that since it was made; relief and bounds of prints lose their edges as variances add up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softground_addon.core.weather import weather as w
from softground_addon.core.weather.weather import Span
from softground_addon.core.weather.weather_course import Course, Weather, course_of
from softground_addon.core.weather.weather_places import (
    COVERED,
    LEAST_RANGE,
    NEAR,
    POWERS,
    WeatherPlaces,
    shares,
    soaking_shares,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Weathered:
    """The ground at a frame, each (K,).

    Attributes
    ----------
    height : array
        What weather changed of it [m].
    wetness, fresh, water : arrays
        How wet it looks and how much of it new snow covers, 0 to 1; depth of standing water [m].
    dried : array
        How dry it looks where it was wet to begin with, 0 to 1.
    unfilled : array
        The part of a print that is not blown full, 0 to 1.
    """

    height: Array
    wetness: Array
    fresh: Array
    water: Array
    dried: Array
    unfilled: Array


def weathered(
    places: WeatherPlaces, relief: Array, weather: Weather, matter: w.Matter, *, frame: float, span: Span
) -> Weathered:
    """The ground under weather at a frame; `relief` (K,) is what the bake shows there at that frame [m]."""
    course = course_of(weather, matter, frame=frame, span=span)
    pressed, _, compression = places.times.T
    since, blur = _since(places, frame), np.where(frame < places.again[:, :1], places.blur_before, places.blur)
    share = shares(course.since(since, course.variance))
    unfilled = course.since(since, course.unfilled)
    soft = unfilled * (relief + (blur * share).sum(axis=-1))

    inside = places.trodden[:, 0] + (places.trodden[:, 1:] * share[:, 1:]).sum(axis=-1)
    inside = np.where(frame >= pressed, np.clip(inside, 0.0, 1.0), 0.0)
    lower = inside * unfilled  # what is blown full lies as high as open ground
    cover = course.cover[0] + lower * (course.since(since, course.cover) - course.cover[0])
    change = soft - relief + cover
    if matter.snow_depth:
        # Trodden snow melts the less the denser it is, as fewer of its grains are open to the air, and stands up in
        # the end. That this goes with 1/density is by the pictures it gives.
        ratio = np.maximum(1.0 - compression / matter.snow_depth, 0.0)
        snow = np.maximum(matter.snow_depth + soft, 0.0)
        around = np.minimum(course.thawed[0], snow)
        within = np.minimum(course.since(since, course.thawed) * ratio**2, snow)
        change = change - around - lower * (within - around)

    water = _standing(places, relief + change, weather, matter, course)
    looks = course.wet[0] + inside * (course.since(since, course.wet) - course.wet[0])
    wetness = np.where(water > 0, 1.0, looks)
    return Weathered(
        height=change + water,
        wetness=wetness,
        fresh=np.clip(cover / COVERED, 0.0, 1.0),
        water=water,
        dried=_dried(places, wetness, weather, matter, course, frame),
        unfilled=unfilled,
    )


def _since(places: WeatherPlaces, frame: float) -> Array:
    """End of the contact that the age of each place counts from."""
    again, before = places.again.T
    return np.where(frame < again, before, places.times[:, 1])


def _dried(
    places: WeatherPlaces, wetness: Array, weather: Weather, matter: w.Matter, course: Course, frame: float
) -> Array:
    """How much of ground that was wet looks dry, 0 to 1."""
    if not matter.wet:
        return np.zeros_like(wetness)
    dried = 1.0 - wetness
    if matter.pales:
        pressed, since = places.times[:, 0], _since(places, frame)
        near = np.clip(places.trodden.sum(axis=-1) * NEAR, 0.0, 1.0) * (frame >= pressed)
        dried = np.maximum(dried, weather.halo * near * course.since(since, course.pale))
    return dried


def _standing(places: WeatherPlaces, height: Array, weather: Weather, matter: w.Matter, course: Course) -> Array:
    """Depth of the water above ground that is so high above its place at rest (K,) [m]."""
    if matter.soaking is None:
        return np.zeros_like(height)
    capacity, above, spilled = places.pool.T
    since, rise = places.levels[:, POWERS], places.levels[:, :POWERS]
    low, high = soaking_shares(places)
    at_low, at_high = (course.since(since, course.excess(share)) for share in (low, high))
    excess = at_low + (at_high - at_low) * np.clip((spilled - low) / max(high - low, LEAST_RANGE), 0.0, 1.0)
    full = np.sqrt(np.clip(np.divide(excess, capacity, out=np.zeros_like(height), where=capacity > 0), 0.0, 1.0))
    rain = (full[:, None] ** np.arange(1, POWERS + 1) * rise).sum(axis=-1)
    seep = np.maximum(rise.sum(axis=-1) - weather.water_table, 0.0) * course.since(since, course.seeped)
    level = np.maximum(rain, seep)
    return np.where(level > 0, np.maximum(level - above - height, 0.0), 0.0)
