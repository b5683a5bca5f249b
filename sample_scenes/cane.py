"""A walk with a cane: it is set down with the foot of the other side, and the hand stays on it."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import bpy
import numpy as np

from sample_scenes.body import SIDES, Array, Body
from sample_scenes.curves import quintic
from sample_scenes.limbs import bend_to_reach, hanging
from sample_scenes.motion import BodyMotion, Footfall, joint_paths, rotation
from sample_scenes.plain_objects import BOX, add_object, box_corners

_ASIDE = 0.30  # of the cane from the middle of the way, relative to leg length
_AHEAD = 0.04  # of the cane's tip from the foot that lands with it, relative to leg length
_HANDLE = np.array((0.10, 0.24, -0.02))  # of the hand from the hips, relative to leg length
_LIFT = 0.06  # of the tip in mid-swing, relative to leg length
_EARLY = 0.10  # part of the stance by which it is lifted before the foot
_PROFILE = ((0.0, 0.0), (0.011, 0.0008), (0.017, 0.005), (0.017, 0.045), (0.0085, 0.055), (0.0085, 1.0))
"""Radius [m] and height [m; the last over the length] of the stick, with a rubber tip."""


def cane_length(body: Body) -> float:
    """To the wrist of a hanging arm [m]."""
    return 0.93 * body.leg_length


def create_cane(name: str, body: Body, collection: bpy.types.Collection) -> bpy.types.Object:
    """A stick with a crossbar; its tip is the origin, z goes up along it."""
    length, around = cane_length(body), 20
    profile = np.array(_PROFILE)
    profile[-1, 1] *= length
    turn = 2 * pi * np.arange(around) / around
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    rings = [np.column_stack([radius * circle, np.full(around, height)]) for radius, height in profile[1:]]
    vertices = np.concatenate([*rings, [(0, 0, 0), (0, 0, length)]])
    index = np.arange(len(rings) * around).reshape(len(rings), around)
    ahead = np.roll(index, -1, axis=1)
    faces = np.stack([index[:-1], ahead[:-1], ahead[1:], index[1:]], axis=-1).reshape(-1, 4).tolist()
    tip, top = len(vertices) - 2, len(vertices) - 1
    faces += [(tip, b, a) for a, b in zip(index[0], ahead[0], strict=True)]
    faces += [(top, a, b) for a, b in zip(index[-1], ahead[-1], strict=True)]
    bar = box_corners((-0.011, -0.05, length), (0.011, 0.07, length + 0.022))
    faces += [tuple(len(vertices) + corner for corner in face) for face in BOX]
    look = ("SoftGround Sample cane", (0.10, 0.045, 0.02), 0.4)
    return add_object(name, np.concatenate([vertices, bar]), faces, look, collection)


def with_cane(body: Body, motion: BodyMotion, side: str = "L") -> tuple[BodyMotion, Array, Array]:
    """A walk whose arm of a side goes with a cane.

    Parameters
    ----------
    body : Body
    motion : BodyMotion
        A walk along x.
    side : str
        Of the hand that holds it.

    Returns
    -------
    motion : BodyMotion
    tip : (F, 3) float array
        Place of the cane's tip, in the body's frame [m].
    turn : (F, 3, 3) float array
        Rotation of the cane.
    """
    times = np.arange(len(motion.hips)) / motion.frame_rate
    other = "R" if side == "L" else "L"
    tip = _tip(body, [fall for fall in motion.footfalls if fall.side == other], times, SIDES[side])
    wanted = motion.hips + body.leg_length * _HANDLE * (1.0, SIDES[side], 1.0)
    up = (wanted - tip) / np.linalg.norm(wanted - tip, axis=1, keepdims=True)
    handle = tip + cane_length(body) * up
    turn = np.stack([_unit(np.cross([0.0, 1.0, 0.0], up)), np.tile([0.0, 1.0, 0.0], (len(up), 1)), up], axis=-1)
    turn[..., 1] = np.cross(turn[..., 2], turn[..., 0])
    return (
        BodyMotion(motion.frame_rate, motion.hips, motion.turns | _arm(body, motion, side, handle), motion.footfalls),
        tip,
        turn,
    )


def _arm(body: Body, motion: BodyMotion, side: str, wrist: Array) -> dict[str, Array]:
    """Rotations of an arm whose wrist is at places (F, 3)."""
    joints, sign = body.joints, SIDES[side]
    shoulder = joint_paths(body, motion)[f"shoulder.{side}"]
    upper, lower = (
        float(np.linalg.norm(joints[f"{end}.{side}"] - joints[f"{start}.{side}"]))
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist"))
    )
    elbow, lateral = bend_to_reach(shoulder, wrist, upper, lower, motion.turns["chest"] @ (-1.0, 0.4 * sign, 0.0))
    hang = rotation("x", np.full(len(wrist), -sign * np.radians(90.0 - body.arm_droop)))
    fore = hanging(wrist - elbow, -lateral) @ hang
    return {
        f"upper_arm.{side}": hanging(elbow - shoulder, -lateral) @ hang,
        f"forearm.{side}": fore,
        f"hand.{side}": fore,
    }


def _tip(body: Body, falls: Sequence[Footfall], times: Array, sign: float) -> Array:
    """The cane's tip over time: planted while the foot of the other side is, in an arc between."""
    leg = body.leg_length
    places = [np.array((fall.place[0] + _AHEAD * leg, sign * _ASIDE * leg, fall.place[2])) for fall in falls]
    lifts = [fall.leave - _EARLY * (fall.leave - fall.strike) for fall in falls]
    tip = np.tile(places[0], (len(times), 1))
    for number in range(1, len(falls)):
        part = np.clip((times - lifts[number - 1]) / (falls[number].strike - lifts[number - 1]), 0.0, 1.0)[:, None]
        still = np.zeros(3)
        way = quintic(part, places[number - 1], places[number], still, still)
        way[:, 2:] += _LIFT * leg * 64 * (part * (1 - part)) ** 3
        tip = np.where(part > 0, way, tip)
    return tip


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
