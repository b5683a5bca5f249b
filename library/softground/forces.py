"""Ground reaction forces of a body from its motion alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import SupportsFloat

import numpy as np
from numpy.typing import NDArray

from ._core.ground.heightfield import FlatTerrain, Terrain
from ._core.ground.material import GroundMaterial
from ._core.loads import estimate
from ._core.loads.deviation import force_deviation
from ._core.loads.estimate import CharacterLoads
from ._core.loads.free_moments import free_moments
from ._core.motion.motion import steps_per_frame
from ._core.numerics.intervals import runs
from .body import Body

Array = NDArray[np.float64]

_HARD = GroundMaterial(youngs_modulus=1e6, poisson_ratio=0.3, characteristic_time=0.05)
"""Landings of bodies without joints take its time; forces of a body with joints depend on no material."""


@dataclass(frozen=True)
class SoleLoads:
    """What one sole does to the ground, at the F frames of its body.

    Attributes
    ----------
    name : str
        Such as `foot.L`.
    side : str
        "L", "R" or "".
    contacts : (K, 2) float array
        When it touches down and leaves [s], to the time step of the estimate, 1/120 s or less.
    force : (F, 3) float array
        Force of the ground on it, Z up [N].
    centre_of_pressure : (F, 3) float array
        Where it acts [m]; NaN where the sole does not touch.
    free_moment : (F,) float array
        Moment about the upward axis there [N·m], anticlockwise from above; NaN for bodies without joints.
    deviation : (F,) float array
        Standard deviation of the vertical force [N]; NaN for bodies without joints.
    """

    name: str
    side: str
    contacts: Array
    force: Array
    centre_of_pressure: Array
    free_moment: Array
    deviation: Array


@dataclass(frozen=True)
class Loads:
    """What a body does to the ground.

    Attributes
    ----------
    body : Body
    times : (F,) float array
        Of its frames [s].
    soles : tuple of SoleLoads
    terrain : Terrain
        The undisturbed ground that it was found on.
    steps : CharacterLoads
        The same at the time steps of the estimate, as the core presses it.
    """

    body: Body
    times: Array
    soles: tuple[SoleLoads, ...]
    terrain: Terrain
    steps: CharacterLoads


def estimate_loads(body: Body, terrain: float | Terrain = 0.0) -> Loads:
    """Contacts, forces, centres of pressure and free moments of all soles.

    Parameters
    ----------
    body : Body
    terrain : float or Terrain, optional
        Height of a level ground [m], or anything whose `heights(x, y)` gives heights [m], NaN where there is none.
        What feet float or sink by is removed.

    Raises
    ------
    InputError
        If the motion cannot be read.

    References
    ----------
    docs/forces.md of the project: the force that the motion of the whole body requires, split between the feet by a
    smooth transition (Ren et al. 2008, 10.1016/j.jbiomech.2008.06.001), with a standard deviation.
    """
    ground = as_terrain(terrain)
    loads = estimate.estimate_loads(body.motion, ground, force_model="WHOLE_BODY", material=_HARD)
    shown = loads.motion.on_frames
    count, soles = int(shown.sum()), len(body.motion.soles)
    told = bool(body.motion.joints.keys() & {"hips", "hip_l", "hip_r"}) and body.motion.centre is None
    unknown = np.full((count, soles), np.nan)
    twists, deviation = (free_moments(loads)[shown], force_deviation(loads)[shown]) if told else (unknown, unknown)
    times, touching = loads.motion.times, loads.contacts.touching
    parts = []
    for number, sole in enumerate(body.motion.soles):
        first, last = runs(touching[:, number])
        centre = np.where(touching[:, number, None], loads.forces.centre_of_pressure[:, number], np.nan)
        parts.append(
            SoleLoads(
                sole.sole.name,
                sole.sole.side,
                np.column_stack([times[first], times[np.minimum(last, len(times) - 1)]]),
                loads.forces.forces[shown, number],
                centre[shown],
                twists[:, number],
                deviation[:, number],
            )
        )
    pressing = replace(loads, motion=body.shape.resampled(steps_per_frame(body.rate)))
    return Loads(body, times[shown], tuple(parts), ground, pressing)


def as_terrain(terrain: float | Terrain) -> Terrain:
    """A terrain; level at a height [m] that is given alone."""
    return FlatTerrain(float(terrain)) if isinstance(terrain, SupportsFloat) else terrain
