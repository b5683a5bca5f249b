"""The law by which standing plants sway in the wind, for arrays and for geometry nodes alike.

References
----------
.. [1] E. de Langre, "Effects of wind on plants", Annual Review of Fluid Mechanics 40 (2008), 141-168,
   doi:10.1146/annurev.fluid.40.111406.102135: drag bends plants, which sway at frequencies of their own; gusts run over
   a canopy as waves of about eight times its height.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

FLATTENING = 15.0
"""Wind at 10 m in which a plant leans by 1 - 1/e of a right angle, by the pictures it gives [m/s]."""
FREQUENCY = 0.6
"""Of a plant of 1 m [Hz]; it goes with the height to -1/2, as of stems that are alike in elasticity."""
WAVE = 8.0
"""Length of the waves, in heights of the plants."""
GUSTS, OWN = 0.4, 1.5
"""Share of the lean that comes and goes with the waves, and how far apart blades are in them [rad]."""


def swayed(wind: Any, height: Any, metre: Any, time: Any, ahead: Any, chance: Any) -> Any:
    """Lean with the wind, in right angles.

    Parameters
    ----------
    wind : float
        At 10 m [m/s].
    height : float
        Of the plants.
    metre : float
        Unit of lengths: a metre in them.
    time : float
        [s]
    ahead : float
        Place along the wind.
    chance : float
        From 0 to 1, another for each blade.

    Examples
    --------
    >>> [round(float(swayed(wind, 0.3, 1.0, 0.0, 0.0, 0.5)), 3) for wind in (0.0, 3.0, 10.0)]
    [0.0, 0.024, 0.215]
    """
    force = wind / FLATTENING
    turns = time * FREQUENCY * np.sqrt(metre / height) - ahead / (height * WAVE)
    wave = np.sin((turns * (2.0 * pi)) + (chance - 0.5) * OWN)
    return (1.0 - np.exp((0.0 - force) * force)) * (1.0 - GUSTS + GUSTS * wave)
