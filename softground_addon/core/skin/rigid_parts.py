"""Parts of a body that move as one, from its surface over time alone: no bones are known.

Rigid displacements are fitted to points in the way of k-means, with a new one where the others fit worst, until they
explain the surface (compare D. L. James and C. D. Twigg, "Skinning mesh animations", ACM Trans. Graph. 24(3), 2005,
doi:10.1145/1073204.1073206). What one of them moves and hangs together is a part.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Indices
from ..numerics.components import components
from ..numerics.rigid import displacement, nearest_rotation
from ..numerics.slices import Slices, sliced
from .volume import welded

FIT = 0.005
"""Displacements are fitted until no point is farther than this from where they put it, over the size of the body."""

MOST_POSES = 0.9
"""Share of the poses in which they are: shapes that are mixed, as between two keys, shrink in some."""

MOST_DISPLACEMENTS = 40
"""Rigid displacements at most: a person with fingers has about as many."""

MOST_POINTS = 3000
"""Points that they are fitted to at most, evenly chosen."""

SEED = 12
"""Points around the worst one that a new displacement is first fitted to."""

ROUNDS = 4
"""Rounds of fits after the last displacement is in."""

AGAINST = 0.01
"""Pieces that one displacement moves are one part where boxes around them are nearer than this, over the size."""


def rigid_motions(start: Array, moved: Array) -> Array:
    """Rigid displacements that carry points (N, 3) nearest to where they are seen (F, N, 3), (F, 4, 4).

    The least squares of W. Kabsch, Acta Cryst. A32, 1976, doi:10.1107/S0567739476001873.

    Examples
    --------
    >>> corner = np.append(np.eye(3), np.zeros((1, 3)), axis=0)
    >>> turned = corner[:, [1, 0, 2]] * (-1, 1, 1) + (5, 0, 0)
    >>> rigid_motions(corner, turned[None])[0].round(6).tolist()[0]
    [0.0, -1.0, 0.0, 5.0]
    """
    middle, middles = start.mean(axis=0), moved.mean(axis=1)
    spread = np.swapaxes(moved - middles[:, None], 1, 2) @ (start - middle)
    return displacement(nearest_rotation(spread), middle, middles)


@sliced
def rigid_parts(positions: Array, triangles: Indices) -> Slices[Indices]:
    """The part that each point of a surface belongs to, (V,), numbered by their first points.

    Parameters
    ----------
    positions : (F, V, 3) float array
        In some poses, of which the first tells what lies beside what.
    triangles : (T, 3) int array
    """
    rest = positions[0]
    size, count = _size(rest), len(rest)
    place = welded(rest)
    _, first = np.unique(place, return_index=True)
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).T
    ends = np.append(ends, [np.arange(count), first[place]], axis=1)
    piece = components(count, *ends)
    yield
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_POINTS)).astype(int))
    motions = yield from _displacements.slices(positions[:, chosen], piece[chosen], FIT * size)
    best, mover = np.full(count, np.inf), np.zeros(count, dtype=np.intp)
    for number, motion in enumerate(motions):
        error = _errors(motion, positions)
        mover[error < best] = number
        best = np.minimum(best, error)
        yield
    together = ends[:, mover[ends[0]] == mover[ends[1]]]
    part = components(count, *together)
    yield
    return components(count, *np.append(together, _against(rest, part, mover, AGAINST * size), axis=1))


@sliced
def _displacements(positions: Array, piece: Indices, fit: float) -> Slices[list[Array]]:
    """Rigid displacements over the poses that explain where points are, each (F, 4, 4), and none twice."""
    rest = positions[0]
    motions = [rigid_motions(rest, positions)]
    errors = [_errors(motions[0], positions)]
    rounds, mover = ROUNDS, np.zeros(len(rest), dtype=np.intp)
    while rounds:
        best = np.min(errors, axis=0)
        worst = int(best.argmax())
        if len(motions) < MOST_DISPLACEMENTS and best[worst] > fit:
            away = np.where(piece == piece[worst], np.linalg.norm(rest - rest[worst], axis=1), np.inf)
            near = np.argsort(away, kind="stable")[:SEED]
            near = near[np.isfinite(away[near])]
            motions.append(rigid_motions(rest[near], positions[:, near]))
            errors.append(_errors(motions[-1], positions))
        else:
            rounds -= 1
        before, mover = mover, np.argmin(errors, axis=0)
        changed = mover != before
        for number in np.unique([before[changed], mover[changed]]).tolist():
            moved = np.flatnonzero(mover == number)
            if len(moved) >= 3:
                motions[number] = rigid_motions(rest[moved], positions[:, moved])
                errors[number] = _errors(motions[number], positions)
        yield
    size, needed = np.bincount(mover, minlength=len(motions)), list[int]()
    for number in np.argsort(-size, kind="stable").tolist():
        explained = (errors[other][mover == number].max(initial=0.0) <= fit for other in needed)
        if not any(explained):
            needed.append(number)
    return [motions[number] for number in needed]


def moves_as_one(positions: Array) -> bool:
    """True if one rigid displacement explains points (V, 3) in all poses (F, V, 3)."""
    motion = rigid_motions(positions[0], positions)
    placed = positions[0] @ np.swapaxes(motion[:, :3, :3], 1, 2) + motion[:, None, :3, 3]
    return bool(np.abs(placed - positions).max() <= FIT * _size(positions[0]))


def _size(points: Array) -> float:
    return max(float(np.ptp(points, axis=0).max()), 1e-12)


def _errors(motion: Array, positions: Array) -> Array:
    """Distance of points from where a displacement puts them, in all poses but a few, (V,)."""
    placed = positions[0] @ np.swapaxes(motion[:, :3, :3], 1, 2) + motion[:, None, :3, 3]
    squared = np.square(placed - positions).sum(axis=-1)
    most = int(MOST_POSES * (len(squared) - 1))
    return np.asarray(np.sqrt(np.partition(squared, most, axis=0)[most]))


def _against(rest: Array, part: Indices, mover: Indices, gap: float) -> Indices:
    """Pairs of points by which parts with one mover that lie against each other are joined, (2, N)."""
    order = np.argsort(part, kind="stable")
    first = np.flatnonzero(np.diff(part[order], prepend=-1))
    low, high = (extreme.reduceat(rest[order], first) for extreme in (np.minimum, np.maximum))
    lead, pairs = order[first], [np.zeros((2, 0), dtype=np.intp)]
    for number in np.unique(mover):
        those = np.flatnonzero(mover[lead] == number)
        for at, piece in enumerate(those):
            others = those[at + 1 :]
            apart = np.maximum(low[piece] - high[others], low[others] - high[piece]).max(axis=-1)
            near = lead[others[apart < gap]]
            pairs.append(np.stack([np.full(len(near), lead[piece]), near]))
    return np.concatenate(pairs, axis=1)
