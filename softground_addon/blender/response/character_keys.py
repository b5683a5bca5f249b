"""A response as keys: a layer above the user's animation, never in it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.legs.grounding import Response
from ...core.motion.motion import CharacterMotion
from ...core.motion.people import leg_sides
from ...core.numerics.arrays import Array
from ...core.numerics.key_reduction import kept_samples
from ...core.numerics.orientation import quaternions
from ...core.numerics.rigid import carried
from ...core.rig.mapping import RigMapping
from ...core.settings import CharacterSettings, ObjectName
from ..animation_layer.layer_curves import LayerCurve, path_of_bone
from ..rigs.object_data import armature_of
from ..rigs.rest_pose import legs_of_feet, legs_on_shins
from ..sampling.rig_checks import check_bones
from ..sampling.rig_sampling import RigPoses
from ..settings import resolve
from .rig_controls import BODY, Control, find_controls

ANGLE_TOLERANCE = np.radians(0.04)
"""Largest error of angles between keys [rad]: a leg has four joints whose errors add."""
LENGTH_TOLERANCE = 2e-4
"""The same for places [m]."""


_LEG = ("hip", "knee", "ankle")


@dataclass(frozen=True)
class ReadRig:
    """A rig as it was read: the bones that a response is keyed on, and their poses by the user's animation alone.

    Attributes
    ----------
    legs : dict of str to (F, 3) float array
        Joints of legs that nothing else knows: loads go without them [m].
    """

    name: str
    controls: list[Control]
    poses: RigPoses
    legs: dict[str, Array]


def mapping_with_legs(character: CharacterSettings) -> RigMapping:
    """The mapping of a character with further legs: those of feet that hang elsewhere, arms that stand on the ground
    and, where there is no leg at all, those whose shins are their feet."""
    mapping, joints = RigMapping(character.joints, character.soles, "settings"), dict(character.joints)
    assert character.armature
    armature, known = resolve(character.armature), leg_sides(joints)
    stands = {bone: _with_parents(armature, bone) for sole in mapping.soles if (bone := sole.bone)}
    ankles = {joints[f"ankle_{side}"][0] for side in known if f"ankle_{side}" in joints}
    others = [bone for bone, chain in stands.items() if ankles.isdisjoint(chain)]
    legs = legs_of_feet(armature, others) or ({} if known else legs_on_shins(armature, others))
    arms = [[f"{joint}_{side}" for joint in ("shoulder", "elbow", "wrist")] for side in "lr"]
    feet = {bone for sole in mapping.soles if not sole.limb for bone in stands.get(sole.bone, ())}
    if not legs and all({*arm} <= joints.keys() and joints[arm[2]][0] in feet for arm in arms):
        legs = {f"{leg}_{arm[0][-1]}": joints[of] for arm in arms for leg, of in zip(_LEG, arm, strict=True)}
    further = "2" if known else ""
    return replace(mapping, joints={**joints, **{f"{joint}{further}": bone for joint, bone in legs.items()}})


def _with_parents(armature: bpy.types.Object, bone: str) -> set[str]:
    at_rest = armature_of(armature).bones.get(bone)
    return {bone, *(parent.name for parent in at_rest.parent_recursive)} if at_rest else {bone}


def response_curves(
    armature: ObjectName,
    rig: ReadRig,
    motion: CharacterMotion,
    response: Response,
    *,
    metre: float,
    stretch: float,
    accuracy: float = 1.0,
) -> Generator[int, None, list[LayerCurve]]:
    """The keys that make a rig respond.

    Parameters
    ----------
    motion : CharacterMotion
        The source that the response belongs to.
    metre : float
        Blender unit [m].
    stretch : float
        Frames of the animation per frame of the scene.
    accuracy : float
        Part of `ANGLE_TOLERANCE` and `LENGTH_TOLERANCE` that keys may be off by.

    Yields
    ------
    int
        Number of bones done.
    """
    moved = _parts_in_armature(response, motion, rig.poses, metre)
    curves: list[LayerCurve] = []
    for done, control in enumerate(rig.controls):
        if control.part in moved and (not control.carried_by or control.carried_by in moved):
            curves += _bone_curves(
                resolve(armature), control, rig.poses, moved, motion.frames * stretch, metre, accuracy
            )
        yield done + 1
    return curves


def controls_of(view_layer: bpy.types.ViewLayer, armature: bpy.types.Object, mapping: RigMapping) -> list[Control]:
    """The bones of a rig that a response is keyed on.

    Raises
    ------
    InputError
        If it has no bone that carries the body, or bones of the mapping are gone.
    """
    check_bones(armature, mapping)
    depsgraph = view_layer.depsgraph
    assert depsgraph is not None
    return find_controls(armature, armature.evaluated_get(depsgraph), mapping)


def _parts_in_armature(response: Response, motion: CharacterMotion, poses: RigPoses, metre: float) -> dict[str, Array]:
    """Displacement of each part in the armature's frame [Blender units], (F, 4, 4)."""
    parts = {BODY: response.body}
    for side, leg in response.legs.items():
        knee = motion.joints[f"knee_{side}"]
        parts |= {
            f"thigh_{side}": leg.thigh,
            f"shank_{side}": leg.shank,
            f"foot_{side}": leg.foot,
            f"knee_{side}": _translation_at(leg.thigh, knee),
        }
    parts |= {f"arm_{side}": response.body @ arm for side, arm in response.arms.items()}
    to_world = poses.world
    from_world = np.linalg.inv(to_world)
    result = {}
    for part, displacement in parts.items():
        units = displacement.copy()
        units[:, :3, 3] /= metre
        result[part] = from_world @ units @ to_world
    return result


