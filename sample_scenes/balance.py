"""Motions whose centre of mass goes where forces take it: forces are chosen first, the hips are placed after them."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from sample_scenes.motion import Array, BodyMotion, Skeleton, joint_paths
from softground_addon.core.dynamics.centre_of_mass import centre_of_mass
from softground_addon.core.motion.motion import CharacterMotion

GRAVITY = 9.81  # m/s²

_HARMONICS = 60
_ROUNDS = 14  # each leaves about a quarter of the error of the one before
_LIMBS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ball", "toe")


def mass_centre(body: Skeleton, motion: BodyMotion) -> Array:
    """Centre of mass of a person over time, (F, 3) [m], from the joints that the add-on reads."""
    paths = joint_paths(body, motion)
    joints = {name: paths[name] for name in ("hips", "spine", "neck", "head") if name in paths}
    joints |= {f"{name}_{side.lower()}": paths[f"{name}.{side}"] for name in _LIMBS for side in "LR"}
    frames = np.arange(len(motion.hips), dtype=float)
    return centre_of_mass(CharacterMotion("", 1.0, 1.0, frames, motion.frame_rate, (), joints))


def rest_centre(body: Skeleton) -> Array:
    """Centre of mass in the rest pose, (3,) [m]."""
    still = {bone: np.eye(3)[None] for bone in body.bones}
    return mass_centre(body, BodyMotion(1.0, body.joints[next(iter(body.bones.values()))[0]][None], still))[0]


def balanced(body: Skeleton, pose: Callable[[Array], BodyMotion], centre: Array, hips: Array) -> BodyMotion:
    """The motion whose centre of mass follows a path.

    Parameters
    ----------
    body : Skeleton
    pose : callable
        The motion for a path of the hips, (F, 3) [m]; limbs that are planted stay so.
    centre : (F, 3) float array
        Where the centre of mass shall be [m].
    hips : (F, 3) float array
        First guess [m].
    """
    motion = pose(hips)
    for _ in range(_ROUNDS):
        hips = hips + centre - mass_centre(body, motion)
        motion = pose(hips)
    return motion


def stance_force(part: Array, shape: float) -> Array:
    """Vertical force over a stance, of mean 1, at parts (...) of it; 0 outside.

    cos(pi·t/T) - q·cos(3·pi·t/T), the form that Alexander and Jayes (1978, 1980) found in all gaits, with t from mid
    stance and shape factor q: 0 for running, up to 0.5 and two humps for a fast walk.
    """
    angle = pi * (np.asarray(part, float) - 0.5)
    force = (np.cos(angle) - shape * np.cos(3 * angle)) * (pi / 2) / (1 + shape / 3)
    return np.where(np.abs(angle) < pi / 2, force, 0.0)


class CyclicPath:
    """The path that a cyclic acceleration makes of a point, about steady progress.

    Parameters
    ----------
    acceleration : (N, ...) float array
        Evenly over one cycle [m/s²]; its mean is taken off.
    period : float
        [s]
    """

    def __init__(self, acceleration: Array, period: float) -> None:
        count = len(acceleration)
        harmonics = min(_HARMONICS, count // 2 - 1)
        spectrum = np.fft.rfft(acceleration, axis=0)[1 : harmonics + 1] / count
        self._orders = np.arange(1, harmonics + 1)
        omega = (2 * pi * self._orders / period).reshape(-1, *[1] * (acceleration.ndim - 1))
        self._amplitudes = -2 * spectrum / omega**2

    def __call__(self, phase: Array) -> Array:
        """Excursions (F, ...) [m] at phases (F,) of the cycle."""
        waves = np.exp(2j * pi * np.outer(phase, self._orders))
        return np.tensordot(waves, self._amplitudes, axes=1).real
