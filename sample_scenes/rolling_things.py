"""Things without a rig: a wheel that rolls along a course, a ball that falls; plain keyed objects."""

from __future__ import annotations

from math import pi, sqrt

import bpy
import numpy as np
from mathutils import Matrix

from sample_scenes.balance import GRAVITY
from sample_scenes.character import TO_BLENDER
from sample_scenes.course import Course
from sample_scenes.keys import object_curves, quaternions, write_curve
from sample_scenes.motion import Array, rotation
from sample_scenes.plain_objects import add_object
from sample_scenes.stride import inward_lean


def create_wheel(
    name: str, collection: bpy.types.Collection, radius: float = 0.34, tyre: float = 0.022
) -> bpy.types.Object:
    """A bicycle wheel with a knobbly tyre, hub and spokes; its axle is the x axis, its middle the origin.

    Parameters
    ----------
    name : str
    collection : bpy.types.Collection
    radius, tyre : float
        Of the wheel to the outside of the tyre, and of the tyre's section [m].
    """
    vertices, faces = wheel_mesh(radius, tyre)
    look = ("SoftGround Sample tyre", (0.015, 0.015, 0.016), 0.7)
    return add_object(name, vertices, faces, look, collection, smooth=True)


def create_ball(name: str, collection: bpy.types.Collection, radius: float = 0.15) -> bpy.types.Object:
    """A ball about the origin, radius in metres."""
    rings, around = 48, 96
    polar = np.pi * (np.arange(rings) + 0.5) / rings
    turn = 2 * np.pi * np.arange(around) / around
    circle = np.stack(np.broadcast_arrays(np.cos(turn), np.sin(turn), 0.0), axis=-1)
    middle = np.sin(polar)[:, None, None] * circle + np.cos(polar)[:, None, None] * (0.0, 0.0, 1.0)
    vertices = radius * np.concatenate([middle.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]])
    faces = _grid(rings - 1, around, around, close_rows=False)
    top, bottom = rings * around, rings * around + 1
    column = np.arange(around)
    ahead = (column + 1) % around
    last = (rings - 1) * around
    caps = [(top, a, b) for a, b in zip(column, ahead, strict=True)]
    caps += [(bottom, last + b, last + a) for a, b in zip(column, ahead, strict=True)]
    material = ("SoftGround Sample ball", (0.45, 0.05, 0.03), 0.4)
    return add_object(name, vertices, [*faces.tolist(), *caps], material, collection, smooth=True)


def roll_along(
    wheel: bpy.types.Object,
    course: Course,
    radius: float,
    speed: float,
    frame_count: int,
    frame_rate: float = 24.0,
    first_frame: int = 1,
) -> bpy.types.Action:
    """Roll a wheel along a course without slipping: it turns by distance over radius, leans into bends."""
    poses = rolling(course, radius, speed, np.arange(frame_count) / frame_rate)
    return write_poses(wheel, *poses, first_frame)


def rolling(course: Course, radius: float, speed: float, times: Array) -> tuple[Array, Array]:
    """Middle (F, 3) [m] and rotation (F, 3, 3) of a rolling wheel with its axle along y, in the body's frame."""
    fine = np.arange(-0.5, speed * (times[-1] + 1.0) + 0.5, 0.01)
    rise = course.ground(fine)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(fine), np.diff(rise)))])
    travelled = np.interp(0.0, fine, length) + speed * times
    along = np.interp(travelled, length, fine)
    heading, lean = course.heading(along), inward_lean(speed, course.curvature(along))
    slope = np.arctan(np.interp(along, fine, np.gradient(rise, fine)))
    frame = rotation("z", heading) @ rotation("y", -slope) @ rotation("x", -lean)
    contact = np.column_stack([course.place(along), course.ground(along)])
    turned = (travelled - travelled[0]) / radius
    return contact + radius * frame[:, :, 2], frame @ rotation("y", turned)


def drop(
    thing: bpy.types.Object,
    height: float,
    sinkage: float,
    frame_count: int,
    frame_rate: float = 24.0,
    first_frame: int = 1,
) -> bpy.types.Action:
    """Let a thing fall freely by a height [m] and come to rest after sinking in by a depth [m], evenly decelerated.

    It starts where it is, at z above the ground by the height and its own lower half.
    """
    path = falling(height, sinkage, np.arange(frame_count) / frame_rate)
    start = np.array(thing.location)
    frames = first_frame + np.arange(frame_count, dtype=float)
    action, curves = object_curves(thing, f"{thing.name} Fall")
    write_curve(curves, "location", 2, frames, start[2] + path)
    return action


