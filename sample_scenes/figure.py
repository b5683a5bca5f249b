"""The shape of a hiker: cap, head, hands, jacket, trousers, shoes or bare feet over a `Body`, with bone weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sample_scenes.body import BONES, SIDES, Array, Body, Foot
from sample_scenes.motion import Skeleton
from sample_scenes.shoe import shoe_mesh
from sample_scenes.solids import Solid, cut, ellipsoid, mesh_of, round_cone, union

PARTS = ("skin", "jacket", "trousers", "cap", "shoe", "sole", "coat", "dark")
"""What the faces belong to, in the order of `Figure.parts`."""

_FALLOFF = 6.0
"""Power of the inverse distance to the bones that shares out weights: higher makes crisper joints."""


@dataclass(frozen=True)
class Figure:
    """A closed, weighted mesh in the body's frame.

    Attributes
    ----------
    vertices : (V, 3) float array
        [m].
    quads : (Q, 4) int array
        Outward; a triangle repeats its last vertex.
    parts : (Q,) int array
        Index into `PARTS`.
    weights : (V, B) float array
        Share of each of the body's bones; rows sum to 1.
    """

    vertices: Array
    quads: NDArray[np.intp]
    parts: NDArray[np.intp]
    weights: Array


Piece = tuple[Array, NDArray[np.intp], NDArray[np.intp], Array]
"""Vertices, quads, parts and weights of a closed piece, as in `Figure`."""


@cache
def hiker(body: Body, coarseness: float = 1.0) -> Figure:
    """A dressed figure of the given proportions; its vertices are so many times further apart, but for the feet's."""
    garments = [_head(body), _cap(body), _jacket(body), _trousers(body), *(_hand(body, side) for side in SIDES)]
    size = coarseness * body.stature / 1.78
    pieces = [
        surface(body, part, solid, low, high, spacing * size, bones)
        for part, solid, low, high, spacing, bones in garments
    ]
    return joined([*pieces, *(_foot(body, side) for side in SIDES)])


def joined(pieces: Sequence[Piece]) -> Figure:
    """Several closed pieces as one figure."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, *_ in pieces])
    return Figure(
        vertices=np.concatenate([vertices for vertices, *_ in pieces]),
        quads=np.concatenate([quads + offset for (_, quads, *_), offset in zip(pieces, offsets, strict=False)]),
        parts=np.concatenate([parts for _, _, parts, _ in pieces]),
        weights=np.concatenate([weights for *_, weights in pieces]),
    )


def surface(
    body: Skeleton, part: str, solid: Solid, low: Array, high: Array, spacing: float, bones: tuple[str, ...]
) -> Piece:
    """A closed piece from its solid, within a box, with vertices about `spacing` [m] apart, that follows some bones."""
    vertices, quads = mesh_of(solid, low, high, spacing)
    return vertices, quads, np.full(len(quads), PARTS.index(part)), _weights(body, vertices, bones)


def _weights(body: Skeleton, vertices: Array, bones: tuple[str, ...]) -> Array:
    """Shares by inverse distance to the given bones; a limb's bones do not reach across the middle of the body."""
    names = list(body.bones)
    closeness = np.zeros((len(vertices), len(names)))
    for name in bones:
        start, end = (body.joints[joint] for joint in body.bones[name][:2])
        axis = end - start
        along = np.clip((vertices - start) @ axis / (axis @ axis), 0.0, 1.0)
        distance = np.linalg.norm(vertices - start - along[:, None] * axis, axis=1)
        share = (distance + 0.01) ** -_FALLOFF
        side = SIDES.get(name[-1]) if name[-2:-1] == "." else None
        if side:
            share *= np.clip(0.5 + side * vertices[:, 1] / 0.05, 0.0, 1.0)
        closeness[:, names.index(name)] = share
    return closeness / closeness.sum(axis=1, keepdims=True)


def _head_size(body: Body) -> float:
    """Size of the head relative to the adult's; small people have comparatively large heads."""
    return float((body.stature / 1.78) ** 0.55)


