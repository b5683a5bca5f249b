"""People by their legs and height: if a body is a person, its mass, and the unit of its file."""

from __future__ import annotations

from collections.abc import Collection
from math import floor, log10

PERSON_MASS, PERSON_HEIGHT = 77.5, 1.78
"""A person [kg], [m]."""

LEG_SHARE = 0.491
"""Thigh and shank of a person over its height (Drillis and Contini 1966)."""

MASS_RANGE = 4.0
"""Ratio of a mass to the likely one beyond which it is asked about."""

_LEGS = frozenset(f"{joint}_{side}" for joint in ("hip", "knee", "ankle") for side in "lr")


def leg_sides(joints: Collection[str]) -> list[str]:
    """Sides of the legs whose hip and knee are known: "l" and "r", of further pairs toward the head "l2", "r2"."""
    return [joint[4:] for joint in joints if joint.startswith("hip_") and f"knee_{joint[4:]}" in joints]


def has_two_legs(joints: Collection[str], legs: int) -> bool:
    """True for joints of two legs, if a body has no more that print."""
    return _LEGS.issubset(joints) and legs == 2


def sizes_by_legs(stature: float, size: float, leg: float, *, has_skin: bool) -> tuple[float, float]:
    """Stature and size of a body on two legs [m], from those of its joints at rest and its thigh and shank together.

    Captured motion, without a skin, may have a split as its rest pose; and no joint is at the top of a head.

    Examples
    --------
    >>> [round(length, 2) for length in sizes_by_legs(1.0, 1.84, 0.8, has_skin=False)]
    [1.63, 1.84]
    >>> [round(length, 2) for length in sizes_by_legs(1.55, 1.55, 0.874, has_skin=True)]
    [1.55, 1.78]
    """
    height = leg / LEG_SHARE
    return stature if has_skin or not height else height, max(size, height)


def likely_mass(by_volume: float, size: float, *, two_legs: bool) -> tuple[float, str]:
    """Mass that suits a body [kg], to two digits, and by what; 0 where nothing tells it.

    Parameters
    ----------
    by_volume : float
        Of its skin [kg], 0 where unknown: figures with large heads and clothes of air weigh far less.
    size : float
        Largest extent of its joints [m], 0 where unknown.

    Examples
    --------
    >>> likely_mass(950.0, 1.77, two_legs=True), likely_mass(950.0, 3.0, two_legs=False)
    ((76.0, 'a height of 1.77 m on two legs'), (950.0, 'the volume of its skin'))
    """
    mass = PERSON_MASS * (size / PERSON_HEIGHT) ** 3
    if two_legs and 0.0 < MASS_RANGE * mass < by_volume:
        return round(mass, 1 - floor(log10(mass))), f"a height of {size:.3g} m on two legs"
    return by_volume, "the volume of its skin" if by_volume else ""
