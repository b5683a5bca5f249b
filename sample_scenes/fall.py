"""A fall backward onto the ground, stretched out, arms spread: the body turns about its heels like a felled tree."""

from __future__ import annotations

from math import pi

import numpy as np

from sample_scenes.balance import GRAVITY, rest_centre
from sample_scenes.body import BONES, SIDES, Array, Body
from sample_scenes.carriage import hang_arm
from sample_scenes.motion import BodyMotion, Footfall, rotation

LIMBS = ("hips", "chest", "head", *(f"{bone}.{side}" for side in SIDES for bone in ("upper_arm", "forearm", "shin")))
"""What lies on the ground at the end."""

_BACK = 0.075
"""Back of the pelvis behind the hip joints, over stature; that of the heels is less, so that the legs end a little
inclined."""
_GYRATION = 0.28
"""Radius of gyration of a stretched body about its centre, over stature."""
_SPREAD = np.radians(62.0)  # of the arms from the body, lying
_FIRST_LEAN = np.radians(5.0)  # at which the heels give way


def fall_back(body: Body, frame_count: int, frame_rate: float = 24.0) -> BodyMotion:
    """Standing at the origin, facing x, and falling toward -x from the first frame on."""
    heel = np.array((body.foot.back, 0.0, 0.0))
    hip = body.joints["hips"] - heel
    reach, ahead = hip[2], hip[0]
    lying = _BACK * body.stature
    # Where the back of the pelvis comes to the ground: ahead·sin + reach·cos = lying.
    end = np.arctan2(ahead, reach) + np.arccos(lying / np.hypot(ahead, reach))
    legs = np.minimum(_toppling(body, np.arange(frame_count) / frame_rate), end)
    trunk = legs * (pi / 2) / end
    leg_turn, turn = rotation("y", -legs), rotation("y", -trunk)
    hips = heel + leg_turn @ hip
    turns = {bone: leg_turn if bone.split(".")[0] in ("thigh", "shin", "foot", "toe") else turn for bone in BONES}
    spread = _SPREAD * np.sin(np.minimum(1.6 * legs, pi / 2))
    bent = np.full(frame_count, np.radians(8.0))
    for side in SIDES:
        turns |= hang_arm(body, side, turn, 0 * bent, bent, 0 * bent, spread)
    falls = tuple(Footfall(side, -1.0, 100.0, np.array((0.0, body.joints[f"ankle.{side}"][1], 0.0))) for side in SIDES)
    return BodyMotion(frame_rate, hips, turns, falls)


def _toppling(body: Body, times: Array) -> Array:
    """Angle of a stiff body that topples about its heels, (F,) [rad]: I·angle'' = m·g·h·sin(angle)."""
    height = float(rest_centre(body)[2])
    rate = GRAVITY * height / (height**2 + (_GYRATION * body.stature) ** 2)
    step = 1e-3
    angle, speed = _FIRST_LEAN, 0.0
    course = [angle]
    while angle < 2.0:
        speed += step * rate * np.sin(angle)
        angle += step * speed
        course.append(angle)
    return np.interp(times, step * np.arange(len(course)), course)
