"""Rigid bodies in closed form: spheres, boxes and wheels as meshes, and loads on them."""

from __future__ import annotations

import numpy as np

from softground_addon.core.motion.motion import CharacterMotion
from softground_addon.core.motion.props import Prop, supports
from softground_addon.core.motion.sole_motion import Sole, SoleMotion
from softground_addon.core.numerics.rigid import rotation
from tests.core.walkers import loads_of, pose


def prop_sole(vertices, triangles, name="body", give=0.0):
    """A sole that is the whole of a body."""
    prop = Prop(np.asarray(vertices, float), np.asarray(triangles), give)
    landmarks = supports(prop.probes)
    low, high = prop.vertices[:, :2].min(axis=0), prop.vertices[:, :2].max(axis=0)
    outline = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    return Sole(name, "", (), landmarks, np.zeros(len(landmarks), int), outline, prop)


def sphere(radius, *, rings=64):
    """Vertices and triangles of a sphere about the origin."""
    latitude = np.linspace(0, np.pi, rings + 1)[1:-1]
    longitude = np.arange(2 * rings) / (2 * rings) * 2 * np.pi
    a, b = np.meshgrid(latitude, longitude, indexing="ij")
    points = np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], -1).reshape(-1, 3)
    vertices = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]]) * radius
    return vertices, np.concatenate([_band(rings - 1, 2 * rings), _caps(rings - 1, 2 * rings)])


def wheel(radius, width, *, sides=96):
    """Vertices and triangles of a cylinder about the y axis."""
    angle = np.arange(sides) / sides * 2 * np.pi
    circle = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1) * radius
    rims = [circle + np.array([0, side * width / 2, 0]) for side in (-1, 1)]
    vertices = np.concatenate([*rims, [[0, -width / 2, 0], [0, width / 2, 0]]])
    return vertices, np.concatenate([_band(2, sides), _caps(2, sides)])


def rolling(frame_rate, speed=1.0, seconds=1.5, radius=0.35, width=0.06, force=400.0, slide=False):
    """A wheel that rolls along x, known at scene frames only."""
    count = round(seconds * frame_rate) + 1
    time = np.arange(count) / frame_rate
    poses = pose(np.stack([speed * time, 0 * time, 0 * time + radius], -1))
    if not slide:
        poses[:, :3, :3] = rotation(np.stack([0 * time, speed * time / radius, 0 * time], -1))
    sole = prop_sole(*wheel(radius, width))
    motion = CharacterMotion("wheel", 1.0, 0.3, 1.0 + np.arange(count), frame_rate, (SoleMotion(sole, poses[:, None]),))
    motion = motion.resampled(round(120 / frame_rate))
    steps = len(motion.frames)
    return loads_of(
        [sole], [motion.soles[0].transforms], np.full((steps, 1), force), np.ones((steps, 1), bool), frame_rate
    )


def box(x, y, z):
    """Vertices and triangles of a box about the origin."""
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * (x / 2, y / 2, z / 2)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def _band(rows, columns):
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    return np.concatenate([np.stack([a, a + columns, b], -1), np.stack([b, a + columns, b + columns], -1)]).reshape(
        -1, 3
    )


def _caps(rows, columns):
    j = np.arange(columns)
    first, last = np.full(columns, rows * columns), np.full(columns, rows * columns + 1)
    end = (rows - 1) * columns
    return np.concatenate(
        [np.stack([first, j, (j + 1) % columns], -1), np.stack([last, end + (j + 1) % columns, end + j], -1)]
    )
