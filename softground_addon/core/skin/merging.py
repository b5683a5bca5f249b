"""Parts that bear together, as one contact: the toes and the heel of a foot."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Indices, Mask
from .skin_motion import PartTracks, SkinMotion

HOPS = 2
"""Parts of one contact are at most so far apart in the graph of parts."""
TOGETHER = 0.5
"""Share of the rarer one's bearing time that both bear."""
APART = 0.2
"""Largest distance between the lowest patches of parts that are one contact, in body heights."""
ALIKE = 0.03
"""Parts whose middles are always as far apart to within this move alike, in body heights."""


def moving_alike(skin: SkinMotion) -> Mask:
    """Parts that lie against each other and move alike, but are not left and right, (P, P).

    So do a sole on a bone for inverse kinematics and the end of the leg that follows it: no bone joins them.
    """
    count = int(skin.part[-1]) + 1
    if skin.beside is None:
        return np.zeros((count, count), dtype=bool)
    first = np.flatnonzero(np.diff(skin.part, prepend=-1))
    size = np.diff(np.append(first, len(skin.part)))
    middle = np.add.reduceat(skin.positions, first, axis=1) / size[:, None]
    alike = skin.beside.copy()
    if skin.twin is not None:
        followed = np.flatnonzero(skin.twin >= 0)
        alike[followed, skin.twin[followed]] = False
    for this, other in zip(*np.nonzero(alike), strict=True):
        apart = np.linalg.norm(middle[:, this] - middle[:, other], axis=-1)
        alike[this, other] = np.ptp(apart) < ALIKE * skin.height
    return alike & alike.T


def merged(tracks: PartTracks, bears: Mask, links: Mask, alike: Mask, twin: Indices | None = None) -> Indices:
    """The group that each bearing part is in, (P,), -1 for parts that never bear.

    Parameters
    ----------
    bears : (F, P) bool array
    links : (P, P) bool array
        Which parts hang together.
    alike : (P, P) bool array
        Which move alike without that.
    twin : (P,) int array, optional
        The part that mirrors each, itself where none does, and -1 where that is not followed.
    """
    count = len(links)
    step = links | np.eye(count, dtype=bool)
    near = (np.linalg.matrix_power(step.astype(float), HOPS) > 0) | alike
    used = np.flatnonzero(bears.any(axis=0))
    time = bears.sum(axis=0)
    are_one = np.zeros((count, count), dtype=bool)
    for i, first in enumerate(used):
        for second in used[i + 1 :]:
            if not near[first, second]:
                continue
            both = bears[:, first] & bears[:, second]
            if both.sum() < TOGETHER * min(time[first], time[second]) or not both.any():
                continue
            gap = np.linalg.norm(tracks.place[both, first] - tracks.place[both, second], axis=-1)
            are_one[first, second] = np.median(gap) < APART
    are_one |= are_one.T
    if twin is not None:  # what is one foot on the left is one on the right
        mirrored = np.ix_(twin[used], twin[used])
        followed = (twin[used] >= 0) & (twin[used, None] >= 0)
        are_one[np.ix_(used, used)] |= are_one[mirrored] & followed & near[np.ix_(used, used)]
    group = np.full(count, -1, dtype=np.intp)
    group[used] = used
    for first, second in np.argwhere(are_one):
        group[group == group[second]] = group[first]
    return group
