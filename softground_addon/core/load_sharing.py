"""How several contacts share one load: non-negative least squares, for all steps at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_EVENNESS = 1e-6
"""How much an even split counts: decides only where force and moment leave the shares open."""


def share_by_moment(points: Array, target: Array, touching: Mask) -> Array:
    """Shares of a unit load whose moment about `target` is least.

    For two contacts this is the corrected Eq. 5 of the paper (MODEL.md section 2, 1): the place of the target's
    projection on the segment between them, clipped to it, and one half each where they coincide.

    Parameters
    ----------
    points : (N, S, 2) float array
        Contact points on the ground plane [m].
    target : (N, 2) float array
        Where the load's line of action meets that plane, e.g. the projection of the centre of mass [m].
    touching : (N, S) bool array

    Returns
    -------
    (N, S) float array, not negative; rows sum to 1, or are 0 where nothing touches.
    """
    arm = np.where(touching[..., None], points - target[:, None, :], 0.0)
    scale = (arm**2).sum(axis=(1, 2)) / np.maximum(touching.sum(axis=1), 1)
    gram = arm @ np.swapaxes(arm, 1, 2) / np.where(scale > 0, scale, 1.0)[:, None, None]
    gram += _EVENNESS * np.eye(touching.shape[1])
    # Shares that sum to 1 and minimise share·gram·share are, up to their sum, those that minimise
    # share·gram·share/2 - sum(share): the constraint's multiplier only scales them.
    right = np.ones(touching.shape)
    share = solve_non_negative(gram, right, touching)
    total = share.sum(axis=1, keepdims=True)
    return np.divide(share, total, out=np.zeros_like(share), where=total > 0)


def solve_non_negative(gram: Array, right: Array, free: Mask) -> Array:
    """Minimise x·gram·x/2 - right·x over x >= 0, for many small problems at once.

    Block principal pivoting (Kim and Park 2011, "Fast nonnegative matrix factorization: an active-set-like method",
    SIAM J. Sci. Comput. 33(6)); single pivots after S rounds, so that it ends.

    Parameters
    ----------
    gram : (N, S, S) float array
        Symmetric, positive definite.
    right : (N, S) float array
    free : (N, S) bool array
        Unknowns that may differ from 0.

    Returns
    -------
    (N, S) float array
    """
    count = free.shape[1]
    passive = free.copy()
    identity = np.eye(count)
    tolerance = 1e-12 * np.abs(right).max(initial=1.0)
    solution = np.zeros(free.shape)
    for attempt in range(4 * count + 4):
        system = np.where(passive[:, :, None] & passive[:, None, :], gram, identity)
        solution = np.linalg.solve(system, np.where(passive, right, 0.0)[..., None])[..., 0]
        gradient = np.einsum("nij,nj->ni", gram, solution) - right
        wrong = free & np.where(passive, solution < 0, gradient < -tolerance)
        if not wrong.any():
            break
        if attempt >= count:
            wrong &= np.cumsum(wrong[:, ::-1], axis=1)[:, ::-1] == 1
        passive ^= wrong
    return np.where(free, np.maximum(solution, 0.0), 0.0)
