"""Balance controller: lean of a body on ground that slopes or gives way (docs/model.md section 5; the paper, Eq. 1).

The body is a rigid capsule that pivots about its support. A source animation is made for level ground: where the
ground slopes, its centre of mass counts as carried along with the ground's normal, behind the support uphill and
ahead of it downhill. The torque T = alpha·(p_target - p_com)·u - beta·omega brings it back over the support, so that
the body leans into the slope, swinging on the way. Nothing leans on level ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, pi, sin, sqrt

import numpy as np

from ..numerics.arrays import Array

SUBSTEP_RATE = 480.0
"""Lowest rate of the integration [Hz]: a multiple of 24, 30, 60 and 120."""
LARGEST_LEAN = np.radians(25.0)
"""The controller leans no further [rad]."""
RADIUS = 0.1
"""Radius of a body's capsule over its height."""


@dataclass(frozen=True)
class TiltGains:
    """Constants of a body's swing back to balance, the same for a mouse and a giant.

    Attributes
    ----------
    frequency : float
        Natural frequency [Hz].
    damping : float
        Damping ratio; below 1 the body swings past its balance.
    """

    frequency: float = 0.6
    damping: float = 0.85

    @classmethod
    def from_torques(cls, alpha: float, beta: float, *, inertia: float, arm: float) -> TiltGains:
        """Constants from the paper's gains.

        Parameters
        ----------
        alpha : float
            Torque per metre that the centre of mass is off its support [N].
        beta : float
            Torque per angular speed [N·m·s].
        inertia : float
            About the support [kg·m²].
        arm : float
            From the support to the centre of mass [m].
        """
        natural = sqrt(alpha * arm / inertia)
        return cls(natural / (2 * pi), beta / (2 * inertia * natural))


PAPER_TORQUES = (30.0, 6.0)
"""alpha [N] and beta [N·m·s] as printed: a swing of many seconds, hardly damped."""
AUTHORS_TORQUES = (1300.0, 600.0)
"""alpha [N] and beta [N·m·s] of the authors' own scene."""


def capsule_inertia(mass: float, height: float, radius: float) -> float:
    """Moment of inertia of an upright capsule about a horizontal axis through its lowest point [kg·m²].

    Parameters
    ----------
    height, radius : float
        The height includes both caps [m].
    """
    length = height - 2 * radius
    cylinder, caps = pi * radius**2 * length, 4 / 3 * pi * radius**3
    density = mass / (cylinder + caps)
    about_centre = cylinder * (length**2 / 12 + radius**2 / 4)
    about_centre += caps * (0.4 * radius**2 + length**2 / 4 + 3 / 8 * length * radius)
    return density * about_centre + mass * (height / 2) ** 2


def body_gains(alpha: float, beta: float, *, mass: float, arm: float) -> TiltGains:
    """Gains of a body from the paper's torques; it is a capsule twice as high as its centre of mass."""
    inertia = capsule_inertia(mass, 2 * arm, 2 * arm * RADIUS)
    return TiltGains.from_torques(alpha, beta, inertia=inertia, arm=arm)


def lean(
    slope: Array,
    *,
    frame_rate: float,
    gains: TiltGains,
    supported: Array | None = None,
) -> Array:
    """Lean of a body over time.

    It starts in balance and at rest. Semi-implicit Euler in sub-steps of the same length at any frame rate, between
    which the ground changes linearly.

    Parameters
    ----------
    slope : (F, 2) float array
        Angle of the ground under the body, along the x and the y axis, positive where it rises [rad].
    frame_rate : float
        [Hz]
    supported : (F,) float array, optional
        1 where the body stands, 0 where nothing touches: there no torque turns it back, and it comes to rest.

    Returns
    -------
    (F, 2) float array
        Angle by which the body leans toward +x and +y [rad], at most `LARGEST_LEAN`. The source counts as balanced,
        wherever its own centre of mass is.

    Examples
    --------
    On a steady slope a body stays where it stands in balance:

    >>> lean(np.full((3, 2), 0.1), frame_rate=24, gains=TiltGains()).round(6)
    array([[0.1, 0.1],
           [0.1, 0.1],
           [0.1, 0.1]])
    """
    count = len(slope)
    balance = np.clip(slope, -LARGEST_LEAN, LARGEST_LEAN)
    grip = np.ones(count) if supported is None else supported
    substeps = max(1, ceil(SUBSTEP_RATE / frame_rate - 1e-9))
    step = 1.0 / (frame_rate * substeps)
    natural = 2 * pi * gains.frequency
    fraction = np.arange(substeps) / substeps
    result = np.empty((count, 2))
    result[0] = balance[0]
    angle, speed = balance[0].copy(), np.zeros(2)
    for k in range(1, count):
        targets = balance[k - 1] + fraction[:, None] * (balance[k] - balance[k - 1])
        stiffness = natural**2 * (grip[k - 1] + fraction * (grip[k] - grip[k - 1]))
        angle, speed = _swing(angle, speed, targets, stiffness, 2 * gains.damping * natural, step)
        result[k] = angle
    return result


def _swing(
    angle: Array, speed: Array, targets: Array, stiffness: Array, damping: float, step: float
) -> tuple[Array, Array]:
    """The sub-steps of one frame, in plain numbers: faster than arrays of two."""
    (x, y), (vx, vy) = angle.tolist(), speed.tolist()
    limit = float(LARGEST_LEAN)
    drag = 1.0 / (1.0 + damping * step)  # damping taken at the end of the step, stable at any size
    for (tx, ty), k in zip(targets.tolist(), stiffness.tolist(), strict=True):
        vx = (vx - step * k * sin(x - tx)) * drag
        vy = (vy - step * k * sin(y - ty)) * drag
        x += step * vx
        y += step * vy
        if abs(x) > limit:
            x, vx = (limit if x > 0 else -limit), 0.0
        if abs(y) > limit:
            y, vy = (limit if y > 0 else -limit), 0.0
    return np.array([x, y]), np.array([vx, vy])


RING = 0.35
"""Radius of the ground around the body that it senses beside that under its soles, in leg lengths."""
_RING_POINTS = 8


def ring_around(centre: Array, leg_length: float) -> Array:
    """Places (F, K, 2) on the ground around a path (F, 2) [m]."""
    angle = 2 * pi * np.arange(_RING_POINTS) / _RING_POINTS
    return np.asarray(centre[:, None] + RING * leg_length * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def along_heading(slope: Array, heading: Array, lateral: float) -> Array:
    """A slope with its part across the heading scaled: 0 leans only forward and back, 1 all ways.

    Parameters
    ----------
    slope : (F, 2) float array [rad]
    heading : (F, 2) float array
        Unit vectors, or 0 where there is no heading.
    """
    ahead = np.sum(slope * heading, axis=1, keepdims=True) * heading
    return np.asarray(ahead + lateral * (slope - ahead))
