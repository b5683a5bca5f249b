"""Effects of weather on ground, process by process: rates, and the results of their integrals over time.

All in SI units (temperatures in °C), elementwise over arrays, or over the nodes' numbers of `blender.node_graph`: the
same laws make the node group. Where an integral is 0 nothing has happened, exactly.

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

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..ground import surfaces
from ..ground.surfaces import Soaking

HOUR, DAY = surfaces.HOUR, 86_400.0
WATER_DENSITY, AIR_DENSITY, GRAVITY = 1000.0, 1.2, 9.81

NEW_SNOW = (67.92, 51.25, 2.59, 120.0)
"""Density of new snow at -inf °C, its increase at 0 °C, the kelvins over which this falls, and the most [kg/m³, K]."""
SETTLING = (2.8e-6, 0.042, 0.046)
"""Rate [1/s], its growth with temperature [1/K], and its fall with density [m³/kg] (Essery and others 2013)."""
DEGREE_DAY = 3.5e-3 / DAY
"""Melted water per kelvin above freezing, open ground [m/(s K)] (Hock 2003)."""
DRAPE = 0.03
"""Variance that a print loses its edges by under each metre of new snow [m²/m]: 2-4 cm, by the pictures it gives."""
RAIN_ROUNDING = 0.02
"""Variance for each metre of rain [m²/m]: crisp edges are gone after 10 mm, by the pictures it gives."""
ROUGHNESS_LENGTH = 1e-3
"""Roughness of open ground, for the wind at 10 m [m]."""
KARMAN = 0.4
BAGNOLD = 1.8
"""Bagnold's constant of naturally graded sand."""
HOP = 0.5
"""Part of a hop [m] by which blown grains spread: diffusivity 0.5·q/rho, by the pictures it gives."""
SURFACE_FILM = 1e-3
"""Water that dries as fast as the air takes it [m]; water below comes up ever slower."""
SOAKED = (0.42, 0.38, 0.34)
"""What is left of a dry ground's colour when it is wet (Lekner and Dorf 1988, doi:10.1364/AO.27.001278: about half)."""
PALE = (1.0 / SOAKED[0], 1.0 / SOAKED[1], 1.0 / SOAKED[2])
"""Wet ground's colour when it is dry, over what it was."""
DRY_AT = 3.0
"""Surface films lost until ground looks dry."""
SHINE = 1e-3
"""Water that wets a dry surface by 63 % [m]."""
HALO = 2.0
"""Time in which pale sand around a loaded foot is wet again [s] (Reynolds dilatancy)."""
LEAST_SECTION = 1e-9
"""A print that holds no more is full [m²]."""
SEALING = 5.0
"""Loss of uptake with compression: exp(-5·compression/layer depth)."""


PARTS = 256
"""Parts of the time from the first frame of the weather to the last frame at which anything begins or changes."""
MOMENTS = 4 * PARTS
"""Moments that this time is divided into, at which vertices were last stepped on."""
NO_WATER = 1.0
"""Depth of a water table that no print reaches [m]."""


@dataclass(frozen=True)
class Span:
    """The frames of the animation from which on there is weather and up to which it is known in parts, and [Hz]."""

    first: float
    last: float
    frame_rate: float

    @property
    def step(self) -> float:
        """Length of a part in frames."""
        return (self.last - self.first) / PARTS


def span_of(first: float, last: float, frame_rate: float = 1.0) -> Span:
    """A span of parts of whole frames."""
    return Span(first, first + PARTS * max(math.ceil((last - first) / PARTS), 1), frame_rate)


def moment_of(frame: Any, span: Span) -> Any:
    """Number of the moment that is nearest to a frame, of those from 0 to `MOMENTS` into which a span is divided.

    Examples
    --------
    >>> moment_of([-5.0, 1.0, 1.2, 257.0, 1e9], span_of(1.0, 257.0))
    array([   0,    0,    1, 1024, 1024])
    """
    through = np.subtract(frame, span.first) / (span.last - span.first)
    return np.rint(np.clip(through, 0.0, 1.0) * MOMENTS).astype(np.intp)


def new_snow_density(temperature: Any) -> Any:
    """Density of falling snow [kg/m³].

    Examples
    --------
    >>> new_snow_density([-20.0, -5.0, 0.0, 5.0]).round(1)
    array([ 67.9,  75.4, 119.2, 120. ])
    """
    least, more, fall, most = NEW_SNOW
    return np.minimum(least + more * np.exp(np.divide(temperature, fall)), most)


def settling_rate(temperature: Any) -> Any:
    """Rate at which snow settles at an air temperature [1/s]."""
    rate, warmth, _ = SETTLING
    return rate * np.exp(warmth * np.minimum(temperature, 0.0))


