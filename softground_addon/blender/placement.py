"""Where objects are in the frame of a bake, in double precision as far as Blender's own values go: its matrices round
far from the origin."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.motion.ground_frame import ALIGNED, GroundFrame, in_world
from ..core.numerics.arrays import Array
from ..core.rig.recording import SceneUnits
from ..core.settings import DOWN
from . import settings

Direction = tuple[float, float, float]

FAR = 1000.0
"""Farthest from the origin that a shot is solved in the world's frame [m]: single precision rounds to 0.06 mm there."""
UP = (0.0, 0.0, 1.0)
LEANING = 0.25
"""Least height of the middle of a standing body's bones above its origin, over the distance between the two."""
TINY = 1e-9


def world_matrix(obj: bpy.types.Object) -> Array:
    """Object space to the world, (4, 4) [Blender units]; rounded where constraints, physics or bones have a say."""
    parent, body = obj.parent, obj.rigid_body
    if any(not constraint.mute for constraint in obj.constraints) or (body and body.type == "ACTIVE"):
        return np.array(obj.matrix_world, dtype=np.float64)
    basis = np.array(obj.matrix_basis, dtype=np.float64)
    if parent is None:
        return basis
    if obj.parent_type != "OBJECT" or (parent.type == "CURVE" and getattr(parent.data, "use_path", False)):
        return np.array(obj.matrix_world, dtype=np.float64)
    return np.asarray(world_matrix(parent) @ np.array(obj.matrix_parent_inverse) @ basis)


def beside(obj: bpy.types.Object, other: bpy.types.Object) -> Array:
    """Space of an object to that of another one, (4, 4), also where Blender's own matrices round.

    Of an object below the other it does not depend on where they are.
    """
    within, node = np.eye(4), obj
    while node.parent and node.parent_type in ("OBJECT", "ARMATURE") and not (node.constraints or node.rigid_body):
        within, node = np.array(node.matrix_parent_inverse) @ np.array(node.matrix_basis) @ within, node.parent
        if node == other:
            return np.asarray(within)
        if node.type == "CURVE":  # along which it may go
            break
    place = world_matrix(other)
    if np.abs(place[:3, 3]).max() <= FAR:
        return np.array(other.matrix_world.inverted_safe() @ obj.matrix_world)
    return np.asarray(np.linalg.pinv(place) @ world_matrix(obj))


def still_frame(place: Array, units: SceneUnits, direction: Direction) -> GroundFrame | None:
    """The frame of what stands still at a place (4, 4) in the world [Blender units], where gravity has a direction;
    None where the world's own would do."""
    up = -np.array(direction)
    if np.abs(place[:3, 3]).max() * units.unit_scale_m <= FAR and np.linalg.norm(up - UP) <= ALIGNED:
        return None
    return GroundFrame.still(place, up)


def felt_gravity(direction: Direction, bodies: Iterable[bpy.types.Object]) -> Direction:
    """Where gravity points for some bodies: as the scene's does, unless they all stand upright in another one."""
    rigs = [(body, body.data.bones) for body in bodies if isinstance(body.data, bpy.types.Armature) and body.data.bones]
    if direction == DOWN or not rigs:
        return direction
    return direction if any(_above_origin(rig, bones) @ direction < -LEANING for rig, bones in rigs) else DOWN


def _above_origin(rig: bpy.types.Object, bones: bpy.types.ArmatureBones) -> Array:
    """Unit vector in the world from the origin of a rig to the middle of its bones at rest."""
    heads = np.empty(len(bones) * 3)
    bones.foreach_get("head_local", heads)
    toward = world_matrix(rig)[:3, :3] @ heads.reshape(-1, 3).mean(axis=0)
    return np.asarray(toward / max(float(np.linalg.norm(toward)), TINY))


def units_about(scene: bpy.types.Scene, obj: bpy.types.Object, bodies: Iterable[bpy.types.Object] = ()) -> SceneUnits:
    """Frames and lengths of a scene, and the frame in which an object is read by itself, or with bodies on it."""
    place, units = np.eye(4), settings.units_of(scene)
    place[:3, 3] = world_matrix(obj)[:3, 3]
    return replace(
        units, frame=still_frame(place, units, felt_gravity(settings.gravity_direction_of(scene), [obj, *bodies]))
    )


def matrix_in(frame: GroundFrame, obj: bpy.types.Object) -> Array:
    """Space of the ground, or of another object, to the frame of a bake, (4, 4) [Blender units]."""
    if frame.moves:
        return np.array(frame.riding.get(obj.name_full, frame.matrix))
    return np.asarray(np.array(frame.matrix) @ world_matrix(obj))


def in_scene(
    points: Array, scene: bpy.types.Scene, frame: GroundFrame | None, ground: bpy.types.Object | None = None
) -> Array:
    """Points (..., 3) of a bake [m] where they are in its scene [Blender units]; on the first ground, or another."""
    units: Array = points / scene.unit_settings.scale_length
    if frame is None:
        return units
    matrix = np.array(to_world(frame, ground or scene.softground.ground))
    return np.asarray(units @ matrix[:3, :3].T + matrix[:3, 3])


def from_scene(points: Array, scene: bpy.types.Scene, frame: GroundFrame | None) -> Array:
    """Points (..., 3) in a scene [Blender units] as a bake has them [m]."""
    if frame is not None:
        matrix = np.linalg.inv(np.array(to_world(frame, scene.softground.ground)))
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
    return np.asarray(points * scene.unit_settings.scale_length)


def to_world(frame: GroundFrame | None, ground: bpy.types.Object | None) -> Matrix:
    """The frame of a bake to the world, as its ground lies now [Blender units]."""
    if frame is None:
        return Matrix()
    inverse = Matrix(np.linalg.inv(np.array(frame.matrix)).tolist())
    return ground.matrix_world @ inverse if frame.moves and ground else inverse


def events_in_world(
    table: Sequence[Mapping[str, Any]], frame: GroundFrame | None, ground: bpy.types.Object | None, unit_scale: float
) -> list[dict[str, Any]]:
    """Rows about a bake, with their places in the world as its ground lies now."""
    if frame is None:
        return [dict(row) for row in table]
    in_metres = np.array(to_world(frame, ground), dtype=np.float64)
    in_metres[:3, 3] *= unit_scale
    return in_world(table, in_metres)


def hang_on(obj: bpy.types.Object, ground: bpy.types.Object, frame: GroundFrame | None) -> None:
    """Parent an object whose own place is in the frame of a bake to the ground of that."""
    obj.parent = ground
    if frame is None:
        obj.matrix_parent_inverse = ground.matrix_world.inverted()
    else:
        obj.matrix_parent_inverse = Matrix(np.linalg.inv(matrix_in(frame, ground)).tolist())
