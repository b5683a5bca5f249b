"""Accelerations of moving ground, and the inertial forces on bodies that move on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array
from ..numerics.smoothing_spline import smooth_path

CUTOFF = 4.0
"""Cut-off of the low-pass before accelerations are taken [Hz]: single precision shakes places."""
HIGHEST_CUTOFF = 0.34
"""The same as a fraction of the frame rate, at most."""
FAR = 1000.0
"""Farthest from the origin that places are rounded as single precision does [m]; beyond, parents keep them finer."""
EVEN = 4.0
"""Largest distance of even motion from a straight line [roundings of single precision]."""


@dataclass(frozen=True)
class GroundRide:
    """Terms of the inertial force on bodies in the frame of moving ground; even motion has none.

    Attributes
    ----------
    frames : (F,) float array
        Scene frames.
    rest : (F, 3) float array
        Acceleration against gravity of what rests at the origin of the frame, in its axes, over that gravity.
    turning, spinning : (F, 3, 3) float arrays
        What places [1/m] and velocities [s/m] in the frame add to it.
    """

    frames: Array
    rest: Array
    turning: Array
    spinning: Array

    @classmethod
    def of(cls, frames: Array, to_world: Array, frame_rate: float, up: Array, gravity: float) -> GroundRide:
        """The ride in a frame whose matrices to the world are given, (F, 4, 4) [m].

        With x the place in the world and c that in the frame, x = R·c + o, so that a body there is pushed by
        R^T·(x" + g·up) = c" + 2·R^T·R'·c' + R^T·R"·c + R^T·(o" + g·up) per mass.
        """
        turn = to_world[:, :3, :3]
        path = np.concatenate([to_world[:, :3, 3], turn.reshape(-1, 9)], axis=1)
        cutoff = min(CUTOFF, HIGHEST_CUTOFF * frame_rate)
        _, rate, acceleration = smooth_path(path, 1.0 / frame_rate, cutoff)
        size = np.minimum(np.abs(path).max(axis=0), np.ptp(path, axis=0) + FAR)
        rounding = np.spacing(size.astype(np.float32)).astype(np.float64)
        along = np.linspace(0.0, 1.0, len(path))[:, None]
        straight = path[0] + along * (path[-1] - path[0])
        acceleration[:, (np.abs(path - straight) <= EVEN * rounding).all(axis=0)] = 0.0
        rate[:, (np.abs(path - path[0]) <= EVEN * rounding).all(axis=0)] = 0.0
        back = np.swapaxes(turn, -1, -2)
        rest = np.einsum("fij,fj->fi", back, acceleration[:, :3] / gravity + up)
        turning, spinning = (back @ each[:, 3:].reshape(-1, 3, 3) / gravity for each in (acceleration, 2.0 * rate))
        return cls(np.asarray(frames, dtype=np.float64), rest, turning, spinning)

    def upward(self, frames: Array, centre: Array, velocity: Array) -> Array:
        """Force that holds bodies against gravity and inertia at places (N, 3) [m] of the frame with velocities (N, 3)
        [m/s], per weight, (N, 3)."""
        rest, turning, spinning = (
            np.stack([np.interp(frames, self.frames, part) for part in values.reshape(len(values), -1).T], axis=-1)
            for values in (self.rest, self.turning, self.spinning)
        )
        turned = np.einsum("nij,nj->ni", turning.reshape(-1, 3, 3), centre)
        return np.asarray(rest + turned + np.einsum("nij,nj->ni", spinning.reshape(-1, 3, 3), velocity))
