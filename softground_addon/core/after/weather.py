"""What weather does to a print as it ages, each process as a closed form of its rate and of time.

All in SI units (temperatures in °C), elementwise over arrays. At age 0 and at rate 0 nothing has happened, exactly.

References
----------
Hedstrom and Pomeroy 1998, "Measurements and modelling of snow interception in the boreal forest", Hydrological
Processes 12, doi:10.1002/(SICI)1099-1085(199808/09)12:10/11<1611::AID-HYP684>3.0.CO;2-4: density of new snow.

Essery and others 2013, "A comparison of 1701 snow models using observations from an alpine site", Advances in Water
Resources 55, doi:10.1016/j.advwatres.2012.07.013: settling.

Hock 2003, "Temperature index melt modelling in mountain areas", Journal of Hydrology 282,
doi:10.1016/S0022-1694(03)00257-9: degree-day melt.

Bagnold 1941, "The physics of blown sand and desert dunes": threshold and flux.

Horton 1941, "An approach toward a physical interpretation of infiltration-capacity", Soil Science Society of America
Journal 5, doi:10.2136/sssaj1941.036159950005000C0075x: infiltration.

Ritchie 1972, "Model for predicting evaporation from a row crop with incomplete cover", Water Resources Research 8,
doi:10.1029/WR008i005p01204: drying in two stages.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HOUR, DAY = 3600.0, 86_400.0
WATER_DENSITY, AIR_DENSITY, GRAVITY = 1000.0, 1.2, 9.81

NEW_SNOW = (67.92, 51.25, 2.59, 120.0)
"""Density of new snow at -inf °C, what is added at 0 °C, over how many kelvins it falls, and the most [kg/m³, K]."""
SETTLING = (2.8e-6, 0.042, 0.046)
"""Rate [1/s], its growth with temperature [1/K], and how density slows it [m³/kg] (Essery and others 2013)."""
DEGREE_DAY = 3.5e-3 / DAY
"""Melted water per kelvin above freezing, open ground [m/(s K)] (Hock 2003)."""
DRAPE = 0.03
"""Variance that a print loses its edges by under each metre of new snow [m²/m]: 2-4 cm, by the pictures it gives."""
RAIN_ROUNDING = 0.02
"""Variance for each metre of rain [m²/m]: crisp edges are gone after 10 mm, by the pictures it gives."""
ROUGHNESS_LENGTH = 1e-3
"""Of open ground, for the wind at 10 m [m]."""
KARMAN = 0.4
BAGNOLD = 1.8
"""Bagnold's constant of naturally graded sand."""
HOP = 0.5
"""Part of a hop [m] by which blown grains spread: diffusivity 0.5·q/rho, by the pictures it gives."""
SURFACE_FILM = 1e-3
"""Water that dries as fast as the air takes it [m]; what is below comes up ever slower."""
DRY_AT = 3.0
"""Surface films lost until ground looks dry."""
SHINE = 1e-3
"""Water that wets a dry surface by 63 % [m]."""
HALO = 2.0
"""Time in which pale sand around a loaded foot is wet again [s] (Reynolds dilatancy)."""
SEALING = 5.0
"""How much less ground takes up the more it is compressed: exp(-5·compression/layer depth)."""

GAUSS = ((0.5 - np.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + np.sqrt(0.15), 5 / 18))
"""Places and weights of the Gauss-Legendre rule of three points, over 0 to 1."""


@dataclass(frozen=True)
class Blown:
    """What wind carries.

    Attributes
    ----------
    threshold : float
        Friction velocity below which nothing moves [m/s].
    bulk_density : float
        Of what is laid down [kg/m³].
    """

    threshold: float
    bulk_density: float


SAND = Blown(0.23, 1600.0)
"""Sand of 0.25 mm: 0.1·sqrt((rho_s - rho_a)/rho_a·g·d) (Bagnold 1941)."""
SNOW = Blown(0.27, 150.0)
"""Loose snow: 0.27-0.69 m/s with density (Clifton, Rüedi and Lehning 2006, doi:10.3189/172756506781828430)."""


