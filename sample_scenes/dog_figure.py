"""The shape of a dog over a `Dog`: coat, ears, eyes and nose, and paws with pads, with bone weights."""

from __future__ import annotations

from functools import cache

import numpy as np

from sample_scenes.body import SIDES
from sample_scenes.dog import Dog
from sample_scenes.figure import Figure, Piece, joined, surface
from sample_scenes.motion import Array
from sample_scenes.solids import Solid, cut, ellipsoid, round_cone, union


@cache
def hound(body: Dog) -> Figure:
    """A short-haired shepherd dog."""
    pieces = [_trunk(body), _face(body)]
    for side in SIDES:
        pieces += [_hind_leg(body, side), _front_leg(body, side)]
        pieces += [_paw(body, f"foot.{side}"), _paw(body, f"hand.{side}")]
    return joined(pieces)


def _trunk(body: Dog) -> Piece:
    """Trunk, neck, head and tail; the legs are pieces of their own, so that they slide under the skin of the ribs."""
    W, g, j = body.withers, body.girth, body.joints
    trunk = [
        ellipsoid(j["chest"] + W * np.array((0.06, 0, -0.155)), W * g * np.array((0.30, 0.150, 0.235))),  # rib cage
        ellipsoid(j["spine"] + W * np.array((0.05, 0, -0.115)), W * g * np.array((0.25, 0.120, 0.155))),  # belly
        ellipsoid(j["hips"] + W * np.array((-0.02, 0, -0.035)), W * g * np.array((0.20, 0.140, 0.150))),  # croup
        ellipsoid(j["neck"] + W * np.array((0.01, 0, -0.20)), W * g * np.array((0.125, 0.150, 0.165))),  # forechest
        round_cone(j["hips"], j["chest"], 0.085 * W * g, 0.10 * W * g),
        round_cone(j["neck"] - W * np.array((0.04, 0, 0.10)), j["head"], 0.150 * W * g, 0.105 * W),
    ]
    skull, nose = j["head"], j["nose"]
    ahead = (nose - skull) / np.linalg.norm(nose - skull)
    head = [
        ellipsoid(skull + 0.03 * W * ahead, W * np.array((0.125, 0.105, 0.100))),
        round_cone(
            skull + 0.08 * W * ahead - W * np.array((0, 0, 0.02)),
            nose - 0.025 * W * ahead,
            0.080 * W,
            0.052 * W * body.snout,
        ),
    ]
    for y in SIDES.values():
        base = skull + W * np.array((-0.035, 0.065 * y, 0.075))
        head.append(
            round_cone(
                base, base + W * body.ears * np.array((-0.015, 0.030 * y, 0.125)), 0.042 * W * body.ears**0.7, 0.010 * W
            )
        )
    tail = [
        round_cone(j["tail"] + W * np.array((0.10, 0, 0)), j["tail_middle"], 0.055 * W, 0.050 * W * body.brush),
        round_cone(j["tail_middle"], j["tail_tip"], 0.050 * W * body.brush, 0.020 * W * body.brush),
    ]
    solid = union([union(trunk, 0.06 * W), union(head, 0.04 * W), union(tail, 0.02 * W)], 0.05 * W)
    wide = 0.26 * W * max(g, 1.0)
    tip = j["tail_tip"] - 0.08 * W * body.brush
    low = np.array((tip[0], -wide, min(0.35 * W / max(g, 1.0), tip[2])))
    high = np.array((nose[0] + 0.08 * W, wide, (1.30 + 0.15 * body.ears) * W))
    return surface(
        body, "coat", solid, low, high, 0.017 * W, tuple(bone for bone in body.bones if "." not in bone[-2:])
    )


def _hind_leg(body: Dog, side: str) -> Piece:
    W, g, j = body.withers, body.girth**0.6, body.joints
    hip, knee, hock, paw = (j[f"{name}.{side}"] for name in ("hip", "knee", "hock", "paw"))
    parts = [
        ellipsoid(hip + W * np.array((0.01, 0, -0.09)), W * g * np.array((0.145, 0.075, 0.190))),  # haunch
        round_cone(hip - W * np.array((0, 0, 0.06)), knee, 0.095 * W * g, 0.064 * W * g),
        round_cone(knee, hock, 0.058 * W * g, 0.032 * W * g),
        round_cone(hock - W * np.array((0.012, 0, 0)), paw, 0.030 * W * g, 0.033 * W * g),
    ]
    return _leg(body, union(parts, 0.04 * W), (hip, knee, hock, paw), ("thigh", "shin", "hock"), side)