def _bone_curves(
    armature: bpy.types.Object,
    control: Control,
    poses: RigPoses,
    moved: dict[str, Array],
    frames: Array,
    metre: float,
    accuracy: float,
) -> list[LayerCurve]:
    """Keys of a bone's displacement, applied from the right: that of its part beyond that of its parents."""
    pose = poses.matrices[control.bone]
    root_control = moved.get(control.carried_by)
    if root_control is None:
        root_control = np.broadcast_to(np.eye(4), pose.shape)
    elif not armature_of(armature).bones[control.bone].use_inherit_rotation:
        root_control = _translation_at(root_control, pose[:, :3, 3])
    change = np.linalg.inv(root_control @ pose) @ moved[control.part] @ pose
    size = float(np.linalg.norm(poses.world[0, :3, 0])) * metre
    curves = []
    if control.moves:
        tolerance = accuracy * LENGTH_TOLERANCE / max(size, 1e-12)
        curves += _curves(control.bone, "location", frames, change[:, :3, 3], np.zeros(3), tolerance)
    turns = quaternions(_pure_rotation(change))
    no_turn = np.array([1.0, 0.0, 0.0, 0.0])
    return curves + _curves(control.bone, "rotation_quaternion", frames, turns, no_turn, accuracy * ANGLE_TOLERANCE / 2)


AT_ONCE = 1 / 64
"""Frames outside the baked ones in which a response begins and ends."""


def _curves(
    bone: str, channel: str, frames: Array, values: Array, neutral: Array, tolerance: float
) -> list[LayerCurve]:
    """Curves with the fewest keys within the tolerance, between neutral keys before the first and after the last."""
    needed = kept_samples(values, tolerance)
    times = np.concatenate([frames[:1] - AT_ONCE, frames[needed], frames[-1:] + AT_ONCE])
    keyed = np.concatenate([neutral[None], values[needed], neutral[None]])
    path = path_of_bone(bone, channel)
    return [LayerCurve(path, index, bone, times, column) for index, column in enumerate(keyed.T)]


def _pure_rotation(matrices: Array) -> Array:
    axes = matrices[:, :3, :3]
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def _translation_at(displacement: Array, points: Array) -> Array:
    """Translations of points (F, 3) by displacements (F, 4, 4), as displacements that do not turn."""
    result = np.broadcast_to(np.eye(4), displacement.shape).copy()
    result[:, :3, 3] = carried(displacement, points) - points
    return result
