"""Poses of characters as they are seen with their layers, as keys of a new action, for engines and exports."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.numerics.arrays import Array
from ...core.numerics.key_reduction import kept_samples
from ...core.numerics.orientation import axis_angles, euler_angles, quaternions, without_leaps
from ...core.numerics.rigid import unit
from ...core.record.edits import mesh_soles
from ...core.rig.recording import Timeline
from .. import settings
from ..animation_layer.constraint_layer import check_layerable, is_own, owners_of, take_off
from ..animation_layer.layer_curves import LayerCurve, add_curve, assign_action, new_action, path_of_bone
from ..compat import channels_of, set_slot, slot_of
from ..ground import baked_ground
from ..jobs import Job, Progress
from ..reading import staleness
from ..reading.shots import settings_of
from ..response import response_job
from ..response.character_keys import ANGLE_TOLERANCE, LENGTH_TOLERANCE
from ..rigs.frame_ranges import animated_frames
from ..rigs.object_data import pose_bones
from ..sampling.sampling_scene import depsgraph_at, object_named, sampling_scene
from ..sampling.take import Take
from ..translation import translated
from . import bake_report


@dataclass(frozen=True)
class MadeKeys:
    """Keys that a character was given.

    Attributes
    ----------
    character, action, source : str
        Names; the source is the user's action, empty where there was none.
    bones : tuple of str
        Those that were keyed; an empty name is the armature as an object.
    layered : tuple of str
        Those that keep their layer.
    """

    character: str
    action: str
    source: str
    bones: tuple[str, ...]
    layered: tuple[str, ...]

    @property
    def summary(self) -> str:
        """In a line."""
        text = "'{action}' animates {count} bones of '{name}'"
        if self.source:
            text = "'{action}' animates {count} bones of '{name}'; '{source}' is kept"
        return translated(text, action=self.action, count=len(self.bones), name=self.character, source=self.source)

    @property
    def warning(self) -> str:
        """Warning about what could not be keyed; empty if everything was."""
        if not self.layered:
            return ""
        return (
            f"These bones of '{self.character}' keep their layer, as they have constraints and keys "
            f"alone would not pose them: {', '.join(self.layered)}. Use Pose > Animation > Bake Action for them."
        )


def make_keys(scene: bpy.types.Scene) -> Job[tuple[MadeKeys, ...]]:
    """Give each character with layers an action that poses it as it is seen, and take the layers off.

    Raises
    ------
    InputError
        If no character has a layer, or something would hide the new action; nothing is changed then.
    """
    armatures = {
        character.armature: None
        for character in scene.softground.characters
        if character.armature and owners_of(character.armature)
    }
    if not armatures:
        raise InputError("No character here has a layer to make keys of: bake with Sink Feet on, or press Clean Feet.")
    for armature in armatures:
        _check(armature)
    names = [armature.name_full for armature in armatures]
    read = []
    user, timeline, units = settings.name_of(scene), settings.timeline_of(scene), settings.units_of(scene)
    for number, name in enumerate(names):
        take = Take(user, _frames(scene.softground, timeline, object_named(name)), units)
        read.append((yield from _read(take, name, number / len(names), 1 / len(names))))
    fresh = not bake_report.stale_reasons(scene)
    made = tuple(_assign(object_named(name), curves) for name, curves in zip(names, read, strict=True))
    if fresh:
        _note_movers(scene)
    yield Progress("write", 1.0)
    return made


def _note_movers(scene: bpy.types.Scene) -> None:
    """Note with a bake that was up to date what its characters are animated by now: their feet are in its prints."""
    ground = scene.softground.ground
    if ground is None or not baked_ground.is_baked(ground):
        return
    wanted = settings_of(scene)
    soles = staleness.of_soles(scene.objects, mesh_soles(baked_ground.edits_of(ground)))
    staleness.store_again(
        ground, staleness.stamp_of(ground), wanted.painted, staleness.of_movers(scene.objects, wanted) | soles
    )


def _check(armature: bpy.types.Object) -> None:
    """Raise InputError, naming the remedy, where a new action would not show."""
    check_layerable(armature)
    animation = armature.animation_data
    if animation is None:
        return
    if animation.use_tweak_mode:
        raise InputError(
            f"An NLA strip of '{armature.name}' is being tweaked: leave tweak mode (Tab in the NLA editor)."
        )
    solo = next((track.name for track in animation.nla_tracks if track.is_solo), "")
    if solo and animation.use_nla:
        raise InputError(f"NLA track '{solo}' of '{armature.name}' is solo and would hide the keys: end its solo.")
    if animation.action and (animation.action_blend_type, animation.action_influence) != ("REPLACE", 1.0):
        raise InputError(
            f"The action of '{armature.name}' is blended with NLA strips: merge them first (Animation > Bake Action)."
        )


def _read(take: Take, name: str, start: float, share: float) -> Job[dict[str, list[LayerCurve]]]:
    """Curves of what is seen of each bone with a layer that keys can pose, by bone."""
    armature = object_named(name)
    frames, units = take.frames, take.units
    bones = list(owners_of(armature))
    watched = list(filter(None, bones)) or [pose_bones(armature)[0].name]
    poses = np.empty((len(frames), len(bones), 4, 4))
    turns: dict[str, list[tuple[float, ...]]] = {bone: [] for bone in bones}
    places = np.empty((len(frames), len(bones), 3))
    with sampling_scene(take.scene, name, watched, ()) as temporary:
        for done, frame in enumerate(frames):
            evaluated = object_named(name).evaluated_get(depsgraph_at(temporary, frame))
            for place, bone in enumerate(bones):
                owner = pose_bones(evaluated)[bone] if bone else evaluated
                poses[done, place] = _local(evaluated, bone)
                places[done, place] = owner.location
                turns[bone].append(tuple(owner.rotation_euler[:]))
            yield Progress("sample", start + share * (done + 1) / len(frames))
    times, size = np.array(frames) * units.time_stretch, units.unit_scale_m * armature.matrix_world.median_scale
    curves: dict[str, list[LayerCurve]] = {}
    for place, bone in enumerate(bones):
        owner = pose_bones(armature)[bone] if bone else armature
        moved = np.abs(poses[:, place, :3, 3] - places[:, place]).max() > LENGTH_TOLERANCE / size
        if any(not (constraint.mute or is_own(constraint)) for constraint in owner.constraints):
            continue
        channels = [_turns(owner.rotation_mode, poses[:, place], np.array(turns[bone]))] if bone else []
        if moved:
            channels.append(("location", poses[:, place, :3, 3], LENGTH_TOLERANCE / size))
        curves[bone] = []
        for channel, values, tolerance in channels:
            reduced = kept_samples(values, tolerance)
            path, group = (path_of_bone(bone, channel), bone) if bone else (channel, "Object Transforms")
            curves[bone] += [
                LayerCurve(path, i, group, times[reduced], column) for i, column in enumerate(values[reduced].T)
            ]
    return curves


def _local(evaluated: bpy.types.Object, bone: str) -> Array:
    """Pose of a bone as its channels have it, or of an object that only its location was changed of."""
    if bone:
        pose = pose_bones(evaluated)[bone]
        above = {}
        if pose.parent:
            above = {"parent_matrix": pose.parent.matrix, "parent_matrix_local": pose.parent.bone.matrix_local}
        return np.array(pose.bone.convert_local_to_pose(pose.matrix, pose.bone.matrix_local, **above, invert=True))
    world = evaluated.matrix_world.to_3x3()
    basis = evaluated.matrix_basis.copy()
    from_world = (world @ basis.to_3x3().inverted()).inverted()
    layer: Any
    for layer in evaluated.constraints:
        if is_own(layer) and not layer.mute and layer.target:
            basis.translation += from_world @ (layer.influence * layer.target.matrix_world.translation)
    return np.array(basis)


def _turns(mode: str, poses: Array, euler: Array) -> tuple[str, Array, float]:
    """Channel of a bone's rotation, its values and the tolerance of its keys."""
    axes = unit(np.swapaxes(poses[:, :3, :3], 1, 2)).swapaxes(1, 2)
    if mode == "QUATERNION":
        return "rotation_quaternion", without_leaps(quaternions(axes)), ANGLE_TOLERANCE / 2
    if mode == "AXIS_ANGLE":
        return "rotation_axis_angle", axis_angles(without_leaps(quaternions(axes))), ANGLE_TOLERANCE / 2
    return "rotation_euler", euler_angles(axes, mode, euler), ANGLE_TOLERANCE


