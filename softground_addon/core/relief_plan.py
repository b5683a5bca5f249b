"""The relief that the settings of a bake ask for, while it is made and afterwards, from its record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .ground.presets import SURFACES
from .numerics.slices import Slices, sliced
from .record.footprints import Footprint
from .relief import amounts
from .relief.steps import ReliefSettings, StepRelief, relief_of_steps
from .relief.tread import PATTERNS

Array = NDArray[np.float64]

FEET_IN_SHOES = 2
"""Feet of those who wear shoes."""

TREAD = 0.003
"""Tread that the amounts of looks are given for [m]."""


def shod_of(inputs: Mapping[str, Any]) -> set[tuple[str, str]]:
    """Characters and names of the soles that wear shoes: the feet of those who go on two."""
    shod = set()
    for one in inputs["characters"]:
        feet = [sole["name"] for sole in one["soles"] if sole["bone"] and not sole["limb"]]
        shod |= {(one["name"], name) for name in feet if len(feet) == FEET_IN_SHOES}
    return shod


def asked_of(inputs: Mapping[str, Any]) -> ReliefSettings | None:
    """The relief that a bake was asked for, None where it has none.

    Parameters
    ----------
    inputs : mapping
        Of a bake, as the record has them; those of earlier versions know no relief.

    Raises
    ------
    InputError
        If they say what no bake has.
    """
    look = inputs.get("relief_look", "")
    if not look:
        return None
    try:
        numbers = [float(inputs[name]) for name in ("relief_strength", "tread_m")]
        shod = shod_of(inputs)
        known = look in SURFACES and inputs["tread_pattern"] in PATTERNS
    except (KeyError, TypeError, ValueError, AttributeError, ArithmeticError):
        known, numbers = False, []
    if not known or not all(math.isfinite(number) and number >= 0 for number in numbers):
        raise InputError("The stored record of the footprints says nothing sensible of its relief: bake again.")
    strength, tread = numbers
    if not strength > 0:
        return None
    return ReliefSettings(amounts.of_look(look), strength, inputs["tread_pattern"], tread / TREAD, shod)


@sliced
def relief_at(
    footprints: Sequence[Footprint], x: Array, y: Array, inputs: Mapping[str, Any], *, blur_sigma: float
) -> Slices[list[StepRelief]]:
    """The relief of each footprint at places (K,) [m], as the inputs of their bake ask; nothing at all where it is off.

    Raises
    ------
    InputError
        See `asked_of`.
    """
    asked = asked_of(inputs)
    if asked is None:
        return []
    return (yield from relief_of_steps.slices(footprints, x, y, asked, blur_sigma=blur_sigma))
