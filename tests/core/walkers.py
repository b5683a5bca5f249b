"""Soles, walks and loads in closed form, for the tests of the ground."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.loads.contacts import Contacts
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.loads.forces import ContactForces
from softground_addon.core.motion.motion import CharacterMotion, steps_per_frame
from softground_addon.core.motion.sole_motion import Sole, SoleMotion, SolePatch
from softground_addon.core.pressing.deformation import target_compression

MASS = 77.5
GRAVITY = 9.81
FOOT_LENGTH = 0.27
BALL = 0.19
"""Where the toes bend, from the heel [m]."""


def patch_of(distance, heights, low, high, spacing=0.005):
    """A patch from functions of (x, y) for the signed distance and the height, over a box with a margin."""
    margin = 12 * spacing
    x, y = np.meshgrid(*(np.arange(low[k] - margin, high[k] + margin, spacing) for k in (0, 1)))
    return SolePatch(heights(x, y), distance(x, y), np.array([x[0, 0], y[0, 0]]), spacing)


def box_distance(x, y, low, high):
    dx, dy = np.maximum(low[0] - x, x - high[0]), np.maximum(low[1] - y, y - high[1])
    return np.hypot(np.maximum(dx, 0), np.maximum(dy, 0)) + np.minimum(np.maximum(dx, dy), 0)


def box_sole(length, width, name="box", spacing=0.005):
    """A flat rectangle centred on its origin."""
    high = np.array([length, width]) / 2
    patch = patch_of(lambda x, y: box_distance(x, y, -high, high), lambda x, y: 0 * (x + y), -high, high, spacing)
    outline = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * high
    return Sole(name, "", (patch,), np.zeros((1, 3)), np.zeros(1, int), outline)


def sphere_sole(radius, name="sphere"):
    """The lower half of a sphere, its lowest point at the origin."""
    reach = np.array([radius, radius])
    patch = patch_of(
        lambda x, y: np.hypot(x, y) - radius,
        lambda x, y: radius - np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0.0)),
        -reach,
        reach,
        spacing=radius / 50,
    )
    angle = np.arange(48) / 48 * 2 * np.pi
    return Sole(
        name, "", (patch,), np.zeros((1, 3)), np.zeros(1, int), radius * np.stack([np.cos(angle), np.sin(angle)], -1)
    )


def foot_sole(name, side):
    """A foot of 0.27 m in two pieces that overlap by 1 cm at the ball; rounded at both ends, with an arch."""

    def half_width(x):
        return np.interp(
            x / FOOT_LENGTH, [0, 0.05, 0.2, 0.45, 0.7, 0.9, 1], [0.02, 0.03, 0.033, 0.03, 0.046, 0.04, 0.015]
        )

    def distance(start, end):
        return lambda x, y: np.maximum(np.abs(y) - half_width(x), np.maximum(start - x, x - end))

    def heights(x, y):
        arch = 0.008 * np.exp(-(((x - 0.11) / 0.035) ** 2)) * np.clip(0.5 + y / 0.04 * (1 if side == "R" else -1), 0, 1)
        return arch + 0.5 * np.maximum(0.02 - x, 0.0) ** 2 / 0.04

    patches = tuple(
        patch_of(distance(start, end), heights, (start, -0.05), (end, 0.05))
        for start, end in ((0.0, BALL + 0.005), (BALL - 0.005, FOOT_LENGTH))
    )
    x = np.linspace(0, FOOT_LENGTH, 50)
    outline = np.concatenate([np.stack([x, -half_width(x)], -1), np.stack([x, half_width(x)], -1)[::-1]])
    return Sole(
        name, side, patches, np.array([[0, 0, 0], [BALL, 0, 0], [FOOT_LENGTH, 0, 0]]), np.array([0, 0, 1]), outline
    )


def pose(position, heading=0.0, pitch=0.0):
    """Transforms (..., 4, 4) of something at a position, headed counter-clockwise from x, toes up by the pitch."""
    position, heading, pitch = np.asarray(position, float), np.asarray(heading, float), np.asarray(pitch, float)
    shape = np.broadcast_shapes(position.shape[:-1], heading.shape, pitch.shape)
    result = np.zeros((*shape, 4, 4))
    ch, sh, cp, sp = np.cos(heading), np.sin(heading), np.cos(pitch), np.sin(pitch)
    result[..., 0, 0], result[..., 0, 1], result[..., 0, 2] = ch * cp, -sh, -ch * sp
    result[..., 1, 0], result[..., 1, 1], result[..., 1, 2] = sh * cp, ch, -sh * sp
    result[..., 2, 0], result[..., 2, 2] = sp, cp
    result[..., :3, 3], result[..., 3, 3] = position, 1
    return result


def loads_of(
    soles, transforms, normal_force, touching, frame_rate, *, name="walker", first_frame=1.0, normal=(0, 0, 1)
):
    """Loads of soles that follow given poses (N, P, 4, 4) under given vertical forces (N, S), one step per sample."""
    count = len(touching)
    per_frame = steps_per_frame(frame_rate)
    motion = CharacterMotion(
        name,
        MASS,
        0.9,
        first_frame + np.arange(count) / per_frame,
        frame_rate,
        tuple(SoleMotion(sole, poses) for sole, poses in zip(soles, transforms, strict=True)),
        gravity=GRAVITY,
    )
    forces = np.zeros((count, len(soles), 3))
    forces[..., 2] = normal_force
    normals = np.broadcast_to(np.asarray(normal, float), forces.shape)
    zero = np.zeros((count, len(soles)))
    return CharacterLoads(
        motion,
        Contacts(touching, np.zeros(len(soles)), normals, zero),
        ContactForces(forces, forces.sum(axis=1), np.zeros_like(forces), zero, zero),
    )


def standing(sole, places, force, *, seconds=1.0, frame_rate=30.0, heading=0.0, **options):
    """Soles that stand at places (S, 3), each under the same constant force [N]."""
    count = round(seconds * frame_rate) * steps_per_frame(frame_rate) + 1
    transforms = [np.tile(pose(place, heading), (count, len(sole.patches), 1, 1)) for place in np.atleast_2d(places)]
    force = np.full((count, len(transforms)), float(force))
    return loads_of([sole] * len(transforms), transforms, force, np.ones(force.shape, bool), frame_rate, **options)


def walk(
    *, steps=6, frame_rate=30.0, heading=0.0, origin=(0.0, 0.0, 0.0), speed=1.3, period=1.1, name="walker", soles=None
):
    """A walk in closed form: heel strike toes up, roll over the flat foot, push off over the toes.

    Defined over continuous time, so that every frame rate samples the same motion.
    """
    soles = soles or (foot_sole("foot.L", "L"), foot_sole("foot.R", "R"))
    per_frame = steps_per_frame(frame_rate)
    duration = np.ceil(period / 2 * (steps + 2) * 6) / 6  # a whole number of frames at every usual rate
    time = np.arange(round(duration * frame_rate) * per_frame + 1) / (per_frame * frame_rate)
    stance = 0.62 * period
    stride = speed * period
    transforms, forces, touching = [], [], []
    for number, side in enumerate((1, -1)):
        phase = time - period / 2 * number - 0.1
        cycle = np.floor(phase / period)
        u = (phase - cycle * period) / stance  # 0 to 1 in stance, beyond it in swing
        swing = np.clip((u - 1) * stance / (period - stance), 0, 1)
        smooth = swing**2 * (3 - 2 * swing)
        heel_x = (cycle + smooth) * stride + number * stride / 2
        heel_up = np.interp(u, [0, 0.15, 0.6, 1.0], np.radians([20, 0, 0, -35]))
        heel_up = np.where(u > 1, np.radians(-35) + np.radians(55) * smooth, heel_up)
        toes_up = np.where(heel_up < 0, 0.6 * heel_up * (u <= 1) + heel_up * (u > 1), heel_up)
        lift = 0.08 * np.sin(np.pi * swing)
        # Toes down, the foot pivots about the ball; toes up, about the heel.
        ball = np.maximum(-heel_up, 0)
        foot = np.stack([heel_x + BALL * (1 - np.cos(ball)), 0 * time + side * 0.09, BALL * np.sin(ball) + lift], -1)
        toe_pitch = np.where(heel_up < 0, heel_up - toes_up, heel_up)
        hinge = foot + BALL * np.stack([np.cos(heel_up), 0 * time, np.sin(heel_up)], -1)
        toes = hinge - BALL * np.stack([np.cos(toe_pitch), 0 * time, np.sin(toe_pitch)], -1)
        world = pose(origin, heading)
        transforms.append(np.stack([world @ pose(foot, 0.0, heel_up), world @ pose(toes, 0.0, toe_pitch)], 1))
        loaded = (u < 1) & (cycle >= 0) & (2 * cycle + number <= steps - 1)
        bumps = np.sin(np.pi * np.clip(u, 0, 1)) + 0.25 * np.sin(3 * np.pi * np.clip(u, 0, 1))
        forces.append(np.where(loaded, 1.05 * MASS * GRAVITY * bumps, 0.0))
        touching.append(loaded)
    return loads_of(
        soles, transforms, np.stack(forces, 1), np.stack(touching, 1), frame_rate, name=name, first_frame=1.0
    )


def pressed(loads, material, cell_size=0.01, terrain=None):
    """The ground at the end and the record of a whole simulation."""
    loads = loads if isinstance(loads, list) else [loads]
    footprints = []
    for result in simulate(loads, SoftGround(terrain or FlatTerrain(), material), cell_size):
        footprints += result.footprints
    return result.ground, footprints


def through_scene_frames(loads):
    """The same loads with poses known at scene frames only, as when a rig is sampled."""
    per_frame = steps_per_frame(loads.motion.frame_rate)
    coarse = replace(
        loads.motion,
        frames=loads.motion.frames[::per_frame],
        soles=tuple(replace(sole, transforms=sole.transforms[::per_frame]) for sole in loads.motion.soles),
    )
    return replace(loads, motion=coarse.resampled(per_frame))


def memory_of(field):
    """Memory of the cells' values of a height field [bytes]."""
    return sum(tile.nbytes for tile in field.tiles.values())


def equilibrium_depth(force: float, area: float, material: GroundMaterial) -> float:
    """Depth at which the ground carries a lasting force on an area [m], in closed form.

    For a standing character: the weight and the area of all its soles.
    """
    return float(target_compression(force / area, material))
