"""Snowshoes: plates hinged at the toes, which print in place of the shoes."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from sample_scenes.body import SIDES, Array, Body
from sample_scenes.character import TO_BLENDER
from sample_scenes.curves import monotone_cubic
from sample_scenes.gait import Gait
from sample_scenes.stage import plain_material

SNOWSHOE_LENGTH, SNOWSHOE_WIDTH = 0.64, 0.21
"""Of a pair for an adult [m]."""

ON_SNOWSHOES = Gait(
    speed=0.95,
    step_width=0.25,
    toe_out=2.0,
    strike_pitch=0.0,
    leave_pitch=-42.0,
    clearance=0.12,
    touch_down_forward=0.25,
    touch_down=0.25,
    held_toes=True,
    sway=0.035,
    arm_swing=24.0,
)
"""A walk with the toes held level by a binding: flat landings, feet apart, high steps."""

_THICKNESS = 0.012  # m of the deck
_TIP = 0.05  # m by which the tip is turned up
_STATIONS = np.array((0.0, 0.02, 0.08, 0.20, 0.40, 0.62, 0.80, 0.92, 0.98, 1.0))
_HALF_WIDTHS = np.array((0.0, 0.16, 0.30, 0.40, 0.46, 0.50, 0.46, 0.32, 0.15, 0.0))  # of the width
_AHEAD = 0.36  # part of the length that is ahead of the ball of the foot


def put_on_snowshoes(
    armature: bpy.types.Object,
    body: Body,
    collection: bpy.types.Collection,
    length: float = SNOWSHOE_LENGTH,
    width: float = SNOWSHOE_WIDTH,
) -> dict[str, bpy.types.Object]:
    """A snowshoe under each foot, child of the toe bone; by side. The character is raised by their thickness.

    Parameters
    ----------
    armature : bpy.types.Object
        From `create_character`; walks best with `ON_SNOWSHOES`.
    body : Body
    collection : bpy.types.Collection
    length, width : float
        [m]
    """
    shoes = {}
    for side in SIDES:
        vertices, faces = snowshoe_mesh(length, width)
        mesh = bpy.data.meshes.new(f"{armature.name} Snowshoe.{side}")
        mesh.from_pydata((vertices @ TO_BLENDER.T).tolist(), [], faces.tolist())
        mesh.materials.append(plain_material("SoftGround Sample snowshoe", (0.42, 0.12, 0.03), 0.5))
        shoe = bpy.data.objects.new(mesh.name, mesh)
        collection.objects.link(shoe)
        place = TO_BLENDER @ (body.joints[f"ball.{side}"] * (1, 1, 0))
        rest = armature.data.bones[f"toe.{side}"]
        shoe.parent, shoe.parent_type, shoe.parent_bone = armature, "BONE", rest.name
        at_tail = rest.matrix_local.copy()
        at_tail.translation = rest.tail_local
        local = shoe.matrix_basis.copy()
        local.translation = place.tolist()
        shoe.matrix_parent_inverse = at_tail.inverted()
        shoe.matrix_basis = local
        shoes[side] = shoe
    armature.location.z += _THICKNESS
    return shoes


def snowshoe_mesh(length: float, width: float) -> tuple[Array, NDArray[np.intp]]:
    """A closed plate with an upturned tip, x forward from below the ball of the foot; its top is at z = 0."""
    along, across = 48, 13
    u = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.01, 0.99, along))
    half = width * monotone_cubic(np.sqrt(u), np.sqrt(_STATIONS), _HALF_WIDTHS)
    x = length * (u - 1 + _AHEAD)
    lift = _TIP * np.clip((u - 0.84) / 0.16, 0.0, 1.0) ** 2
    side = np.linspace(-1.0, 1.0, across)
    y = half[:, None] * side
    layers = [
        np.stack([np.broadcast_to(x[:, None], y.shape), y, np.broadcast_to((lift + z)[:, None], y.shape)], axis=-1)
        for z in (-_THICKNESS, 0.0)
    ]
    bottom, top = layers
    vertices = np.concatenate([bottom.reshape(-1, 3), top.reshape(-1, 3)])
    index = np.arange(along * across).reshape(along, across)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    above = np.stack([a, b, c, d], axis=-1).reshape(-1, 4) + along * across
    below = np.stack([a, d, c, b], axis=-1).reshape(-1, 4)
    rim = np.concatenate([index[:, 0], index[-1, 1:], index[-2::-1, -1], index[0, -2:0:-1]])
    following = np.roll(rim, -1)
    wall = np.stack([rim, following, following + along * across, rim + along * across], axis=-1)
    return vertices, np.concatenate([above, below, wall])