def falling(height: float, sinkage: float, times: Array) -> Array:
    """Height relative to the start, (F,) [m]."""
    impact, speed = sqrt(2 * height / GRAVITY), sqrt(2 * height * GRAVITY)
    stop = 2 * sinkage / speed
    since = np.clip(times - impact, 0.0, stop)
    free = -GRAVITY / 2 * np.minimum(times, impact) ** 2
    return free - np.where(times > impact, speed * since - speed / (2 * stop) * since**2, 0.0)


def wheel_mesh(radius: float, tyre: float) -> tuple[Array, list[list[int]]]:
    """Vertices and faces of a wheel with its axle along x."""
    around, section, knobs = 288, 16, 72
    turn = 2 * pi * np.arange(around) / around
    angle = 2 * pi * np.arange(section) / section
    outward = np.clip(np.cos(angle), 0.0, 1.0)  # 1 on the tread
    knob = 0.004 * (np.sin(knobs * turn) > 0)[:, None] * (outward > 0.6)
    away = radius - tyre + (tyre - 0.004) * np.cos(angle) + knob
    across = np.broadcast_to(tyre * np.sin(angle), away.shape)
    vertices = [np.stack([across, away * np.cos(turn)[:, None], away * np.sin(turn)[:, None]], axis=-1).reshape(-1, 3)]
    faces = _grid(around, section, section, close_rows=True).tolist()
    bars = [((-0.03, 0.0, 0.0), (0.03, 0.0, 0.0), 0.022)]
    for spoke in range(24):
        a = 2 * pi * spoke / 24
        rim = (0.0, (radius - 1.6 * tyre) * np.cos(a), (radius - 1.6 * tyre) * np.sin(a))
        bars.append(((0.022 * (-1) ** spoke, 0.0, 0.0), rim, 0.0022))
    count = around * section
    for start, end, thickness in bars:
        points, quads = _bar(np.array(start), np.array(end), thickness)
        vertices.append(points)
        faces += [[index + count for index in quad] for quad in quads]
        count += len(points)
    return np.concatenate(vertices), faces


def _bar(start: Array, end: Array, radius: float, around: int = 8) -> tuple[Array, list[list[int]]]:
    axis = (end - start) / np.linalg.norm(end - start)
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    turn = 2 * pi * np.arange(around) / around
    ring = radius * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(axis, side))
    sides = [[i, (i + 1) % around, (i + 1) % around + around, i + around] for i in range(around)]
    ends = [list(range(around))[::-1], list(range(around, 2 * around))]
    return np.concatenate([start + ring, end + ring]), sides + ends


def _grid(rows: int, columns: int, stride: int, *, close_rows: bool) -> Array:
    """Quads between rows of vertices; columns close, rows close if asked."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    below = (i + 1) % rows if close_rows else i + 1
    ahead = (j + 1) % columns
    return np.stack([i * stride + j, below * stride + j, below * stride + ahead, i * stride + ahead], -1).reshape(-1, 4)


def write_poses(thing: bpy.types.Object, places: Array, turns: Array, first_frame: int) -> bpy.types.Action:
    """Key location and rotation from the body's frame; where the thing was placed before is the origin."""
    frames = first_frame + np.arange(len(places), dtype=float)
    base = thing.matrix_world.copy()
    action, curves = object_curves(thing, f"{thing.name} Roll")
    origin, facing = np.array(base.translation), np.array(base.to_3x3().normalized())
    places = origin + places @ (facing @ TO_BLENDER).T
    turns = facing @ TO_BLENDER @ turns @ TO_BLENDER.T
    thing.matrix_world = Matrix.Identity(4)
    thing.rotation_mode = "QUATERNION"
    for index, values in enumerate(places.T):
        write_curve(curves, "location", index, frames, values)
    for index, values in enumerate(quaternions(turns).T):
        write_curve(curves, "rotation_quaternion", index, frames, values)
    return action
