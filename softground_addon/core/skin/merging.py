"""Parts that bear together, as one contact: the toes and the heel of a foot."""

from __future__ import annotations

import numpy as np

from .skin_motion import Indices, Mask, PartTracks

HOPS = 2
"""Parts of one contact are at most so far apart in the graph of parts."""
TOGETHER = 0.5
"""Share of the rarer one's bearing time that both bear."""
APART = 0.2
"""Largest distance between the lowest patches of parts that are one contact, in body heights."""


def merged(tracks: PartTracks, bears: Mask, links: Mask) -> Indices:
    """The group that each bearing part is in, (P,), -1 for parts that never bear.

    Parameters
    ----------
    tracks : PartTracks
    bears : (F, P) bool array
    links : (P, P) bool array
        Which parts hang together.
    """
    count = len(links)
    step = links | np.eye(count, dtype=bool)
    near = np.linalg.matrix_power(step.astype(float), HOPS) > 0
    used = np.flatnonzero(bears.any(axis=0))
    time = bears.sum(axis=0)
    group = np.full(count, -1, dtype=np.intp)
    group[used] = used
    for i, first in enumerate(used):
        for second in used[i + 1 :]:
            if not near[first, second]:
                continue
            both = bears[:, first] & bears[:, second]
            if both.sum() < TOGETHER * min(time[first], time[second]) or not both.any():
                continue
            gap = np.linalg.norm(tracks.place[both, first] - tracks.place[both, second], axis=-1)
            if np.median(gap) < APART:
                group[group == group[second]] = group[first]
    return group
