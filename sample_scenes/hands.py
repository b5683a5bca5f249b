"""Arms that reach: hands planted on the ground like feet, and free arms between."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sample_scenes.body import SIDES, Array, Body
from sample_scenes.limbs import bend_to_reach, hanging
from sample_scenes.motion import Footfall, rotation

WRIST_HEIGHT = 0.028
"""Wrist of a planted hand above the ground, relative to stature."""

_APPROACH = 0.16
"""Time over which a hand goes to and comes from the ground [s]."""

_FINGERS_UP = np.radians(14.0)
"""Rise of a planted hand from wrist to knuckles: the fingers bend down to the ground."""


def arms_with_hands_down(
    body: Body,
    times: Array,
    hands: Sequence[Footfall],
    chest: Array,
    shoulders: dict[str, Array],
    spread: dict[str, Array],
) -> dict[str, Array]:
    """Rotations of both arms.

    Parameters
    ----------
    body : Body
    times : (F,) float array
        [s]
    hands : sequence of Footfall
        When and where the wrists are over the ground; the heading is that of the fingers.
    chest : (F, 3, 3) float array
        Rotation of the chest.
    shoulders : dict of str to (F, 3) float array
        Shoulder joints by side [m].
    spread : dict of str to (F,) float array
        Where free arms point: away from hanging, sideways [rad].
    """
    joints, turns = body.joints, {}
    for side, sign in SIDES.items():
        upper, lower = (
            float(np.linalg.norm(joints[b] - joints[a]))
            for a, b in ((f"shoulder.{side}", f"elbow.{side}"), (f"elbow.{side}", f"wrist.{side}"))
        )
        away = spread[side]
        free = np.stack([np.full_like(away, 0.12), sign * np.sin(away), -np.cos(away)], axis=-1)
        free = 0.94 * (upper + lower) * free / np.linalg.norm(free, axis=1, keepdims=True)
        wrist = shoulders[side] + np.einsum("fij,fj->fi", chest, free)
        planted = np.zeros(len(times))
        flat = np.tile(np.eye(3), (len(times), 1, 1))
        for hand in (hand for hand in hands if hand.side == side):
            outside = np.maximum(np.maximum(hand.strike - times, times - hand.leave), 0.0)
            near = np.clip(1 - outside / _APPROACH, 0.0, 1.0)
            near = near**3 * (10 - 15 * near + 6 * near**2)
            place = hand.place + np.array((0.0, 0.0, WRIST_HEIGHT * body.stature))
            wrist = (1 - near)[:, None] * wrist + near[:, None] * place
            flat = np.where((near > 0)[:, None, None], _flat_hand(body, side, hand.heading), flat)
            planted = np.maximum(planted, near)
        elbow_side = chest @ np.array((0.75, 0.65 * sign, 0.0))
        elbow, lateral = bend_to_reach(shoulders[side], wrist, upper, lower, elbow_side)
        hang = rotation("x", np.full(len(times), -sign * np.radians(90.0 - body.arm_droop)))
        fore = hanging(_toward(elbow, wrist, shoulders[side]), -lateral) @ hang
        turns |= {
            f"upper_arm.{side}": hanging(elbow - shoulders[side], -lateral) @ hang,
            f"forearm.{side}": fore,
            f"hand.{side}": between(fore, flat, planted),
        }
    return turns


def between(start: Array, end: Array, part: Array) -> Array:
    """Rotations part of the way from one to another, (F, 3, 3): the nearest to their mean."""
    mixed = (1 - part)[:, None, None] * start + part[:, None, None] * end
    u, _, vh = np.linalg.svd(mixed)
    u[:, :, -1] *= np.sign(np.linalg.det(u @ vh))[:, None]
    return np.asarray(u @ vh)


def _toward(elbow: Array, wrist: Array, shoulder: Array) -> Array:
    """Forearm; perpendicular part kept when the wrist is out of reach, along the arm then."""
    line = wrist - elbow
    short = np.linalg.norm(line, axis=1, keepdims=True) < 1e-6
    return np.where(short, elbow - shoulder, line)


def _flat_hand(body: Body, side: str, heading: float) -> Array:
    """Rotation that lays a hand on the ground, palm down, fingers toward a heading [rad]."""
    joints, sign = body.joints, SIDES[side]
    along = joints[f"fingertips.{side}"] - joints[f"wrist.{side}"]
    along = along / np.linalg.norm(along)
    ahead = np.array((1.0, 0.0, 0.0))
    rest = np.column_stack([along, ahead, sign * np.cross(along, ahead)])
    level = np.array((np.cos(heading), np.sin(heading), 0.0))
    fingers = np.cos(_FINGERS_UP) * level + np.sin(_FINGERS_UP) * np.array((0.0, 0.0, 1.0))
    down = np.sin(_FINGERS_UP) * level - np.cos(_FINGERS_UP) * np.array((0.0, 0.0, 1.0))
    thumb = sign * np.cross(down, fingers)
    return np.column_stack([fingers, thumb, down]) @ rest.T
