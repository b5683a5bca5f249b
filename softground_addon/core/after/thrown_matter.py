"""What each surface throws: how dense it is, how it flies, in which sizes, and how much a sole carries away."""

from __future__ import annotations

from dataclasses import dataclass


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
        Thickness of what a sole carries as it leaves [m].
    sizes : (float, float)
        Smallest and largest diameter [m]; their number falls as d^-2.5.
    settling : (float, float)
        Speed at which the smallest and the largest fall at last [m/s].
    """

    density: float
    repose: float
    film: float
    sizes: tuple[float, float]
    settling: tuple[float, float]


MATTER = {
    "snow": ThrownMatter(150.0, 34.0, 1.0e-3, (2.0e-3, 15.0e-3), (0.7, 4.0)),
    "sand": ThrownMatter(1500.0, 34.0, 0.1e-3, (1.0e-3, 5.0e-3), (2.0, 6.0)),
    "wet_sand": ThrownMatter(1800.0, 45.0, 2.0e-3, (2.0e-3, 12.0e-3), (5.0, 9.0)),
    "mud": ThrownMatter(1700.0, 15.0, 4.0e-3, (2.0e-3, 10.0e-3), (5.0, 8.0)),
    "soil": ThrownMatter(1300.0, 38.0, 0.3e-3, (2.0e-3, 30.0e-3), (3.0, 12.0)),
}
"""By surface. Film of mud: yield stress over density and the acceleration of a sole, 200 Pa/(1700 kg/m³·30 m/s²)."""
