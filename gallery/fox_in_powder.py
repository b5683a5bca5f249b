"""A fox trots over powder in the morning: each hind paw lands in the print of a forepaw."""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import ArrayLike

from gallery import firs, fur, open_air
from sample_scenes import production, stage
from sample_scenes.course import Course
from sample_scenes.dog import Dog
from sample_scenes.four_legged import TROT, go_on_four_legs
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array

CELL_SIZE = 0.002
"""Fine enough for toes [m]."""

PRESET = "Fresh Snow (field)"
POWDER = {
    "material.youngs_modulus": "850000",
    "material.blur_sigma": "0.002",
    "tread": "0",
    "debris": "false",
    "relief": "OFF",
}
"""A fox sinks in no deeper than its paws are high, so that toes and pads are to be seen; they are of its mesh."""

BODY = Dog(withers=0.38, mass=7.0, brush=1.7, tail=1.6, ears=1.55, snout=0.7, paws=1.2, toes_apart=True)
HAIRS, THICKNESS = 60000, 0.0011
"""Hairs of its fur, and their thickness [m]: finer than a pixel."""
TAIL, EARS = -0.70, 1.30
"""Where the tail begins, ahead of the middle, and the ears, above the ground, over the height at the withers."""
GAIT = replace(TROT, speed=1.68, step_width=0.05, lift=0.24, crouch=0.02, neck=46.0)
"""At this speed half a stride is as long as the trunk, so that hind paws land where the forepaws were."""
FRAMES = 93
START = 2.3  # m along y; the fox goes toward -y
PICTURE = (1920, 1080)
NEAR_FIRS = np.array([(17, -21, 8), (13.5, -33, 9), (21, -38, 12), (-15, -19, 7), (-24, -36, 11), (-13, -44, 9)])
NEAR_FIRS = np.concatenate([NEAR_FIRS, [(3.9, -6.0, 0.8), (4.5, -6.8, 1.3), (-1.9, -12.0, 1.1)]])
"""Places and heights of those that stand before the forest's edge [m]."""
AIR = (0.56, 0.50, 0.51), 140.0
"""Colour of the haze, and how far one sees in it [m]."""
_SKY = (radians(10.0), 2.2)

_WAVES = np.random.default_rng(154)
_DRIFTS = list(zip(np.geomspace(0.8, 3.2, 7), _WAVES.normal(0.0, 0.5, 7), _WAVES.uniform(0.0, 7.0, 7), strict=True))
"""Lengths [m], directions and phases of waves in the snow."""


def _height(x: Array, y: Array) -> Array:
    """Hills far off, and drifts across the light [m]."""
    waves = [
        0.009 * length * np.sin((x * np.cos(way) + y * np.sin(way)) * 2 * pi / length + phase)
        for length, way, phase in _DRIFTS
    ]
    return open_air.rolling(swell=0.12, hills=22.0, seed=6)(x, y) + sum(waves)


WAY = Course(
    ((0.0, 0.0), (1.3, 0.05), (2.4, 0.35), (3.2, 0.52), (3.9, 0.28), (4.35, -0.4), (4.6, -1.4), (4.75, -3.0)),
    lambda ahead, left: _height(left, START - ahead),
)
"""Away from the camera, and then across the picture [m]."""


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Built:
    """A snow field, and a fox that trots away from the camera and then across its view."""
    ground = open_air.add_ground(scene, "Powder", (-14.0, START + 3.0), _height, "snow")
    open_air.add_camera(
        scene, (-0.03, 1.56, 0.30), (-0.31, -0.44, -0.24), 26.0, (0.05, 0.72, 0.0), 32.0, picture=PICTURE
    )
    motion = go_on_four_legs(BODY, GAIT, FRAMES, scene.render.fps, course=WAY)
    chosen = POWDER | dict(options or {})
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen, motion, BODY)


def claims(built: Built) -> list[Claim]:
    """Prints as deep as paws are high, hind paws in those of forepaws."""
    steps = built.bakes[PRESET].footprints
    hind = np.array([step.position[:2] for step in steps if step.sole.startswith("foot")])
    fore = np.array([step.position[:2] for step in steps if step.sole.startswith("hand")])
    apart = np.linalg.norm(hind[:, None] - fore, axis=-1).min(axis=1)
    return [
        Claim("Steps in the snow", len(steps), 30, 60),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.03, 0.15),
        Claim("From a hind paw to the next print of a forepaw [m]", float(np.median(apart)), 0.0, 0.005),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From just above the snow, with the sun low at the left."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    open_air.add_low_sun(scene, radians(170), radians(9.5), (1.0, 0.80, 0.60), 12.5, 0.10, _SKY)
    chance = np.random.default_rng(4)
    away, aside = chance.uniform(55.0, 170.0, 260), chance.normal(0.0, 0.75, 260)
    firs.add_firs(
        np.column_stack([away * aside, -away]), chance.uniform(5.0, 13.0, 260), _height, firs.WINTRY, snow=0.6
    )
    firs.add_firs(NEAR_FIRS[:, :2], NEAR_FIRS[:, 2], _height, firs.WINTRY, seed=9, snow=0.6)
    open_air.add_haze(scene.world, *AIR)
    wear_fur()
    scene.view_settings.exposure = 0.35
    path = folder / "fox_in_powder.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def wear_fur() -> None:
    """Give the fox of the scene its coat."""
    figure = next(child for child in bpy.data.objects["Animal"].children if child.type == "MESH")
    coat = next(number for number, slot in enumerate(figure.material_slots) if "coat" in slot.material.name.lower())
    fur.add_fur(figure, HAIRS, lie, coat_of, THICKNESS, coat)