def _frames(options: Any, timeline: Timeline, armature: bpy.types.Object) -> range:
    """The frames of the bake, and those beyond in which the character's own curves move it, at most to the end of the
    scene; not those in which only its parents go on."""
    animated = [frame / timeline.stretch for frame in animated_frames(timeline, armature, alone=True) or ()]
    first, last = min([options.frame_start, *animated]), max([options.frame_end, *animated])
    return range(floor(first), ceil(last) + 1)


def _assign(armature: bpy.types.Object, curves: dict[str, list[LayerCurve]]) -> MadeKeys:
    """Let the armature play a copy of its action with the curves in it, in the place of its layers."""
    layered = tuple(bone for bone in owners_of(armature) if bone not in curves)
    animation = armature.animation_data or armature.animation_data_create()
    source, slot = animation.action, slot_of(animation)
    flat = [curve for of_bone in curves.values() for curve in of_bone]
    name = f"{source.name if source else armature.name} with Response"
    if source is None or (slot is None and hasattr(source, "slots")):
        action = new_action(name, armature, flat)
        assign_action(armature, action)
    else:
        source.use_fake_user = True
        action = source.copy()
        action.name = name
        animation.action = action
        set_slot(animation, next((item for item in getattr(action, "slots", ()) if item.handle == slot.handle), None))
        channels = channels_of(action, slot_of(animation))
        replaced = {(curve.path, curve.index) for curve in flat}
        for curve in [item for item in channels if (item.data_path, item.array_index) in replaced]:
            channels.remove(curve)
        for curve in flat:
            add_curve(channels, curve)
    action[response_job.SOURCE] = source.name if source else ""
    take_off(armature, set(curves))
    return MadeKeys(armature.name, action.name, source.name if source else "", tuple(curves), layered)
