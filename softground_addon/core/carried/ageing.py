"""What becomes of a mark: snow melts, water dries and rain washes off, for arrays and for nodes alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..ground.surfaces import Liquid, SurfaceRecord
from ..weather import weather

WASH_OFF = 0.18
"""Share that a millimetre of rain washes off paved ground, of what is there [1/mm]: 90 % by half an inch (J. D. Sartor
and G. B. Boyd, EPA-R2-72-081, 1972, as in the Storm Water Management Model)."""
MILLIMETRES_PER_HOUR = 1e-3 / weather.HOUR
"""In metres per second."""
THINNEST, SLOWEST = 1e-9, 1e-15
"""Mass [kg/m²] and melting rate [m/s] that are none, so that nothing is divided by 0."""


@dataclass(frozen=True)
class AgedMark:
    """Mass [kg/m²], wet look from 1 to 0, and of snow the share that has melted; numbers, arrays or nodes."""

    mass: Any
    wetness: Any
    melted: Any


def aged(mass: Any, age: Any, surface: SurfaceRecord | Liquid, drying: Any, rain: Any, temperature: Any) -> AgedMark:
    """A mark of some mass [kg/m²] at an age [s], as wet as the air leaves what rain does not wash off.

    Rates times the age are all that counts, so that it may be in frames, and the rates for each frame.

    Parameters
    ----------
    drying, rain : float
        [mm/h]
    temperature : float
        Of the floor [°C].
    """
    assert surface.carried is not None
    fallen = age * rain * (MILLIMETRES_PER_HOUR * 1e3)
    remaining = mass * np.exp(fallen * -WASH_OFF)
    water = np.maximum(remaining, THINNEST) * (surface.carried.water / weather.WATER_DENSITY)
    passed, melted = age, 0.0
    if surface.melts:
        rate = weather.melting_rate(temperature)
        melts = passed * rate
        melted = np.minimum(melts / water, 1.0)
        passed = np.maximum(melts - water, 0.0) / np.maximum(rate, SLOWEST)
    lost = passed * np.maximum(drying - rain, 0.0) * MILLIMETRES_PER_HOUR
    wet = weather.wetness(lost / water * weather.SURFACE_FILM)
    return AgedMark(remaining, wet, melted)