def _limb_girth(body: Body) -> float:
    """Thickness of the limbs relative to the adult's: heavy people carry more of their mass on the trunk."""
    return body.girth**0.6


def _head(body: Body) -> tuple:
    s = _head_size(body)
    skull = body.joints["crown"] + s * np.array((0.0, 0.0, -0.115))
    neck, base = body.joints["head"], body.joints["neck"]
    parts = [
        ellipsoid(skull, s * np.array((0.097, 0.077, 0.110))),
        ellipsoid(skull + s * np.array((0.034, 0, -0.062)), s * np.array((0.058, 0.057, 0.066))),  # jaw
        round_cone(
            skull + s * np.array((0.062, 0, -0.112)), skull + s * np.array((0.066, 0, -0.106)), 0.024 * s, 0.021 * s
        ),
        round_cone(
            skull + s * np.array((0.092, 0, -0.020)), skull + s * np.array((0.107, 0, -0.048)), 0.009 * s, 0.013 * s
        ),
        round_cone(base + s * np.array((0.0, 0, -0.05)), neck + s * np.array((0.004, 0, 0.03)), 0.064 * s, 0.056 * s),
        *[
            ellipsoid(skull + s * np.array((-0.008, y * 0.078, -0.028)), s * np.array((0.020, 0.011, 0.033)))
            for y in SIDES.values()
        ],
    ]
    reach = s * np.array((0.16, 0.13, 0.15))
    low = skull - reach - (0, 0, skull[2] - base[2])
    return "skin", union(parts, 0.022 * s), low, skull + reach, 0.007, ("neck", "head")


def _cap(body: Body) -> tuple:
    s = _head_size(body)
    skull = body.joints["crown"] + s * np.array((0.0, 0.0, -0.115))
    dome = union(
        [
            ellipsoid(skull + s * np.array((-0.004, 0, 0.004)), s * np.array((0.108, 0.089, 0.122))),
            ellipsoid(skull + s * np.array((-0.022, 0, 0.055)), s * np.array((0.085, 0.078, 0.085))),
        ],
        0.03 * s,
    )
    plane = skull + s * np.array((0.0, 0, 0.018))
    dome = cut(dome, plane, (0.25, 0, -1), 0.012 * s)
    centre = plane + s * np.array((-0.004, 0, -0.002))
    band = cut(
        cut(
            ellipsoid(skull + s * np.array((-0.004, 0, 0.004)), s * np.array((0.114, 0.095, 0.128))),
            centre,
            (0.25, 0, -1),
            0.010 * s,
        ),
        centre + s * np.array((0, 0, 0.040)),
        (-0.25, 0, 1),
        0.010 * s,
    )
    reach = s * np.array((0.15, 0.13, 0.17))
    return "cap", union([dome, band], 0.004 * s), skull - reach, skull + reach, 0.007, ("head",)


def _jacket(body: Body) -> tuple:
    s, g, limb = body.stature / 1.78, body.girth, _limb_girth(body)
    belly = 0.16 * max(g - 1, 0.0) * s
    j = body.joints
    hem = j["hips"][2] - 0.055 * s
    parts = [
        ellipsoid(j["chest"] + s * np.array((0.012, 0, 0.075)), s * g * np.array((0.124, 0.172, 0.195))),
        ellipsoid(
            j["spine"] + s * np.array((0.012, 0, 0.02)) + (0.6 * belly, 0, 0),
            s * g * np.array((0.112, 0.148, 0.185)) + (0.8 * belly, 0.3 * belly, 0),
        ),
        ellipsoid(j["hips"] + s * np.array((0.0, 0, -0.01)), s * g * np.array((0.142, 0.186, 0.160))),
        round_cone(j["neck"] - (0, 0, 0.05 * s), j["neck"] + s * np.array((0.004, 0, 0.045)), 0.080 * s, 0.072 * s),
    ]
    for side in SIDES:
        shoulder, elbow, wrist = (j[f"{name}.{side}"] for name in ("shoulder", "elbow", "wrist"))
        cuff = elbow + 0.93 * (wrist - elbow)
        parts += [
            round_cone(j["neck"] - (0, 0, 0.03 * s), shoulder, 0.052 * s * limb, 0.056 * s * limb),
            round_cone(shoulder, elbow, 0.060 * s * limb, 0.050 * s * limb),
            cut(round_cone(elbow, wrist, 0.053 * s * limb, 0.042 * s * limb), cuff, wrist - elbow, 0.012 * s),
        ]
    solid = cut(union(parts, 0.05 * s), (0, 0, hem), (0, 0, -1), 0.02 * s)
    solid = cut(solid, j["neck"] + s * np.array((0.03, 0, 0.052)), (-0.35, 0, 1), 0.015 * s)
    wide = j["wrist.L"][1] + 0.08 * s * g
    low = np.array((-0.24 * s * g, -wide, min(hem, j["wrist.L"][2]) - 0.06 * s * g))
    bones = (
        "hips",
        "spine",
        "chest",
        "neck",
        *(f"{b}.{d}" for b in ("shoulder", "upper_arm", "forearm") for d in SIDES),
    )
    bones += tuple(f"thigh.{d}" for d in SIDES)
    return "jacket", solid, low, np.array((0.24 * s * g, wide, j["head"][2] + 0.05 * s * g)), 0.012, bones


