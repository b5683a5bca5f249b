"""Steps that an animation takes where there is no ground for them, so that they leave no print."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..findings import Finding
from ..motion.motion import CharacterMotion
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Mask
from ..numerics.intervals import runs
from .contacts import REST_SPEED, Contacts
from .sliding import treadmill_velocity

REST_TIME = 0.5
"""A sole that stands rests for longer than this, in sqrt(leg length/gravity) (0.15 s for an adult): one at the top of a
jump is slow for less."""


@dataclass(frozen=True)
class MissedStep:
    """A sole that rests as if it stood, and presses nothing.

    Attributes
    ----------
    frame : float
        Scene frame at which it comes to rest.
    clearance : float
        Its height above the ground [m]; infinite where no ground can bear it.
    """

    sole: str
    frame: float
    clearance: float


def missed_steps(motion: CharacterMotion, contacts: Contacts) -> list[MissedStep]:
    """Soles that rest without a contact where that is no raised foot: nothing else carries the body, or there is no
    ground at all.

    Parameters
    ----------
    contacts : Contacts
        At the motion's samples.

    Returns
    -------
    list of MissedStep
        In the order of time. Those of a foot that comes down beside the ground while the other stands on it are
        among them only where the ground ends, as are those of a walk on the spot whose foot stands at other times: it
        treads the same place again.
    """
    if motion.centre is not None:
        return []  # a prop may lie anywhere
    shortest = REST_TIME * motion.pendulum_time / motion.time_step
    carried, belt = contacts.standing.any(axis=1), treadmill_velocity(motion, contacts)
    missed = []
    for number, sole in enumerate(motion.soles):
        clearance = contacts.clearance[:, number]
        for first, last in zip(*runs(rests(sole, motion, belt)), strict=True):
            during = slice(first, last)
            if last - first < shortest or contacts.standing[during, number].any():
                continue
            swings = carried[during].any() or (belt.any() and contacts.standing[:, number].any())
            if not swings or np.isinf(clearance[during]).all():
                height = float(np.median(clearance[during]))
                missed.append(MissedStep(sole.sole.name, float(motion.frames[first]), height))
    return sorted(missed, key=lambda step: step.frame)


def rests(sole: SoleMotion, motion: CharacterMotion, belt: NDArray[np.float64]) -> Mask:
    """True while some landmark of a sole hardly moves against a ground that moves with `belt` (2,) [m/s], (F,)."""
    points = sole.landmark_positions()
    if len(points) < 2:
        return np.zeros(len(points), dtype=bool)
    velocity = np.gradient(points, motion.time_step, axis=0) - (*belt, 0.0)
    speed = np.linalg.norm(velocity, axis=-1).min(axis=1)
    return np.asarray(speed < REST_SPEED * motion.froude_speed)


def advice(name: str, missed: Sequence[MissedStep], ground: str) -> Finding:
    """Message about a character's missed steps: how many, from when on, and what to do."""
    several = len(missed) > 1
    count, meet, leave = (f"{len(missed)} steps", "meet", "leave") if several else ("1 step", "meets", "leaves")
    beyond = sum(np.isinf(step.clearance) for step in missed)
    heights = [step.clearance for step in missed if np.isfinite(step.clearance)]
    where = [f"{beyond} beyond its edge or on its walls"] if beyond else []
    where += [f"{len(heights)} up to {max(heights) * 100:.0f} cm above it"] if heights else []
    return Finding(
        "missed_steps",
        "warning",
        f"{count} of '{name}' {meet} no ground on {ground} and {leave} no print, from frame {missed[0].frame:.0f} on "
        f"({', '.join(where)})",
        "extend or move the ground, or choose a mesh of the stairs or hill under the feet.",
        {"character": name, "frames": [step.frame for step in missed], "beyond": int(beyond)},
    )
