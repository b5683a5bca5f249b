"""Hips that go with the feet: down with those that sink, along with those that are moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.plane_fit import smoothed
from ..soles.deep_ground import wading
from .foot_placement import Placement
from .wading import DEPTH_TIME, body_depth, depth_of_contacts

LOWER_FOOT = 0.02
"""Least height by which one foot stands lower for the hips to follow it, in leg lengths."""

HIPS_TIME = 0.10
"""Standard deviation of the smoothing of the hips' height over time [s], for an adult."""

LOAD_TIME = 0.05
"""Standard deviation of the passing of weight from foot to foot [s], for an adult."""


def hips_follow(motion: CharacterMotion, placements: Mapping[int, Placement], touching: Mask) -> Array:
    """Height that the hips gain (F,) [m]: that of the standing soles on the whole, less the sinkage of the deeper.

    Smooth over time: weight passes from foot to foot, and hips that would drop into every print anew bounce. In deep
    ground they keep the mean depth of the feet over a stride, whichever of them stands.

    Parameters
    ----------
    placements : mapping of int to Placement
        By sole.
    touching : (F, S) bool array
    """
    if not placements:
        return np.zeros(len(motion.frames))
    stands = touching[:, list(placements)]
    load = smoothed(stands.astype(float), LOAD_TIME * motion.adult_second) ** 2 * stands
    sinkage = np.stack([placement.sinkage for placement in placements.values()], axis=1)
    unsunk = np.stack([placement.lift for placement in placements.values()], axis=1) + sinkage
    deeper = np.exp((sinkage - sinkage.max(axis=1, keepdims=True)) / (LOWER_FOOT * motion.leg_length))
    width = HIPS_TIME * motion.adult_second
    risen = mean_over_time(unsunk, load, width)
    height = risen - mean_over_time(sinkage, load * deeper, width)
    depth, share = wading_depth(motion, placements, touching)
    return height + share * (risen - depth - height) if share.any() else height


def wading_depth(motion: CharacterMotion, placements: Mapping[int, Placement], touching: Mask) -> tuple[Array, Array]:
    """Depth (F,) in which a body wades [m], and how much it wades (F,), 0 to 1; see `hips_follow`."""
    depths = {sole: depth_of_contacts(placed.sinkage, touching[:, sole]) for sole, placed in placements.items()}
    depth = body_depth(depths, DEPTH_TIME * motion.adult_second)
    return depth, wading(depth, float(np.mean([motion.soles[sole].sole.length for sole in placements])))


def hips_go_along(
    motion: CharacterMotion, soles: Sequence[int], offsets: Sequence[Array], touching: Mask, width: float
) -> Array:
    """Movement of the hips (F, D) [m]: as the feet that stand, smoothly.

    Parameters
    ----------
    offsets : sequence of (F, D) float arrays
        Movement of the foot on each [m].
    touching : (F, S) bool array
    width : float
        Standard deviation of the smoothing [s], for an adult.
    """
    stands = touching[:, list(soles)]
    load = smoothed(stands.astype(float), LOAD_TIME * motion.adult_second) ** 2 * stands
    of_feet = np.stack(list(offsets), axis=1)
    width *= motion.adult_second
    return np.stack([mean_over_time(of_feet[..., i], load, width) for i in range(of_feet.shape[-1])], axis=-1)


def mean_over_time(values: Array, weights: Array, width: float) -> Array:
    """Weighted mean (F,) of values (F, S) under a Gaussian over time, straight where nothing has weight for long."""
    total = smoothed(weights.sum(axis=1), width)
    known = np.flatnonzero(total > 1e-3 * max(float(total.max()), 1e-12))
    if not len(known):
        return np.zeros(len(values))
    mean = smoothed((weights * values).sum(axis=1), width)[known] / total[known]
    return smoothed(np.interp(np.arange(len(values)), known, mean), width / 2)
