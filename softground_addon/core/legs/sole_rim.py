"""The rim of a sole, on which it stands when it is tilted, as its skin bends."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from ..motion.sole_motion import Sole, SoleMotion, SolePatch
from ..numerics.arrays import Array
from ..numerics.bilinear import sample_map
from .foot_placement import Pieces, posed_points


def rim(sole: Sole) -> Pieces:
    """Points around each patch of a sole, and its lowest: patch and positions (K, 3) in the patch's frame [m].

    A convex sole that is tilted stands on one of its rim. The landmarks where the sole has no patches.
    """
    if not sole.patches:
        return [(int(p), sole.landmarks[sole.landmark_patch == p]) for p in np.unique(sole.landmark_patch)]
    return [(number, _outermost(patch)) for number, patch in enumerate(sole.patches)]


def _outermost(patch: SolePatch) -> Array:
    """The first and last node of each row and column inside a patch's outline, every third inside, and the lowest."""
    inside = patch.signed_distance <= 0.0
    before, after = np.roll(inside, 1, axis=1), np.roll(inside, -1, axis=1)
    before[:, 0] = after[:, -1] = False
    above, below = np.roll(inside, 1, axis=0), np.roll(inside, -1, axis=0)
    above[0] = below[-1] = False
    chosen = inside & ~(before & after & above & below)
    chosen[::3, ::3] |= inside[::3, ::3]
    lowest = np.where(inside, patch.heights, np.inf).argmin()
    chosen.flat[lowest] |= bool(inside.any())
    rows, columns = np.nonzero(chosen)
    x = patch.origin[0] + columns * patch.spacing
    y = patch.origin[1] + rows * patch.spacing
    return np.stack([x, y, patch.heights[rows, columns]], axis=-1)


def posed_rim(motion: SoleMotion) -> Array:
    """World positions of the rim over time, (F, Q, 3) [m]: near a crease, of both its pieces in part, as skin is.

    The hinge of the toes is above the sole, and where they bend, rigid pieces would slide over each other.
    """
    pieces = rim(motion.sole)
    share = _shares(motion.sole, pieces)
    if share.max(axis=0).min() == 1.0:
        return posed_points(motion, pieces)
    level = _levels(motion.sole, pieces)
    posed = np.zeros((len(motion.transforms), share.shape[1], 3))
    for patch, of_patch in enumerate(share):
        as_of = [(patch, places + np.array((0.0, 0.0, level[piece] - level[patch]))) for piece, places in pieces]
        posed += of_patch[:, None] * posed_points(motion, as_of)
    return posed


def rim_pieces(sole: Sole) -> NDArray[np.intp]:
    """The rigid piece that each point of the rim goes with most, (Q,)."""
    return np.asarray(_shares(sole, rim(sole)).argmax(axis=0))


def along(sole: Sole) -> Array:
    """Place of each point of the rim along the sole, (Q,), from 0 at its rear end to 1 at its front."""
    x = np.concatenate([places[:, 0] for _, places in rim(sole)])
    return np.asarray((x - x.min()) / max(float(np.ptp(x)), 1e-9))


def _shares(sole: Sole, pieces: Pieces) -> Array:
    """Share of each piece's motion in that of each point of the rim, (P, Q), 1 in all."""
    if len(sole.patches) < 2 or not sole.bend:
        return np.repeat(np.eye(len(pieces)), [len(places) for _, places in pieces], axis=1)
    x = np.concatenate([places[:, 0] for _, places in pieces])
    creases = [np.mean(_seam(behind, before)) for (_, behind), (_, before) in itertools.pairwise(pieces)]
    ahead = np.clip(0.5 + (x - np.array(creases)[:, None]) / (2 * sole.bend), 0.0, 1.0)
    return -np.diff(ahead, axis=0, prepend=1.0, append=0.0)


def _seam(behind: Array, before: Array) -> tuple[float, float]:
    """Range along x in which pieces overlap, by points of both (K, 3) [m]."""
    return float(before[:, 0].min()), float(behind[:, 0].max())


def _levels(sole: Sole, pieces: Pieces) -> Array:
    """Height of each patch's frame in that of the first, (P,) [m], by the heights of both where they overlap."""
    level = np.zeros(len(sole.patches))
    for number, ((_, behind), (_, before)) in enumerate(itertools.pairwise(pieces)):
        seam = before[before[:, 0] <= _seam(behind, before)[1]]
        patch = sole.patches[number]
        level[number + 1] = level[number] + np.mean(
            sample_map(patch.heights, seam[:, :2], patch.origin, patch.spacing) - seam[:, 2]
        )
    return level