def settled_density(settling: Any, density: Any) -> Any:
    """Density of snow that was laid down with a density [kg/m³], after an integral of `settling_rate` over time."""
    slowing = SETTLING[2]
    return density + np.log1p(slowing * density * settling) / slowing


def melting_rate(temperature: Any) -> Any:
    """Melt by warmth, as water [m/s]."""
    return DEGREE_DAY * np.maximum(temperature, 0.0)


def friction_velocity(wind: Any) -> Any:
    """Friction velocity of a wind at 10 m over open ground, both [m/s]."""
    return np.multiply(wind, KARMAN / np.log(10.0 / ROUGHNESS_LENGTH))


def blown_flux(wind: Any, threshold: float) -> Any:
    """Transport by a wind [m/s] across each metre [kg/(m s)]: nothing below a friction velocity (Bagnold 1941)."""
    speed = friction_velocity(wind)
    return BAGNOLD * AIR_DENSITY / GRAVITY * speed * speed * speed * np.greater(speed, threshold)


def fill_rate(flux: Any, section: float, density: float) -> Any:
    """Rate at which what is open of a print is blown full [1/s]; `section` is its volume over its width [m²]."""
    return flux / (max(section, LEAST_SECTION) * density)


def spread_rate(flux: Any, density: float) -> Any:
    """Growth of the variance by which creeping grains blur edges [m²/s]."""
    return 2.0 * HOP / density * flux


def worn(compression: Any, rim: Any, change: Any) -> tuple[Any, Any]:
    """Compression and rim of ground that has risen by a change, or fallen [m].

    New matter fills a hollow before it stands above the ground; loss takes from a rim first.

    Examples
    --------
    >>> worn(np.array([4.0, 0.0]), np.array([0.0, 1.0]), np.array([5.0, -3.0]))
    (array([0., 2.]), array([1., 0.]))
    """
    deep = compression - rim - change
    compressed = np.maximum(np.maximum(compression - np.maximum(change, 0.0), 0.0), deep)
    return compressed, compressed - deep


def soaked(wet: Any, soaking: Soaking) -> Any:
    """Water that open ground can take up in a time of rain [s] [m]: the integral of Horton's rate."""
    more = (soaking.first - soaking.final) / soaking.decay
    return soaking.final * wet - more * np.expm1(-soaking.decay * wet)


def seeped(age: Any, soaking: Soaking) -> Any:
    """Share of its full height that water from below has reached in a print after a time [s]."""
    return 1.0 - np.exp(np.divide(age, -soaking.seep))


def wetness(lost: Any) -> Any:
    """Wet look of ground, 1 to 0, that would have lost so much water [m] by now, had it stayed a film.

    The surface film goes as fast as the air takes it; after that the loss grows with the square root of time.
    """
    films = np.divide(lost, SURFACE_FILM)
    dried = np.minimum(films, 1.0) + 2.0 * (np.sqrt(np.maximum(films, 1.0)) - 1.0)
    return np.maximum(1.0 - dried / DRY_AT, 0.0)


def wetted(water: Any) -> Any:
    """Wet look of dry ground, 0 to 1, after so much water [m]."""
    return 1.0 - np.exp(np.divide(water, -SHINE))


def halo(age: Any) -> Any:
    """Paleness of wet sand around a foot, 1 to 0, a time after the load [s]."""
    return np.exp(np.divide(age, -HALO))


@dataclass(frozen=True)
class Matter:
    """Response of a ground to weather.

    Attributes
    ----------
    snow_depth : float
        Depth of the snow that it is made of [m], 0 of all else.
    density : float
        Of its loose matter [kg/m³].
    drifts_from : float or None
        Friction velocity of the wind from which it moves [m/s].
    soaking : Soaking or None
        Its uptake of rain; None where no water stands.
    section : float
        Volume of a print over its width [m²].
    wet : bool
        True if it is wet to begin with.
    pales : bool
        True if it turns pale around a loaded foot, as wet sand does.
    """

    snow_depth: float
    density: float
    drifts_from: float | None
    soaking: Soaking | None
    section: float
    wet: bool
    pales: bool


HARD_FLOOR = Matter(0.0, WATER_DENSITY, None, None, 0.0, wet=False, pales=False)
"""A floor of stone or planks: new snow lies on it and melts, and rain wets it; nothing else happens to it."""


def matter_of(surface: str, layer_depth: float, section: float) -> Matter:
    """Response of a surface to weather; `layer_depth` of its loose layer [m]."""
    of = surfaces.find(surface)
    depth = layer_depth if of.melts else 0.0
    return Matter(depth, of.density, of.drifts_from, of.soaking, section, of.wet, of.pales)