def lie(place: Array, normal: Array, chance: np.random.Generator) -> Array:
    """Hairs from root to tip [m]: short on face and legs, long on cheeks, belly and tail; they point backward."""
    ahead, _, up = _in_body(place)
    flow = np.tile((0.0, 1.0, -0.30), (len(place), 1))
    flow[(up < 0.55) & (ahead > TAIL)] = (0.0, 0.35, -1.0)
    flow[ahead < TAIL] = (0.0, 0.41, -0.36)
    flow[up > EARS] = (0.0, 0.2, 1.0)
    flow += chance.normal(0.0, 0.16, flow.shape)
    flow -= (flow * normal).sum(axis=1, keepdims=True) * normal
    flow /= np.linalg.norm(flow, axis=1, keepdims=True)
    cheek = np.exp(-(((ahead - 0.56) / 0.10) ** 2) - ((up - 1.10) / 0.10) ** 2)
    length = 0.018 + 0.016 * np.maximum(cheek, _rise(0.10, 0.35, ahead)) + 0.012 * _rise(0.66, 0.56, up)
    length = np.where(up < 0.5, 0.006 + 0.012 * _rise(0.36, 0.5, up), length)
    length = np.where(ahead > 0.70, 0.004, np.where(up > EARS, 0.007, length))
    bush = _rise(TAIL, TAIL - 0.2, ahead) * _rise(-1.42, -1.15, ahead)
    length = np.where(ahead < TAIL, 0.018 + 0.026 * bush, length)
    stands = np.where(ahead < TAIL, 0.55, 0.38)[:, None]
    return (length * chance.uniform(0.6, 1.15, len(place)))[:, None] * (flow + stands * normal)


def coat_of(place: Array, normal: Array, chance: np.random.Generator) -> Array:
    """Red above, white below and at the tip of the tail, black on legs and behind the ears."""
    ahead, _, up = _in_body(place)
    blurred = chance.normal(0.0, 0.02, (3, len(place)))
    red = _between((0.33, 0.085, 0.016), (0.62, 0.24, 0.060), chance.random(len(place)))
    colour = _mix(red, (0.20, 0.07, 0.025), 0.6 * _rise(0.25, 0.9, normal[:, 2]) * (ahead < 0.4))
    below = _rise(-0.15, -0.55, normal[:, 2] + 5.0 * blurred[0]) * (ahead > TAIL)
    throat = _rise(0.10, 0.6, -normal[:, 1] - normal[:, 2]) * (ahead > 0.38) * (ahead < 0.60) * (up < 1.05)
    colour = _mix(colour, (0.72, 0.66, 0.58), np.maximum(below, throat))
    colour = _mix(colour, (0.020, 0.016, 0.014), _rise(0.50, 0.38, up + blurred[1]) * (ahead > TAIL))
    colour = _mix(colour, (0.025, 0.020, 0.018), (up > EARS + 0.02 + blurred[2]) * (normal[:, 1] > -0.3))
    return _mix(colour, (0.80, 0.77, 0.72), _rise(-1.12, -1.20, ahead + blurred[2]))


def _in_body(place: Array) -> Array:
    """Ahead, to the left and up, over the height at the withers, (3, N)."""
    return np.stack([-place[:, 1], place[:, 0], place[:, 2]]) / BODY.withers


def _rise(low: float, high: float, value: Array) -> Array:
    """From 0 at `low` to 1 at `high`, smoothly."""
    part = np.clip((value - low) / (high - low), 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


def _between(low: ArrayLike, high: ArrayLike, part: Array) -> Array:
    return np.asarray(low) + part[:, None] * (np.asarray(high) - np.asarray(low))


def _mix(colour: Array, other: ArrayLike, part: Array) -> Array:
    return colour + part[:, None] * (np.asarray(other) - colour)


if __name__ == "__main__":
    production.main(__name__)