@dataclass(frozen=True)
class Soaking:
    """How fast ground takes up water: at first and in the end [m/s], and how fast it goes from one to the other [1/s].

    As Horton's f = final + (first - final)·exp(-decay·t).
    """

    first: float
    final: float
    decay: float


SOAKING = {
    "sand": Soaking(127e-3 / HOUR, 10e-3 / HOUR, 4.0 / HOUR),
    "wet_sand": Soaking(30e-3 / HOUR, 8e-3 / HOUR, 4.0 / HOUR),
    "soil": Soaking(76e-3 / HOUR, 5e-3 / HOUR, 4.0 / HOUR),
    "mud": Soaking(25e-3 / HOUR, 1e-3 / HOUR, 4.0 / HOUR),
}
"""Sand, loam and clay, dry; wet sand has had its first rain. Snow takes up what falls."""


def new_snow_density(temperature: Any) -> Array:
    """Density of falling snow [kg/m³].

    Examples
    --------
    >>> new_snow_density([-20.0, -5.0, 0.0, 5.0]).round(1)
    array([ 67.9,  75.4, 119.2, 120. ])
    """
    least, more, fall, most = NEW_SNOW
    return np.minimum(least + more * np.exp(np.asarray(temperature, dtype=np.float64) / fall), most)


def settled_density(age: Any, temperature: Any, density: Any) -> Array:
    """Density of snow that was laid down with a density [kg/m³] some time ago [s]."""
    rate, warmth, slowing = SETTLING
    speed = slowing * np.asarray(density) * rate * np.exp(warmth * np.minimum(temperature, 0.0))
    return np.asarray(density + np.log1p(speed * np.asarray(age, dtype=np.float64)) / slowing)


def snow_cover(age: Any, rate: Any, temperature: Any) -> Array:
    """Depth of what has fallen over a time [s] at a rate [m/s of new snow], each layer settled by its own age [m]."""
    age, density = np.asarray(age, dtype=np.float64), new_snow_density(temperature)
    kept = sum(weight * density / settled_density(at * age, temperature, density) for at, weight in GAUSS)
    return np.asarray(rate * age * kept)


def snow_water(age: Any, rate: Any, temperature: Any) -> Array:
    """Water in what has fallen over a time [s] at a rate [m/s of new snow] [m]."""
    return np.asarray(np.asarray(age) * rate * new_snow_density(temperature) / WATER_DENSITY)


def melted_water(age: Any, temperature: Any) -> Array:
    """What warmth melts over a time [s], as water [m]."""
    return np.asarray(DEGREE_DAY * np.maximum(temperature, 0.0) * np.asarray(age))


def thawed_depth(age: Any, rate: Any, temperature: Any, density: float = SNOW.bulk_density) -> Array:
    """Depth of untrodden ground that melts once the new snow is gone [m], were it deep enough."""
    over = melted_water(age, temperature) - snow_water(age, rate, temperature)
    return np.asarray(np.maximum(over, 0.0) * WATER_DENSITY / density)


def level_of_snow(
    age: Any, rate: Any, temperature: Any, *, depth: Any, compression: Any = 0.0, left: Any = None
) -> Array:
    """Change of a surface's height by what falls on it and what melts [m]: new snow first, then the ground's own.

    Parameters
    ----------
    age : array
        Time [s].
    rate, temperature : float
        Of new snow [m/s], and of the air [°C].
    depth : array
        Depth of the snow that the ground is made of [m], 0 where it is something else.
    compression : array
        What was trodden down of it [m]. It melts the less the denser it is, as fewer of its grains are open to the
        air, and stands up in the end. That this goes with 1/density is by the pictures it gives.
    left : array, optional
        What there is to melt [m]; by default the depth without the compression.
    """
    fallen, water = snow_cover(age, rate, temperature), snow_water(age, rate, temperature)
    melted = melted_water(age, temperature)
    share = np.clip(1.0 - np.divide(melted, water, out=np.ones_like(melted), where=water > 0), 0.0, 1.0)
    trodden = np.maximum(depth - np.asarray(compression, dtype=np.float64), 0.0)
    ratio = np.divide(trodden, depth, out=np.ones_like(trodden), where=np.asarray(depth) > 0)
    below = thawed_depth(age, rate, temperature) * ratio**2
    return np.asarray(fallen * share - np.minimum(below, trodden if left is None else left))


