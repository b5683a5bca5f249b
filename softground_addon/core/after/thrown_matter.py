"""What each surface throws: how dense it is, how it flies, in which sizes, and how much a sole carries away."""

from __future__ import annotations

from dataclasses import dataclass

from ..ground.crumbs import LARGEST


@dataclass(frozen=True)
class ThrownMatter:
    """A surface's matter in the air.

    Attributes
    ----------
    density : float
        Of the loose matter [kg/m³].
    repose : float
        Angle of repose: what pushes along the ground harder than that throws it [deg].
    film : float
        Thickness of what a sole sheds after it has left, over its area [m]: what stays on it is no debris.
    lumps : int
        In how many lumps it comes off, which break as they do; 0 where it trickles.
    sizes : (float, float)
        Smallest and largest diameter [m]: see `core.ground.crumbs`.
    settling : (float, float)
        Speed at which the smallest and the largest fall at last [m/s].
    most : int
        Pieces of a step in one phase at most: what is more is drawn as larger ones.
    fine : float
        Share of the volume in as many single grains, as a mist between the pieces.
    """

    density: float
    repose: float
    film: float
    lumps: int
    sizes: tuple[float, float]
    settling: tuple[float, float]
    most: int = 4000
    fine: float = 0.0


GRAINS = (0.2e-3, 0.6e-3)
"""Smallest and largest diameter of single grains [m]: medium dune sand; fine powder."""

MATTER = {
    "snow": ThrownMatter(150.0, 34.0, 1.0e-3, 0, (0.5e-3, 8.0e-3), (0.5, 3.0), 16_000, 0.1),
    "sand": ThrownMatter(1500.0, 34.0, 0.1e-3, 0, (0.3e-3, LARGEST["sand"]), (2.0, 6.0), 16_000, 0.01),
    "wet_sand": ThrownMatter(1800.0, 45.0, 0.4e-3, 8, (2.0e-3, LARGEST["wet_sand"]), (5.0, 9.0)),
    "mud": ThrownMatter(1700.0, 15.0, 0.3e-3, 6, (2.0e-3, LARGEST["mud"]), (5.0, 9.0)),
    "soil": ThrownMatter(1300.0, 38.0, 0.3e-3, 0, (2.0e-3, LARGEST["soil"]), (3.0, 12.0)),
}
"""By surface. A sole keeps what its yield stress holds against the swing: of mud 200 Pa/(1700 kg/m³·30 m/s²), 4 mm; of
wet sand, with a capillary cohesion of about 1 kPa, more than it carries. What hangs on loosely comes off: 5 to 15 g
of a boot, by eye."""
