"""Simple characters for the tests of contacts and forces."""

from __future__ import annotations

import numpy as np

from softground_addon.core.motion.motion import CharacterMotion
from softground_addon.core.motion.sole_motion import Sole, SoleMotion

RECTANGLE = np.array([[-0.1, -0.05], [0.1, -0.05], [0.1, 0.05], [-0.1, 0.05]])


class Slope:
    """An endless plane, z = height + slope·x, missing beyond x = edge."""

    def __init__(self, height=0.0, slope=0.0, edge=np.inf):
        self.height, self.slope, self.edge = height, slope, edge

    def heights(self, x, y):
        return np.where(np.broadcast_to(x, np.broadcast(x, y).shape) > self.edge, np.nan, self.height + self.slope * x)


def flat_sole(path, *, name="foot", landmarks=((-0.1, 0, 0), (0.06, 0, 0), (0.12, 0, 0)), pitch=None):
    """A sole of one piece that follows `path` (N, 3), pitched by `pitch` (N,) [rad], toes down where positive."""
    transforms = np.tile(np.eye(4), (len(path), 1, 1, 1))
    if pitch is not None:
        transforms[:, 0, 0, 0] = transforms[:, 0, 2, 2] = np.cos(pitch)
        transforms[:, 0, 0, 2] = np.sin(pitch)
        transforms[:, 0, 2, 0] = -np.sin(pitch)
    transforms[:, 0, :3, 3] = path
    points = np.array(landmarks, dtype=float)
    return SoleMotion(Sole(name, "", (), points, np.zeros(len(points), dtype=int), RECTANGLE), transforms)


def character(soles, *, hips=None, rate=120.0, mass=77.5, leg_length=0.9, gravity=9.81, **joints):
    """A character of the given soles, with the given joint paths."""
    count = len(soles[0].transforms)
    if hips is not None:
        joints["hips"] = np.broadcast_to(np.asarray(hips, dtype=float), (count, 3))
    return CharacterMotion("test", mass, leg_length, np.arange(count) + 1.0, rate, tuple(soles), joints, gravity)


def standing(count, *, at=((0.0, 0.1, 0.0), (0.0, -0.1, 0.0)), hips=(0.0, 0.0, 0.9), **options):
    """A character that stands on soles at the given places."""
    return character([flat_sole(np.tile(place, (count, 1)).astype(float)) for place in at], hips=hips, **options)
