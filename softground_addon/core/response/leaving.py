"""Feet that leave deep prints: they roll and lift out as soon as the front foot has taken over."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor

import numpy as np

from ..legs.grounding import leg_soles
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Mask
from ..numerics.intervals import runs
from ..record.footprints import Footprint
from ..soles.deep_ground import wading

LEAVE_TIME = 0.15
"""Time before its toe-off at which a foot starts to leave a deep print [s], for an adult, if another one stands."""


def leaving_early(motion: CharacterMotion, touching: Mask, footprints: Sequence[Footprint]) -> Mask:
    """Frames (F, S) at which soles still stand in their prints: all that touch, but for the last of those that wade.

    Parameters
    ----------
    touching : (F, S) bool array
        At its frames.
    footprints : sequence of Footprint
        All that the ground holds.
    """
    standing = touching.copy()
    feet = list(leg_soles(motion).values())
    for number in feet:
        sole = motion.soles[number].sole
        others = touching[:, [other for other in feet if other != number]].any(axis=1)
        prints = [mark for mark in footprints if (mark.character, mark.sole) == (motion.name, sole.name)]
        for first, end in zip(*runs(touching[:, number]), strict=True):
            since, until = motion.frames[first], motion.frames[end - 1]
            depth = max((m.max_depth_m for m in prints if m.start_frame <= until and m.end_frame >= since), default=0.0)
            early = floor(LEAVE_TIME * motion.adult_second * float(wading(depth, sole.length)))  # half a frame ended it
            last = np.arange(max(first + 1, end - early), min(end, len(touching) - 1))
            standing[last[np.logical_and.accumulate(others[last][::-1])[::-1]], number] = False
    return standing
