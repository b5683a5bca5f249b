"""The relief that a bake's settings ask for, on a ground that shows it at given places."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .numerics.slices import Slices, sliced
from .record.footprints import Footprint
from .relief import amounts
from .relief.steps import ReliefSettings, StepRelief, relief_of_steps
from .settings import BakeSettings

Array = NDArray[np.float64]

FEET_IN_SHOES = 2
"""Feet of those who wear shoes."""

TREAD = 0.003
"""Tread that the amounts of looks are given for [m]."""


def shod_of(wanted: BakeSettings) -> set[tuple[str, str]]:
    """Characters and names of the soles that wear shoes: the feet of those who go on two."""
    shod = set()
    for one in wanted.characters:
        feet = [sole for sole in one.soles if sole.bone and not sole.limb]
        shod |= {(one.name, sole.name) for sole in feet if len(feet) == FEET_IN_SHOES}
    return shod


@sliced
def relief_at(footprints: Sequence[Footprint], x: Array, y: Array, wanted: BakeSettings) -> Slices[list[StepRelief]]:
    """The relief of each footprint at places (K,) [m]; nothing at all where it is off."""
    if not wanted.relief_look or not wanted.relief_strength > 0:
        return []
    asked = ReliefSettings(
        amounts.of_look(wanted.relief_look),
        wanted.spacing_m,
        wanted.relief_strength,
        wanted.tread_pattern,
        wanted.tread_m / TREAD,
        shod_of(wanted),
    )
    return (yield from relief_of_steps.slices(footprints, x, y, asked, blur_sigma=wanted.material.blur_sigma))
