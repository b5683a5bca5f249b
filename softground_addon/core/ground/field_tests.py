"""Ground from tests in the field: snow by the hand test, sand and soil by their moisture, soil by plates too."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from .ground_law import load_at, strain
from .material import GroundMaterial

FIST, FOUR_FINGERS, ONE_FINGER, PENCIL, KNIFE = 1.0, 2.0, 3.0, 4.0, 5.0
"""What can just be pushed into the snow by hand with a force of about 10 N (Fierz and others 2009, "The International
Classification for Seasonal Snow on the Ground")."""
BOOT_STRESS, BOOT_WIDTH = 33e3, 0.10
"""A person with a pack on one boot [Pa], [m]."""
HARDNESS = np.array([1.12, 1.37, 1.62, 1.87, 2.16, 2.5, 2.83, 3.16, 3.5, 3.83, 4.2, 5.0])
BOOT_DEPTH = np.array([0.50, 0.45, 0.40, 0.35, 0.30, 0.25, 0.20, 0.15, 0.10, 0.065, 0.05, 0.02])
"""How deep that boot sinks in snow of this hardness [m]: medians of 19,811 snow pits (SnowPilot.org, 2019-2024)."""
DENSITY = np.array([110.0, 210.0, 280.0, 330.0, 420.0])
"""Of snow, from fist to knife [kg/m³]: from the pits up to one finger, beyond it as usual."""
PACKED_DENSITY = 500.0
"""That wheels pack snow to [kg/m³]."""
LAYERS = 0.2, 1.5
"""Depth of a layer that follows from the hardness [m]."""
FULL = 0.97
"""Most of the densest packing that the standing boot may reach, where a layer is thin."""
POISSON_RATIO = (1.12, 1.62, 2.16, 3.16, 3.8, 4.8), (0.01, 0.02, 0.03, 0.05, 0.05, 0.10)
RIM_REACH = (1.12, 3.8), (0.08, 0.04)
SETTLING_TIME = (3.8, 4.8), (0.2, 0.1)
"""By hardness; placed, not measured: powder raises nothing that is seen."""
MOISTURE = np.array([0.0, 0.3, 0.6, 1.0])
SAND_DEPTH = np.array([0.0304, 0.0051, 0.0013, 0.0256])
SAND_EXPONENT = np.array([1.1, 0.8, 0.79, 0.8])
SAND_EDGES = np.array([0.00065, 0.0192, 0.0192, 0.0192])
"""Of a dune, and of damp, wet and soaked sand, under the standing boot [m]: the first and third by plates, the others
placed. Dry and soaked sand are deep, the moist states between are shallow (Jackson, Whyte and Romano 2010,
doi:10.1080/10420940.2010.510026)."""
SOIL_MOISTURE = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
SOIL_DEPTH = np.array([0.004, 0.008, 0.0114, 0.037, 0.098])
"""Of dry loam, of soil, and of stiff, soft and liquid mud, under the standing boot [m]: the first by plates (Wong,
Theory of Ground Vehicles), the others placed. The wetter, the deeper (Platt, Hasiotis and Hirmas 2012,
doi:10.2110/palo.2012.p12-006r)."""
BY_HARDNESS = ("youngs_modulus", "layer_depth", "exponent", "densest", "edge_width", "spread")
"""Fields that the hand hardness sets."""


def snow(hardness: float, layer_depth: float | None = None) -> GroundMaterial:
    """Snow of a hand hardness, from `FIST` to `KNIFE`.

    Parameters
    ----------
    layer_depth : float, optional
        Depth of the snow [m]; at least what the boot needs, if not given.

    Examples
    --------
    >>> settled = snow(2.16)
    >>> f"{settled.youngs_modulus / 1e3:.0f} kPa, {settled.layer_depth:.2f} m, {boot_depth(settled):.3f} m"
    '137 kPa, 1.08 m, 0.300 m'
    """
    depth = float(np.interp(hardness, HARDNESS, BOOT_DEPTH))
    densest = 1.0 - float(np.interp(hardness, np.arange(1, 6), DENSITY)) / PACKED_DENSITY
    layer = layer_depth if layer_depth is not None else float(np.clip(2.0 * depth / densest, *LAYERS))
    nu, reach, time = (float(np.interp(hardness, *table)) for table in (POISSON_RATIO, RIM_REACH, SETTLING_TIME))
    loose = GroundMaterial(
        1.0, nu, time, layer, rim_reach=reach, exponent=2.0, densest=densest, edge_width=0.2, spread=0.5
    )
    return with_boot_depth(loose, min(depth, FULL * densest * layer))


def with_boot_depth(material: GroundMaterial, depth: float) -> GroundMaterial:
    """The material as stiff as it is where a standing boot sinks to a depth [m]."""
    load = float(load_at(depth / material.layer_depth, material))
    return replace(material, youngs_modulus=BOOT_STRESS / (material.firmness(BOOT_WIDTH) * load))


def boot_depth(material: GroundMaterial) -> float:
    """Sinkage of a standing boot [m]."""
    load = BOOT_STRESS / (material.youngs_modulus * material.firmness(BOOT_WIDTH))
    return float(strain(load, material)) * material.layer_depth


def hardness_of(material: GroundMaterial) -> float:
    """The hand hardness of snow in which a standing boot sinks as deep."""
    return float(np.interp(-boot_depth(material), -BOOT_DEPTH, HARDNESS))


def hardened(material: GroundMaterial, hardness: float) -> GroundMaterial:
    """Snow as it is but for its hand hardness: rim and settling time stay."""
    other = snow(hardness)
    return replace(material, **{name: getattr(other, name) for name in BY_HARDNESS})


def moistened(material: GroundMaterial, moisture: float) -> GroundMaterial:
    """Sand as it is but for its moisture, from 0, dry, to 1, soaked; only what is dry goes with gravity."""
    depth, exponent, edges = _of_moisture(moisture)
    dry = float(np.interp(moisture, MOISTURE[:2], (1.0, 0.0)))
    material = replace(material, exponent=float(exponent), edge_width=float(edges), cohesionless=dry)
    return _with_depth_up_to_packed(material, float(np.exp(depth)))


def moisture_of(material: GroundMaterial) -> float:
    """The moisture of the sand that is most like a material."""
    moisture = np.linspace(0.0, 1.0, 101)
    depth, exponent, edges = _of_moisture(moisture)
    apart = (depth - np.log(boot_depth(material))) ** 2 + (exponent - material.exponent) ** 2
    return float(moisture[(apart + ((edges - material.edge_width) / BOOT_WIDTH) ** 2).argmin()])


def wetted(material: GroundMaterial, moisture: float) -> GroundMaterial:
    """Soil or mud as it is but for its moisture, from 0, dry and firm, to 1, liquid."""
    return _with_depth_up_to_packed(material, float(np.exp(np.interp(moisture, SOIL_MOISTURE, np.log(SOIL_DEPTH)))))


def wetness_of(material: GroundMaterial) -> float:
    """The moisture of the soil in which a standing boot sinks as deep."""
    return float(np.interp(np.log(boot_depth(material)), np.log(SOIL_DEPTH), SOIL_MOISTURE))


def _with_depth_up_to_packed(material: GroundMaterial, depth: float) -> GroundMaterial:
    limit = FULL * material.deepest if material.densest else material.layer_depth
    return with_boot_depth(material, min(depth, limit))


def _of_moisture(moisture: Any) -> tuple[Any, Any, Any]:
    """Logarithm of the boot's depth, exponent and edge width of sand."""
    tables = np.log(SAND_DEPTH), SAND_EXPONENT, SAND_EDGES
    depth, exponent, edges = (np.interp(moisture, MOISTURE, table) for table in tables)
    return depth, exponent, edges


def plates(kc: float, kphi: float, exponent: float, layer_depth: float = 0.3) -> GroundMaterial:
    """Soil that plates were pressed into: stress = (kc/width + kphi)·sinkage^exponent (Bekker 1969).

    Parameters
    ----------
    kc : float
        [Pa m^(1 - exponent)], as [N/m^(exponent + 1)].
    kphi : float
        [N/m^(exponent + 2)].
    layer_depth : float
        Beyond which nothing sinks [m]; up to there, no depth depends on it.

    Examples
    --------
    >>> loam = plates(5_270, 1_515_040, 0.7)
    >>> round(boot_depth(loam), 4)
    0.004
    """
    return GroundMaterial(
        kphi * layer_depth**exponent, 0.35, 0.05, layer_depth, exponent=exponent, edge_width=kc / kphi
    )
