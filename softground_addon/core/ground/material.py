"""What the ground is made of, and how far each of its parameters may go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

LAYER_DEPTH = 0.30
"""Depth of the loose layer [m] (the paper, section 5)."""
RIM_REACH = 0.04
"""Reach of the rim around a contact [m] (the paper, section 5)."""
BLUR_SIGMA = 0.005
"""Standard deviation of the display blur [m] (the paper, Table 1: snow)."""
FIRM_RATIO = 10.0
"""How many times stiffer the ground is below its firm depth, where there is one: enough to stop a sole, not a wall."""


@dataclass(frozen=True)
class GroundMaterial:
    """What the ground is made of.

    The fields from `rim_bias` on go beyond the paper; at 0 they are off.

    Attributes
    ----------
    youngs_modulus : float
        Compaction modulus of the loose layer [Pa].
    poisson_ratio : float
        How much of the compressed volume rises as a rim, 0 (none) to 0.5 (all).
    characteristic_time : float
        Time that the ground takes to give way [s].
    layer_depth : float
        Depth of the loose layer, the most that it can be compressed by [m].
    rim_reach : float
        Reach of the rim around a contact [m].
    blur_sigma : float
        Standard deviation of the display blur [m].
    rim_bias : float
        How much more of the rim rises on the side that the sole moves toward, 0 to 1: shares 1 + b·cos(theta).
    repose_angle : float
        Steepest slope that loose ground keeps [rad]; what is steeper slides down.
    shortest_time : float
        Time in which the ground gives way under a fast landing [s]: tau = 2·dL/|v_n|, as if a sole that lands at the
        speed v_n came evenly to rest over the depth dL, from this to the characteristic time.
    hardening : float
        How much stiffer compacted ground is against a further contact; see `compress`.
    crust_stress : float
        Stress at which the crust on untouched ground breaks [Pa]; below it, nothing gives.
    firm_depth : float
        Compression beyond which the ground is `FIRM_RATIO` times stiffer [m].
    """

    youngs_modulus: float
    poisson_ratio: float
    characteristic_time: float
    layer_depth: float = LAYER_DEPTH
    rim_reach: float = RIM_REACH
    blur_sigma: float = BLUR_SIGMA
    rim_bias: float = 0.0
    repose_angle: float = 0.0
    shortest_time: float = 0.0
    hardening: float = 0.0
    crust_stress: float = 0.0
    firm_depth: float = 0.0


Pressure = Literal["UNIFORM", "CENTRE_OF_PRESSURE"]
"""Evenly, as in the paper; or more where the force acts, so that it acts there."""
MATERIAL_RANGES: Mapping[str, tuple[float, float]] = {
    "youngs_modulus": (1e3, 1e10),
    "poisson_ratio": (0.0, 0.5),
    "characteristic_time": (1e-3, 60.0),
    "layer_depth": (1e-3, 100.0),
    "rim_reach": (0.0, 10.0),
    "blur_sigma": (0.0, 1.0),
    "rim_bias": (0.0, 1.0),
    "repose_angle": (0.0, 1.4),
    "shortest_time": (0.0, 60.0),
    "hardening": (0.0, 1e3),
    "crust_stress": (0.0, 1e9),
    "firm_depth": (0.0, 100.0),
}
"""Smallest and largest value that is accepted for each field of `GroundMaterial`, in its SI unit (angles in rad)."""
