"""Bodies that hover: what of them dips to the ground carries nothing, and prints nothing."""

from __future__ import annotations

import numpy as np

from ..dynamics.body_dynamics import FREE_FALL
from ..dynamics.centre_of_mass import centre_of_mass
from ..findings import Finding
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from .contacts import LEAVE_HEIGHT, Contacts

ALOFT = 0.3
"""Least share of the frames in which nothing of a hovering body touches."""
ALONG = 0.5
"""What touches goes along with the body if it moves against it by less than this part of the body's way."""
STILL = 0.01
"""A body that moves less than this while something touches at an end of the take rests there [leg lengths]."""


def hovers(motion: CharacterMotion, contacts: Contacts) -> float:
    """Share of the frames in which nothing touches of a body that does not fall then, and never stands on what does.

    0 for others. A foot that stands moves against the body as far as the body moves, also on a belt; one that hovers
    goes along. What rests at an end of the take has rested before it, or does so after.
    """
    now, motion = motion.on_frames, motion.at_frames()
    touching = contacts.standing[now] & (contacts.clearance[now] < LEAVE_HEIGHT * motion.leg_length)
    aloft = ~touching.any(axis=1)
    if motion.centre is not None or aloft.all() or aloft.mean() < ALOFT:
        return 0.0
    centre = centre_of_mass(motion)
    rise = np.gradient(centre[:, 2], motion.time_step)
    firsts, ends = runs(aloft)
    lost = (rise[firsts] - rise[ends - 1]).sum()
    if lost > FREE_FALL * motion.fall * (ends - 1 - firsts).sum() * motion.time_step:
        return 0.0
    for sole, on in zip(motion.soles, touching.T, strict=True):
        if _stands(sole.landmark_positions().mean(axis=1) - centre, centre, on, STILL * motion.leg_length):
            return 0.0
    return float(aloft.mean())


def _stands(against: Array, centre: Array, on: Mask, still: float) -> bool:
    """True if a sole at places `against` (F, 3) the body's centre (F, 3) stands in any of its contacts (F,)."""
    for first, end in zip(*runs(on), strict=True):
        moved, way = (np.linalg.norm(np.ptp(path[first:end], axis=0)) for path in (against, centre))
        rests = (first == 0 or end == len(on)) and way < still
        if end - first > 1 and (moved >= ALONG * way or rests):
            return True
    return False


def hovering(name: str, share: float) -> Finding:
    """Finding that a body hovers for a share of the frames."""
    return Finding(
        "hovers",
        "warning",
        f"'{name}' hovers, and leaves no print: in {share * 100:.0f} % of the frames nothing of it touches and it does "
        "not fall, and where it dips lowest nothing of it stands",
        "take it out of the characters if it flies or swims, or lower it to the ground that it stands on.",
        {"character": name, "share": round(share, 3)},
    )
