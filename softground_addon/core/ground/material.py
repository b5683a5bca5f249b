"""Material of the ground, and the limits of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Literal

LAYER_DEPTH = 0.30
"""Depth of the loose layer [m] (the paper, section 5)."""
RIM_REACH = 0.04
"""Reach of the rim around a contact [m] (the paper, section 5)."""
BLUR_SIGMA = 0.005
"""Standard deviation of the display blur [m] (the paper, Table 1: snow)."""
FIRM_RATIO = 10.0
"""How many times stiffer the ground is below its firm depth, where there is one: enough to stop a sole, not a wall."""
STANDARD_GRAVITY = 9.81
"""Gravity at which materials were measured [m/s²]."""

UNSAID = {"said_if_on": True}
"""Of a field that counts among the inputs of a bake only where it is on: earlier bakes, which lack it, stay current."""


@dataclass(frozen=True)
class GroundMaterial:
    """Material of the ground.

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
        Time in which the ground gives way under a fast landing [s]: tau = `2·dL/|v_n|`, as if a sole that lands at the
        speed v_n came evenly to rest over the depth dL, from this to the characteristic time.
    hardening : float
        How much stiffer compacted ground is against a further contact; see `compress`.
    crust_stress : float
        Stress at which the crust on untouched ground breaks [Pa]; below it, nothing gives.
    firm_depth : float
        Compression beyond which the ground is `FIRM_RATIO` times stiffer [m].
    exponent : float
        Power of the strain with which the stress grows (Bekker's n); the paper's spring is 1.
    densest : float
        Largest strain: what cannot be packed any further. At 0, the layer can be pressed flat, as in the paper.
    edge_width : float
        Width of a sole whose edges bear as much as its area [m] (Bekker's kc/kphi).
    spread : float
        How far a load widens below a sole that has sunk: sideways per depth.
    cohesionless : float
        Part of the stiffness that comes from the ground's own weight, and goes with gravity: 1 for loose sand.
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
    exponent: float = field(default=1.0, metadata=UNSAID)
    densest: float = field(default=0.0, metadata=UNSAID)
    edge_width: float = field(default=0.0, metadata=UNSAID)
    spread: float = field(default=0.0, metadata=UNSAID)
    cohesionless: float = field(default=0.0, metadata=UNSAID)

    @property
    def deepest(self) -> float:
        """Largest compression [m]."""
        return self.layer_depth * (self.densest or 1.0)

    @property
    def linear(self) -> bool:
        """True if stress is proportional to strain, as in the paper."""
        return self.exponent == 1.0 and not self.densest

    def firmness(self, width: float) -> float:
        """Stiffness under a sole of a mean width [m], over that under a very wide one."""
        return 1.0 + self.edge_width / width if self.edge_width else 1.0

    def under(self, gravity: float) -> GroundMaterial:
        """The material where gravity is another than the Earth's [m/s²]."""
        weight = 1.0 + self.cohesionless * (gravity / STANDARD_GRAVITY - 1.0)
        return replace(self, youngs_modulus=self.youngs_modulus * weight) if self.cohesionless else self


OFF = {each.name: float(each.default) for each in fields(GroundMaterial) if each.metadata}  # type: ignore[arg-type]
"""What the fields are that a bake of earlier versions, or one in which they are off, does not say."""
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
    "exponent": (0.2, 5.0),
    "densest": (0.0, 1.0),
    "edge_width": (0.0, 10.0),
    "spread": (0.0, 3.0),
    "cohesionless": (0.0, 1.0),
}
"""Smallest and largest value that is accepted for each field of `GroundMaterial`, in its SI unit (angles in rad)."""
