"""The law by which plants bend under a sole and rise again, for arrays and for geometry nodes alike.

References
----------
.. [1] D. N. Cole, "Experimental trampling of vegetation. I. Relationship between trampling intensity and vegetation
   response", Journal of Applied Ecology 32 (1995), 203-214: cover after 0 to 500 passes falls fast at first, as a
   parabola in most of 18 types of vegetation. An exponential falls likewise, and never rises again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log, pi
from typing import Any

import numpy as np

BREAKING_PRESSURE = 150e3
"""Pressure from which on a stem stays bent for good [Pa]."""
MOST_LASTING = 0.95
"""Share of lying flat that stays for good, at most: broken stems spring up a little."""
BRUSHED = 0.35
"""Share of the bend that is left by a sole which passes above the ground."""
NO_ONE, EVERYONE = 0.0, 2.0
"""Chances of a blade that is never worn down, and of one that always is."""
_TOUCHING = 1e-6
"""Clearance below which a sole lies on the root [m]."""


@dataclass(frozen=True)
class Plant:
    """How a plant gives way; numbers, or those of a node group.

    Attributes
    ----------
    height : float
        Of its blades [m].
    stiffness : float
        Share of the bend that springs back as the sole leaves.
    recovery : float
        Time after which 1/e of the bend that does not last is left [s].
    breaks : float
        Multiplies what lasts; 0 is a plant that always rises.
    half_after : float
        Passes after which half of the plants are worn down, 75 to 300 in the presets.
    """

    height: Any
    stiffness: Any
    recovery: Any
    breaks: Any
    half_after: Any


PLANTS: Mapping[str, tuple[str, Plant]] = {
    "MEADOW": ("Meadow", Plant(0.3, 0.15, 240.0, 0.3, 150.0)),
    "LAWN": ("Lawn", Plant(0.05, 0.3, 900.0, 0.1, 300.0)),
    "REEDS": ("Reeds", Plant(1.5, 0.5, 20.0, 0.4, 100.0)),
    "DRY_STALKS": ("Dry Stalks", Plant(0.5, 0.3, 60.0, 2.0, 75.0)),
    "MOSS": ("Moss", Plant(0.03, 0.0, 3600.0, 0.5, 75.0)),
    "CROPS": ("Crops", Plant(0.7, 0.2, 300.0, 1.0, 100.0)),
}
"""Title of each preset, and its values; the height is that of the user's own plants where it can be measured."""


@dataclass(frozen=True)
class Pass:
    """One pass of a sole over a place; numbers, arrays or nodes.

    Attributes
    ----------
    start, end : float
        Scene frames at which the sole touches the place and leaves it.
    down, up : float
        Speeds of the sole above the place before and after that [m per frame].
    reach : float
        Share of its bend that it gives: 1 under the sole, less beside it, 0 on the rim.
    lasting : float
        What lasts of this and all earlier passes, as `lasting_of` adds up.
    passes : float
        Number of soles that have trodden on the place.
    above : float
        Height at which a sole passes the place; 0 of one that treads on it [m].
    """

    start: Any
    end: Any
    down: Any
    up: Any
    reach: Any
    lasting: Any
    passes: Any
    above: Any


def lasting_of(pressure: Any) -> Any:
    """What a pass of some pressure [Pa] adds to that which lasts.

    The share p/150 kPa of a bend stays for good; of several passes the shares of what is left, so that logarithms add.

    Examples
    --------
    >>> float(1.0 - np.exp(-lasting_of(75e3)))
    0.5
    """
    return -np.log1p(-np.minimum(np.asarray(pressure) / BREAKING_PRESSURE, 1.0 - 1e-6))


def cover(passes: Any, half_after: Any) -> Any:
    """Share of plants that are left after passes of a sole, an exponential in place of a parabola [1]_.

    Examples
    --------
    >>> round(float(cover(150.0, 75.0)), 3)
    0.25
    """
    return np.exp(passes * (0.0 - log(2.0)) / half_after)


def held(clearance: Any, height: Any) -> Any:
    """Bend of a blade below a sole, in right angles: 1 - exp(-c/h), and no less than keeps its tip below the sole.

    Parameters
    ----------
    clearance : float
        Height h of the sole above the root [m].
    height : float
        Of the blade [m]; c is what the sole takes of it.

    Examples
    --------
    >>> [round(float(held(h, 0.3)), 3) for h in (0.3, 0.15, 0.0)]
    [0.0, 0.667, 1.0]
    """
    taken = np.maximum(height - clearance, 0.0)
    bent = 1.0 - np.exp((0.0 - taken) / np.maximum(clearance, _TOUCHING))
    below = np.arccos(np.minimum(clearance / height, 1.0)) * (2.0 / pi)
    return np.maximum(bent, below)


def bend(by: Pass, plant: Plant, frame: Any, frame_rate: Any, chance: Any) -> tuple[Any, Any]:
    """Bend that a pass gives at a frame, in right angles, and the share in which it takes the place of an earlier one.

    Parameters
    ----------
    frame : float
        Scene frame.
    frame_rate : float
        [Hz]
    chance : float
        From 0 to 1, another for each blade: which of them are worn down first.
    """
    until, since = by.start - frame, frame - by.end
    clearance = by.above + np.maximum(np.maximum(until * by.down, since * by.up), 0.0)
    holds = held(clearance, plant.height)
    broken = 1.0 - np.exp((0.0 - plant.breaks) * by.lasting)
    stays = np.maximum(broken, np.greater(chance, cover(by.passes, plant.half_after))) * MOST_LASTING
    released = np.maximum(1.0 - plant.stiffness, stays)
    remaining = np.exp((0.0 - np.maximum(since, 0.0)) / (plant.recovery * frame_rate))
    lasting = 1.0 - np.greater(by.above, 0.0) * (1.0 - BRUSHED)
    rising = (stays + (released - stays) * remaining) * np.greater(since, 0.0) * lasting
    weight = np.maximum(holds, np.greater(frame, by.start) * lasting)
    return np.maximum(holds, rising) * by.reach, weight * by.reach