def _trousers(body: Body) -> tuple:
    s, g, limb = body.stature / 1.78, body.girth, _limb_girth(body)
    j = body.joints
    parts = [ellipsoid(j["hips"] + s * np.array((-0.008, 0, 0.0)), s * g * np.array((0.114, 0.154, 0.130)))]
    for side in SIDES:
        hip, knee, ankle = (j[f"{name}.{side}"] for name in ("hip", "knee", "ankle"))
        inward = np.array((0, -SIDES[side] * 0.006 * s, 0))
        parts.append(
            union(
                [
                    round_cone(hip + inward, knee, 0.090 * s * limb, 0.064 * s * limb),
                    round_cone(knee, ankle, 0.063 * s * limb, 0.056 * s * limb),
                    ellipsoid(
                        knee + s * np.array((-0.022, 0, -0.12)), s * limb * np.array((0.050, 0.054, 0.13))
                    ),  # calf
                ],
                0.03 * s,
            )
        )
    hem = body.foot.ankle_height + 0.008 * s
    solid = cut(union(parts, 0.035 * s), (0, 0, hem), (0, 0, -1), 0.010 * s)
    wide = 0.25 * s * g
    low, high = (
        np.array((-0.2 * s * g, -wide, hem - 0.05 * s)),
        np.array((0.2 * s * g, wide, j["hips"][2] + 0.16 * s * g)),
    )
    return (
        "trousers",
        solid,
        low,
        high,
        0.012,
        ("hips", *(f"{bone}.{side}" for bone in ("thigh", "shin") for side in SIDES)),
    )


def _hand(body: Body, side: str) -> tuple:
    """A relaxed hand, palm toward the thigh: its frame has `along` the fingers, `ahead` toward the thumb."""
    s = body.stature / 1.78
    wrist, tips = body.joints[f"wrist.{side}"], body.joints[f"fingertips.{side}"]
    along = (tips - wrist) / np.linalg.norm(tips - wrist)
    ahead = np.array((1.0, 0.0, 0.0))
    palmar = np.cross(along, ahead) * SIDES[side]

    def at(a: float, b: float, c: float) -> Array:
        return wrist + s * (a * along + b * ahead + c * palmar)

    parts = [
        ellipsoid(at(0.055, 0.0, 0.0), s * np.array((0.055, 0.041, 0.017)), np.array((along, ahead, palmar))),
        round_cone(at(-0.03, 0, 0), at(0.03, 0, 0), 0.028 * s, 0.024 * s),
        round_cone(at(0.03, 0.025, 0.006), at(0.07, 0.050, 0.016), 0.015 * s, 0.011 * s),
        round_cone(at(0.07, 0.050, 0.016), at(0.098, 0.052, 0.022), 0.0115 * s, 0.009 * s),
    ]
    for row, (across, length) in enumerate(((0.030, 0.072), (0.0105, 0.080), (-0.0095, 0.075), (-0.029, 0.060))):
        root, bend = at(0.088, across, 0.0), 0.012 + 0.004 * row
        middle = at(0.088 + 0.55 * length, across * 1.02, bend)
        parts += [
            round_cone(root, middle, 0.0110 * s, 0.0098 * s),
            round_cone(middle, at(0.088 + 0.92 * length, across, 3.2 * bend), 0.0098 * s, 0.0080 * s),
        ]
    box = np.stack([at(a, b, c) for a in (-0.07, 0.2) for b in (-0.07, 0.09) for c in (-0.05, 0.09)])
    return (
        "skin",
        union(parts, 0.007 * s),
        box.min(axis=0),
        box.max(axis=0),
        0.0045,
        (f"forearm.{side}", f"hand.{side}"),
    )