def friction_velocity(wind: Any) -> Array:
    """Of a wind at 10 m over open ground, both [m/s]."""
    return np.asarray(KARMAN * np.asarray(wind, dtype=np.float64) / np.log(10.0 / ROUGHNESS_LENGTH))


def blown_flux(wind: Any, blown: Blown) -> Array:
    """What a wind [m/s] carries across each metre [kg/(m s)]: nothing below the threshold (Bagnold 1941)."""
    speed = friction_velocity(wind)
    return np.where(speed > blown.threshold, BAGNOLD * AIR_DENSITY / GRAVITY * speed**3, 0.0)


def filled_share(age: Any, wind: Any, section: Any, blown: Blown) -> Array:
    """Share of a print that is blown full after a time [s]; `section` is its volume over its width [m²]."""
    rate = blown_flux(wind, blown) / (np.asarray(section) * blown.bulk_density)
    return np.asarray(-np.expm1(-np.asarray(age) * rate))


def blown_variance(age: Any, wind: Any, blown: Blown) -> Array:
    """Variance by which creeping grains have blurred edges after a time [s] [m²]."""
    return np.asarray(2.0 * HOP * blown_flux(wind, blown) / blown.bulk_density * np.asarray(age))


def drape_variance(cover: Any) -> Array:
    """Variance by which edges are blurred under a depth of new snow, or by the melt of one [m] [m²]."""
    return np.asarray(DRAPE * np.maximum(cover, 0.0))


def rain_variance(age: Any, rate: Any) -> Array:
    """Variance by which rain at a rate [m/s] has rounded edges after a time [s] [m²]."""
    return np.asarray(RAIN_ROUNDING * np.asarray(rate) * np.asarray(age))


def rain_excess(age: Any, rate: Any, soaking: Soaking, share: Any = 1.0) -> Array:
    """Rain at a rate [m/s] that the ground has not taken up after a time [s], as a depth [m].

    `share` is how much of its soaking is left under a sole, see `SEALING`.
    """
    age, first, final = np.asarray(age, dtype=np.float64), share * soaking.first, share * soaking.final
    drop = np.asarray(first - final, dtype=np.float64)
    over = np.maximum(rate - final, 0.0)
    part = np.clip(np.divide(over, drop, out=np.ones_like(over * drop), where=drop > 0), 1e-30, 1.0)
    begin = np.minimum(-np.log(part) / soaking.decay, age)  # when rain first exceeds what soaks in
    soaked = drop / soaking.decay * (np.exp(-soaking.decay * begin) - np.exp(-soaking.decay * age))
    return np.asarray(np.where(over > 0, np.maximum(over * (age - begin) - soaked, 0.0), 0.0))


def seep_level(age: Any, table: Any, time: Any) -> Array:
    """Water that has seeped into a print from below after a time [s], up to the water table [m]; 2-30 s on a beach."""
    return np.asarray(table * -np.expm1(-np.asarray(age) / time))


def wetness(age: Any, evaporation: Any) -> Array:
    """How wet ground looks, 1 to 0, that dries for a time [s] at an evaporation [m/s].

    The surface film goes as fast as the air takes it; after that what was lost grows with the square root of time.
    """
    films = np.asarray(age, dtype=np.float64) * evaporation / SURFACE_FILM
    lost = np.where(films > 1.0, 2.0 * np.sqrt(np.maximum(films, 1.0)) - 1.0, films)
    return np.asarray(np.maximum(1.0 - lost / DRY_AT, 0.0))


def wetted(water: Any) -> Array:
    """How wet dry ground looks, 0 to 1, after so much water [m]."""
    return np.asarray(-np.expm1(-np.asarray(water) / SHINE))


def halo(age: Any) -> Array:
    """How much paler wet sand around a foot is, 1 to 0, some time after the load [s]."""
    return np.asarray(np.exp(-np.asarray(age) / HALO))
