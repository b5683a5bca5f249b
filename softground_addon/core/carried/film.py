"""The film of soft ground on a sole: taken up as the sole leaves the ground, left on hard floors step by step.

Masses are per area of the sole [kg/m²], by `ZONES`. Equal steps on a hard floor, of which each leaves the share q of
the film, leave it as a geometric series: film·(1 - q)^n after n of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.surfaces import CarriedFilm
from ..numerics.arrays import Array

ZONES = ("heel", "arch", "ball", "toes")
ZONE_ENDS = (0.30, 0.55, 0.80)
"""Where one zone of a sole ends and the next begins, in sole lengths from the heel."""
PRESSING = 60e3
"""Pressure at which a sole leaves 1 - 1/e of what it can [Pa]: that under a person who stands on both feet is a third
of it, under a heel that strikes twice to four times as much."""
TRACE = 0.01
"""A film that is thinner than this part of the thickest leaves no mark."""


@dataclass(frozen=True)
class Meeting:
    """A sole leaves soft ground, or has pressed a hard floor.

    Attributes
    ----------
    frame : float
        Of the scene.
    shares : (4,) float array or None
        Share of the film of each zone that stays on the floor; None on soft ground, where the sole takes up more.
    shed : float
        Mass that it takes up beside the film and sheds in the air [kg].
    """

    frame: float
    shares: Array | None = None
    shed: float = 0.0


@dataclass(frozen=True)
class CarriedMass:
    """Masses that soles have carried [kg]: what they brought and picked up is the sum of the others."""

    brought: float = 0.0
    picked_up: float = 0.0
    left_behind: float = 0.0
    shed: float = 0.0
    on_soles: float = 0.0

    def __add__(self, other: CarriedMass) -> CarriedMass:
        return CarriedMass(*(mass + more for mass, more in zip(vars(self).values(), vars(other).values(), strict=True)))


def zone_of(along: Array) -> NDArray[np.intp]:
    """Number of the zone at a distance from the heel, in sole lengths."""
    return np.asarray(np.searchsorted(ZONE_ENDS, along, side="right"))


def taken_up(film: Any, carried: CarriedFilm) -> Any:
    """Film after a sole has left soft ground [kg/m²]: the less is added, the more there is.

    Examples
    --------
    >>> taken_up(np.array([0.0, 2.0, 4.0]), CarriedFilm("mud", most=4.0, taken=2.0, deposited=0.2, water=0.3))
    array([2., 3., 4.])
    """
    return np.minimum(film + carried.taken * (1.0 - film / carried.most), carried.most)


def share_left(pressure: Any, carried: CarriedFilm, slid: float = 0.0) -> Any:
    """Share of the film that a sole leaves on a hard floor.

    Parameters
    ----------
    pressure : float or array
        Largest during the contact [Pa].
    slid : float
        Distance that the sole slides, in sole lengths: from 1 on it leaves twice as much.
    """
    return np.minimum(carried.deposited * -np.expm1(-np.asarray(pressure) / PRESSING) * (1.0 + min(slid, 1.0)), 1.0)


def carry(
    meetings: Iterable[Meeting], carried: CarriedFilm, areas: Array, brought: float = 0.0
) -> tuple[list[Array], CarriedMass]:
    """The film of a sole at each of its meetings with the ground, in their order.

    Parameters
    ----------
    areas : (4,) float array
        Of the sole's zones [m²].
    brought : float
        Film that it starts with, over the thickest: 0 for a clean sole.

    Returns
    -------
    list of (4,) float arrays
        Film that each meeting takes its share of [kg/m²]: 0 where it is a trace, and on soft ground.
    CarriedMass
    """
    now, giving = np.full(len(ZONES), brought * carried.most), []
    booked = CarriedMass(brought=float(now @ areas))
    for meeting in meetings:
        if meeting.shares is None:
            more = taken_up(now, carried) - now
            gives, now = np.zeros_like(now), now + more
            picked_up = float(more @ areas) + meeting.shed
            booked += CarriedMass(picked_up=picked_up, shed=meeting.shed)
        else:
            gives = np.where(now < TRACE * carried.most, 0.0, now)
            left_behind = gives * meeting.shares
            now = now - left_behind
            booked += CarriedMass(left_behind=float(left_behind @ areas))
        giving.append(gives)
    return giving, replace(booked, on_soles=float(now @ areas))
