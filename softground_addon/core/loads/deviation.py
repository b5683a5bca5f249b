"""Error of estimated forces: a standard deviation for each sole at each step.

Four causes decide it, each tried or worked out by itself and added in squares: the choice of the low-pass, the times at
which contacts begin and end, the noise of the motion, and the share of soles that bear together.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..dynamics.body_dynamics import BodyDynamics, body_dynamics
from ..dynamics.load_sharing import POINT_DEVIATION
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array
from ..numerics.smoothing_spline import smooth_path
from .contacts import Contacts
from .estimate import CharacterLoads
from .forces import whole_body_forces

CUTOFF_FACTOR = 1.25
"""Between cut-offs that are as good a choice: their factor about the one that is taken, standard deviation."""
TIMING_DEVIATION = 0.035
"""Standard deviation of the beginning and the end of a contact, in sqrt(leg length/gravity) (10 ms for an adult)."""
MODEL_DEVIATION = 0.03
"""Of a sole's own load: what flesh, mass fractions and joint centres leave open."""
LOADED = 0.02
"""Share below which a sole bears nothing together with another."""


def force_deviation(loads: CharacterLoads) -> Array:
    """Standard deviation of the vertical force on each sole, (N, S) [N].

    Parameters
    ----------
    loads : CharacterLoads
        Of a body whose joints are known; the forces of the impulse model and of props have none.

    Raises
    ------
    ValueError
        Without joints.
    """
    motion, contacts = loads.motion, loads.contacts
    if not motion.joints or motion.centre is not None:
        raise ValueError("only the forces of a body with joints have a deviation")
    body = body_dynamics(motion, ~contacts.touching.any(axis=1))
    vertical = loads.forces.forces[..., 2]
    low, high = (_vertical(motion, contacts, cutoff_factor=factor) for factor in (1 / CUTOFF_FACTOR, CUTOFF_FACTOR))
    steps = max(1, round(TIMING_DEVIATION * motion.pendulum_time / motion.time_step))
    exact = TIMING_DEVIATION * motion.pendulum_time / motion.time_step / steps
    early, late = (_vertical(motion, _shifted(contacts, by), body) for by in (-steps, steps))
    longer, shorter = (_vertical(motion, _grown(contacts, by), body) for by in (steps, -steps))
    weight = motion.mass * motion.gravity
    share = vertical / np.maximum(vertical.sum(axis=1, keepdims=True), 1e-9 * weight)
    parts = (
        (high - low) / 2,
        exact * (late - early) / 2,
        exact * (longer - shorter) / 2,
        share * _noise(motion, body) * weight,
        _of_shares(motion, loads, share) * vertical.sum(axis=1, keepdims=True),
        MODEL_DEVIATION * vertical,
    )
    return np.asarray(np.sqrt(sum(part**2 for part in parts)))


def _vertical(
    motion: CharacterMotion, contacts: Contacts, body: BodyDynamics | None = None, *, cutoff_factor: float = 1.0
) -> Array:
    return whole_body_forces(motion, contacts, body, cutoff_factor=cutoff_factor).forces[..., 2]


def _shifted(contacts: Contacts, steps: int) -> Contacts:
    """The contacts so many steps later."""
    index = np.clip(np.arange(len(contacts.touching)) - steps, 0, len(contacts.touching) - 1)
    return dataclasses.replace(contacts, touching=contacts.touching[index])


def _grown(contacts: Contacts, steps: int) -> Contacts:
    """The contacts longer, or shorter, by so many steps at both ends."""
    before, after = (_shifted(contacts, by).touching for by in (-abs(steps), abs(steps)))
    touching = before | after | contacts.touching if steps > 0 else before & after & contacts.touching
    return dataclasses.replace(contacts, touching=touching)


def _noise(motion: CharacterMotion, body: BodyDynamics) -> float:
    """Standard deviation of the total force that the motion's noise leaves [body weights]."""
    frames = body.points.centre[:, 2]
    residual = frames - body.centre[motion.on_frames, 2]
    count = len(frames)
    if count < 8:
        return 0.0
    impulse = np.zeros((count, 1))
    impulse[count // 2] = 1.0
    _, _, answer = smooth_path(impulse, motion.frame_step, body.cutoff)
    return float(np.std(residual) * np.linalg.norm(answer) / motion.fall)


def _of_shares(motion: CharacterMotion, loads: CharacterLoads, share: Array) -> Array:
    """Standard deviation of the shares of soles that bear together, (N, S)."""
    bearing = share > LOADED
    together = bearing.sum(axis=1) > 1
    points = loads.forces.centre_of_pressure[..., :2]
    weight = np.where(bearing, 1.0, 0.0)
    others = weight.sum(axis=1, keepdims=True) - weight
    sums = np.einsum("nsc,ns->nc", np.nan_to_num(points), weight)
    middle = (sums[:, None] - np.nan_to_num(points) * weight[..., None]) / np.maximum(others, 1.0)[..., None]
    apart = np.linalg.norm(points - middle, axis=-1)
    deviation = POINT_DEVIATION * motion.leg_length / np.maximum(apart, 1e-6)
    return np.where(together[:, None] & bearing, np.minimum(deviation, 0.5), 0.0)
