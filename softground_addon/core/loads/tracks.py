"""Tracks of prints: a contact leaves one print, that of a body that travels on the ground several."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..numerics.intervals import runs
from . import estimate

LONGEST_TRACK = 8.0
"""Length of the tracks of rolling and sliding bodies that are recorded as one print, in their longest extents."""

LONGEST_SLIDE = 0.25
"""How far a foot slides within one print, in body heights, or its own length if that is more, as of what crawls: then
it is another place that it prints, ..."""
SHORTEST_SLIDE = 0.08
"""... if it takes as long for it [s]."""


def tracks(character: estimate.CharacterLoads, index: int) -> Iterator[slice]:
    """The steps of each print of a sole; the contacts of one that travels far are cut.

    Those of a foot or another limb that slides, in a gait on the spot or on skates, are cut into even pieces of at most
    `LONGEST_SLIDE` and on average at least `SHORTEST_SLIDE`.

    Parameters
    ----------
    index : int
        Of the sole.
    """
    motion = character.motion
    sole, skin = motion.soles[index], motion.skin
    prop, place = sole.sole.prop, sole.transforms[:, 0, :2, 3]
    furthest = max(LONGEST_SLIDE * skin.height, sole.sole.length) if skin else np.inf
    shortest = SHORTEST_SLIDE / motion.time_step
    for first, end in zip(*runs(character.contacts.touching[:, index]), strict=True):
        if prop is not None and not prop.give:
            limit = LONGEST_TRACK * prop.extent.max()
        else:
            slide = float(np.linalg.norm(place[first:end] - place[first], axis=1).max())
            pieces = min(np.ceil(slide / furthest), (end - first) // shortest)
            limit = slide / pieces if pieces > 1 else np.inf
        begin = int(first)
        for step in range(begin + 1, int(end)) if limit < np.inf else ():
            if np.linalg.norm(place[step] - place[begin]) > limit:
                yield slice(begin, step)
                begin = step
        yield slice(begin, int(end))