def _foot(body: Body, side: str) -> Piece:
    if body.foot.bare:
        vertices, quads = _bare_foot(body.foot)
        parts = np.full(len(quads), PARTS.index("skin"))
    else:
        vertices, quads, sole = shoe_mesh(body.foot)
        parts = np.where(sole == 1, PARTS.index("sole"), PARTS.index("shoe"))
    names = list(BONES)
    bend = np.clip((vertices[:, 0] - body.foot.ball) / (0.06 * body.foot.length) + 0.5, 0.0, 1.0)
    weights = np.zeros((len(vertices), len(names)))
    weights[:, names.index(f"foot.{side}")], weights[:, names.index(f"toe.{side}")] = 1 - bend, bend
    if SIDES[side] > 0:  # a foot is built for the side whose inner edge is at +y: the right
        vertices, quads = vertices * (1, -1, 1), quads[:, ::-1]
    vertices = vertices + np.array((0, body.joints[f"ankle.{side}"][1], 0))
    return vertices, quads, parts, weights


_TOES = ((0.27, 0.80, 0.935, 0.047), (0.06, 0.80, 0.950, 0.031), (-0.12, 0.77, 0.915, 0.029))
_TOES += ((-0.28, 0.74, 0.865, 0.028), (-0.42, 0.70, 0.810, 0.027))
"""Across in widths of the foot; root, tip and radius in its lengths, from the heel."""


def _bare_foot(foot: Foot) -> tuple[Array, NDArray[np.intp]]:
    """Vertices and quads of a bare foot whose inner side faces +y, on heel, outer edge, ball and toes."""
    length, width = foot.length, foot.width

    def at(along: float, across: float, up: float) -> Array:
        return np.array((foot.back + along * length, across * width, up * length))

    def pad(along: float, across: float, long: float, wide: float, high: float) -> Solid:
        return ellipsoid(at(along, across, 0.9 * high), (long * length, wide * width, high * length))

    sole = [
        pad(0.125, 0.0, 0.125, 0.33, 0.10),
        round_cone(at(0.15, -0.12, 0.055), at(0.62, -0.27, 0.050), 0.062 * length, 0.056 * length),
        pad(0.69, 0.17, 0.115, 0.30, 0.060),
        pad(0.64, -0.25, 0.105, 0.26, 0.052),
        round_cone(at(0.20, 0.0, 0.17), at(0.66, 0.10, 0.105), 0.11 * length, 0.070 * length),
        round_cone(at(0.22, 0.0, 0.20), at(0.22, 0.0, 0.45), 0.13 * length, 0.13 * length),
    ]
    toes = [
        union(
            [
                round_cone(
                    at(root, 0.9 * across, 0.075), at(tip, across, 0.05), 0.85 * radius * length, 0.8 * radius * length
                ),
                pad(tip, across, 1.2 * radius, radius * length / width, radius),
            ],
            0.008,
        )
        for across, root, tip, radius in _TOES
    ]
    solid = cut(union([union(sole, 0.02), *toes], 0.006), (0, 0, 0), (0, 0, -1.0), 0.003)
    low, high = at(-0.03, -0.65, -0.03), at(1.05, 0.65, 0.62)
    return mesh_of(solid, low, high, 0.0028 * length / 0.26)