def _front_leg(body: Dog, side: str) -> Piece:
    W, g, j = body.withers, body.girth**0.6, body.joints
    shoulder, elbow, wrist, forepaw = (j[f"{name}.{side}"] for name in ("shoulder", "elbow", "wrist", "forepaw"))
    blade = j[f"withers.{side}"] + 0.45 * (shoulder - j[f"withers.{side}"])
    parts = [
        ellipsoid(blade - (0, SIDES[side] * 0.012 * W, 0), W * g * np.array((0.090, 0.045, 0.165))),
        round_cone(shoulder, elbow, 0.082 * W * g, 0.056 * W * g),
        round_cone(elbow, wrist, 0.050 * W * g, 0.036 * W * g),
        round_cone(wrist, forepaw, 0.034 * W * g, 0.034 * W * g),
    ]
    bones = ("shoulder", "upper_arm", "forearm", "pastern")
    return _leg(body, union(parts, 0.04 * W), (blade, shoulder, elbow, wrist, forepaw), bones, side)


def _leg(body: Dog, solid: Solid, places: tuple[Array, ...], bones: tuple[str, ...], side: str) -> Piece:
    margin = 0.24 * body.withers * max(body.girth, 1.0)
    low, high = np.min(places, axis=0) - margin, np.max(places, axis=0) + margin
    low[2] = 0.0
    return surface(body, "coat", solid, low, high, 0.013 * body.withers, tuple(f"{bone}.{side}" for bone in bones))


def _face(body: Dog) -> Piece:
    """The tip of the nose, and the eyes."""
    W, j = body.withers, body.joints
    skull, nose = j["head"], j["nose"]
    ahead = (nose - skull) / np.linalg.norm(nose - skull)
    up = np.array((-ahead[2], 0.0, ahead[0]))
    parts = [ellipsoid(nose + W * (0.012 * ahead + 0.018 * up), W * np.array((0.026, 0.028, 0.022)))]
    parts += [
        ellipsoid(skull + W * (0.115 * ahead + 0.052 * up) + (0, y * 0.062 * W, 0), W * np.full(3, 0.017))
        for y in SIDES.values()
    ]
    low, high = skull - W * np.array((0.1, 0.15, 0.2)), nose + W * np.array((0.1, 0.15, 0.2))
    return surface(body, "dark", union(parts, 0.002 * W), low, high, 0.006 * W, ("head",))


def _paw(body: Dog, bone: str) -> Piece:
    """A paw on a pad and four toes, flat underneath."""
    joint = body.joints[body.bones[bone][0]]
    paw = body.paw
    length, width = paw.length, paw.width
    ground = joint * (1, 1, 0)

    def at(along: float, across: float, up: float) -> Array:
        return ground + np.array((along * length, across * width, up * length))

    if body.toes_apart:
        above, pad, high, toe = 0.42, (-0.14, 0.15, 0.32), 0.16, (0.16, 0.125)
        toes = ((-0.40, 0.13), (-0.145, 0.36), (0.145, 0.36), (0.40, 0.13))
    else:
        above, pad, high, toe = 0.24, (-0.08, 0.24, 0.40), 0.13, (0.185, 0.150)
        toes = ((-0.36, 0.24), (-0.13, 0.38), (0.13, 0.38), (0.36, 0.24))
    parts = [
        round_cone(joint, at(0.05, 0, above), 0.27 * length, 0.30 * length),
        ellipsoid(at(pad[0], 0, high), np.array((pad[1] * length, pad[2] * width, (high + 0.07) * length))),
    ]
    for across, ahead in toes:
        thick = np.array((toe[0] * length, toe[1] * width, (high + 0.06) * length))
        parts.append(ellipsoid(at(ahead, across, high), thick))
    solid = cut(union(parts, 0.035 * length), ground, (0.0, 0.0, -1.0), 0.01 * length)
    reach = np.array((0.75 * length, 0.75 * width, 0.0))
    low, high = ground - reach - (0, 0, 0.05 * length), ground + reach + (0, 0, 0.85 * length)
    return surface(body, "coat", solid, low, high, (0.030 if body.toes_apart else 0.045) * length, (bone,))
