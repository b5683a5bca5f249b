"""What a rig does over a range of frames, as a `CharacterMotion`; the user's scene is only read.

The rig is evaluated in a temporary scene that holds nothing else: constraints, drivers, NLA, parents and object motion
act as in the user's scene, its meshes cost nothing, and the user's frame, pose and handlers are left alone.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.errors import InputError
from ..core.foot_attitude import planted_instants
from ..core.motion import Array, CharacterMotion, SoleMotion
from .rig_mapping import RigMapping, SoleSource, require_armature
from .sole_extraction import FootBones, FootMesh, find_foot_meshes, foot_sole, object_sole

Sampling = Generator[int, None, CharacterMotion]
"""Yields the number of frames read so far, returns the motion."""

STANDARD_GRAVITY = 9.81
"""For scenes whose gravity is switched off [m/s²]."""

_SCALE_TOLERANCE = 1e-3
"""Relative difference of scale between axes, and cosine between them, that still counts as uniform."""

_SCENE_TIME = ("fps", "fps_base", "frame_map_old", "frame_map_new")
"""Render settings that decide which time a frame number means."""

_SILENT_HANDLERS = ("frame_change_pre", "frame_change_post", "depsgraph_update_pre", "depsgraph_update_post")
"""Handlers that must not take the temporary scene for a change of the user's frame."""


def sample_character(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    mapping: RigMapping,
    *,
    mass: float,
    frame_start: int,
    frame_end: int,
    frame_step: int = 1,
) -> Sampling:
    """Read a character frame by frame.

    Parameters
    ----------
    scene : bpy.types.Scene
        The user's scene: frame rate, units, gravity and meshes; only read.
    armature : bpy.types.Object
        May be linked or overridden.
    mapping : RigMapping
        From `rig_mapping.map_rig`, corrected by the user or not.
    mass : float
        [kg]
    frame_start, frame_end, frame_step : int
        Scene frames, the last one included.

    Yields
    ------
    int
        Number of frames read; closing the generator at any point leaves nothing behind.

    Returns
    -------
    CharacterMotion

    Raises
    ------
    InputError
        If the rig cannot be used as it is; the message names the object and the remedy.
    """
    _check_input(armature, mapping, mass)
    frames = np.arange(frame_start, frame_end + 1, frame_step) if frame_step > 0 else np.empty(0, dtype=int)
    if not len(frames):
        raise InputError(
            f"The frame range {frame_start} to {frame_end} in steps of {frame_step} is empty: "
            "set a start before the end and a positive step."
        )
    wanted = list(dict.fromkeys([b for b, _ in mapping.joints.values()] + [b for s in mapping.soles for b in _bones(s)]))
    things = list(dict.fromkeys(source.object for source in mapping.soles if source.object))
    metre = scene.unit_settings.scale_length

    record = _Record.empty(len(frames), wanted, things)
    for done in _evaluate(scene, armature.name_full, frames, record):
        yield done
    record.scale_lengths(metre)
    _check_record(armature, record, frames)
    return _motion_from_record(scene, armature, mapping, record, mass=mass, frames=frames.astype(float))


def sample_character_now(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    mapping: RigMapping,
    *,
    mass: float,
    frame_start: int,
    frame_end: int,
    frame_step: int = 1,
) -> CharacterMotion:
    """`sample_character` in one go."""
    sampling = sample_character(
        scene,
        armature,
        mapping,
        mass=mass,
        frame_start=frame_start,
        frame_end=frame_end,
        frame_step=frame_step,
    )
    while True:
        try:
            next(sampling)
        except StopIteration as finished:
            motion: CharacterMotion = finished.value
            return motion


def _bones(source: SoleSource) -> list[str]:
    return [bone for bone in (source.bone, source.toe_bone) if bone]


@dataclass(frozen=True)
class _Record:
    """Matrices as evaluated, to world; lengths in Blender units until `scale_lengths`."""

    bones: list[str]
    things: list[str]
    bone_matrices: Array  # (F, B, 4, 4)
    thing_matrices: Array  # (F, T, 4, 4)
    object_matrices: Array  # (F, 4, 4)

    @classmethod
    def empty(cls, count: int, bones: list[str], things: list[str]) -> _Record:
        return cls(
            bones,
            things,
            np.empty((count, len(bones), 4, 4)),
            np.empty((count, len(things), 4, 4)),
            np.empty((count, 4, 4)),
        )

    def scale_lengths(self, metre: float) -> None:
        """Turn Blender units into metres and bone matrices from armature space to world."""
        self.bone_matrices[:] = self.object_matrices[:, None] @ self.bone_matrices
        for matrices in (self.bone_matrices, self.thing_matrices, self.object_matrices):
            matrices[..., :3, :] *= metre

    def of(self, bone: str) -> Array:
        """(F, 4, 4) matrices of a bone."""
        return self.bone_matrices[:, self.bones.index(bone)]


def _evaluate(scene: bpy.types.Scene, armature: str, frames: Array, record: _Record) -> Iterator[int]:
    """Fill the record frame by frame, yielding the number of frames done."""
    with _sampling_scene(scene, [armature, *record.things]) as name:
        for done, frame in enumerate(frames):
            temporary = bpy.data.scenes.get(name)
            if temporary is None:
                raise InputError("The rig cannot be read any further: the scene was undone or reloaded. Start again.")
            with _handlers_silent():
                temporary.frame_set(int(frame))
            depsgraph = temporary.view_layers[0].depsgraph
            evaluated = _object_named(armature).evaluated_get(depsgraph)
            record.object_matrices[done] = evaluated.matrix_world
            pose = evaluated.pose.bones
            for place, bone in enumerate(record.bones):
                record.bone_matrices[done, place] = pose[bone].matrix
            for place, thing in enumerate(record.things):
                record.thing_matrices[done, place] = _object_named(thing).evaluated_get(depsgraph).matrix_world
            yield done + 1


@contextmanager
def _sampling_scene(scene: bpy.types.Scene, objects: Sequence[str]) -> Iterator[str]:
    """Name of a scene that holds only the given objects and keeps the user's time; gone afterwards, whatever happens."""
    temporary = bpy.data.scenes.new("SoftGround Sampling")
    name = temporary.name
    try:
        for setting in _SCENE_TIME:
            setattr(temporary.render, setting, getattr(scene.render, setting))
        for thing in objects:
            temporary.collection.objects.link(_object_named(thing))
        yield name
    finally:
        left_over = bpy.data.scenes.get(name)
        if left_over is not None:
            with _handlers_silent():
                bpy.data.scenes.remove(left_over)


def _object_named(name: str) -> bpy.types.Object:
    """Object by its full name, which tells linked ones from local ones."""
    found = bpy.data.objects.get(name)
    if found is None or found.name_full != name:
        found = next((thing for thing in bpy.data.objects if thing.name_full == name), None)
    if found is None:
        raise InputError(f"Object '{name}' is gone: choose another one for the character.")
    return found


@contextmanager
def _handlers_silent() -> Iterator[None]:
    """Frame and update handlers put aside, and put back as they were."""
    lists = [getattr(bpy.app.handlers, name) for name in _SILENT_HANDLERS]
    saved = [list(handlers) for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, functions in zip(lists, saved, strict=True):
            handlers[:] = functions


def _check_input(armature: bpy.types.Object, mapping: RigMapping, mass: float) -> None:
    require_armature(armature)
    name = armature.name
    if not (np.isfinite(mass) and mass > 0):
        raise InputError(f"The mass of '{name}' is {mass} kg: give it a positive mass.")
    if not mapping.soles:
        raise InputError(f"'{name}' has no soles: add a foot bone or an object to the character's list of soles.")
    bones = armature.data.bones
    for source in mapping.soles:
        if not source.bone and not source.object:
            raise InputError(f"Sole '{source.name}' of '{name}' has neither a bone nor an object: choose one.")
        if source.object and source.object not in bpy.data.objects:
            raise InputError(f"Sole '{source.name}' of '{name}': object '{source.object}' is gone, choose another one.")
    missing = [b for b in [*(b for s in mapping.soles for b in _bones(s)), *(b for b, _ in mapping.joints.values())] if b not in bones]
    if missing:
        raise InputError(f"Armature '{name}' has no bone '{missing[0]}': choose the bones of the character again.")
    if armature.mode == "EDIT":
        raise InputError(f"Armature '{name}' is in edit mode and stands still: leave edit mode.")
    if armature.data.pose_position == "REST":
        raise InputError(f"Armature '{name}' shows its rest position: set it to Pose Position in its data properties.")
    if not _is_animated(armature):
        raise InputError(f"Armature '{name}' has no animation: give it an action, or choose the armature that has one.")


def _is_animated(armature: bpy.types.Object) -> bool:
    """Whether anything could move the rig: keys, NLA, drivers or constraints, its own or its parents'."""
    thing: bpy.types.Object | None = armature
    while thing is not None:
        animation = thing.animation_data
        if animation and (animation.action or animation.drivers or any(track.strips for track in animation.nla_tracks)):
            return True
        if thing.constraints or (thing.type == "ARMATURE" and any(bone.constraints for bone in thing.pose.bones)):
            return True
        thing = thing.parent
    return bool(armature.data.animation_data)


def _check_record(armature: bpy.types.Object, record: _Record, frames: Array) -> None:
    name = armature.name
    for matrices in (record.object_matrices[:, None], record.bone_matrices, record.thing_matrices):
        bad = ~np.isfinite(matrices).all(axis=(1, 2, 3))
        if bad.any():
            raise InputError(
                f"'{name}' has no finite pose at frame {int(frames[bad.argmax()])}: "
                "look for broken keys (NaN or infinite values) in its action and delete them."
            )
    axes = record.object_matrices[:, :3, :3]
    gram = np.swapaxes(axes, -1, -2) @ axes
    size = np.sqrt(np.diagonal(gram, axis1=-2, axis2=-1))
    if (size < 1e-9).any():
        raise InputError(f"'{name}' has a scale of zero: set its scale, or apply it (Object > Apply > Scale).")
    spread = np.ptp(size, axis=-1) > _SCALE_TOLERANCE * size.max(axis=-1)
    cosines = gram / (size[:, :, None] * size[:, None, :])
    sheared = np.abs(cosines - np.eye(3)).max(axis=(1, 2)) > _SCALE_TOLERANCE
    if spread.any() or sheared.any():
        raise InputError(
            f"'{name}' is stretched or sheared (scale {', '.join(f'{value:.4g}' for value in size[spread | sheared][0])}): "
            "make its scale the same along all axes, or apply it (Object > Apply > Scale), also on its parents."
        )


def _motion_from_record(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    mapping: RigMapping,
    record: _Record,
    *,
    mass: float,
    frames: Array,
) -> CharacterMotion:
    rest = _RestPose(armature, record.object_matrices[0])
    frame_rate = scene.render.fps / scene.render.fps_base
    gravity = float(np.linalg.norm(scene.gravity)) if scene.use_gravity else 0.0
    gravity = gravity or STANDARD_GRAVITY

    joints = {
        joint: _end_path(record.of(bone), 0.0 if end == "head" else armature.data.bones[bone].length)
        for joint, (bone, end) in mapping.joints.items()
    }
    leg = rest.leg_length(mapping)
    feet = [source for source in mapping.soles if source.bone and not source.object]
    points = [_foot_points(record, source, armature) for source in feet]
    planted = planted_instants(
        points, frame_rate=frame_rate / _step(frames), leg_length=leg, gravity=gravity
    )
    meshes = find_foot_meshes(scene, armature, feet, rest.world)
    forward = rest.facing(mapping)

    motions: dict[str, SoleMotion] = {}
    heights = []
    for source, stands in zip(feet, planted, strict=True):
        motions[source.name], height = _foot_motion(
            armature, source, record, rest, meshes.get(source.name), stands, leg=leg, forward=forward
        )
        heights.append(height)
    for source in mapping.soles:
        if source.object:
            motions[source.name] = _object_motion(source, record)
    return CharacterMotion(
        name=armature.name,
        mass=mass,
        leg_length=leg + (float(np.mean(heights)) if heights else 0.0),
        frames=frames,
        frame_rate=frame_rate,
        soles=tuple(motions[source.name] for source in mapping.soles),
        joints=joints,
        gravity=gravity,
    )


def _step(frames: Array) -> float:
    return float(frames[1] - frames[0]) if len(frames) > 1 else 1.0


@dataclass(frozen=True)
class _RestPose:
    """The rig at rest, placed in the world as at the first frame [m]."""

    armature: bpy.types.Object
    world: Array

    def matrix(self, bone: str) -> Array:
        return self.world @ np.array(self.armature.data.bones[bone].matrix_local)

    def end(self, bone: str, end: str) -> Array:
        point = self.armature.data.bones[bone]
        local = np.array(point.head_local if end == "head" else point.tail_local)
        return self.world[:3, :3] @ local + self.world[:3, 3]

    def leg_length(self, mapping: RigMapping) -> float:
        """Thigh and shank together, or about half the rig's height where they are not mapped."""
        lengths = []
        for side in "lr":
            points = [self.end(*mapping.joints[j]) for j in (f"hip_{side}", f"knee_{side}", f"ankle_{side}") if j in mapping.joints]
            if len(points) == 3:
                lengths.append(sum(float(np.linalg.norm(b - a)) for a, b in zip(points, points[1:], strict=False)))
        if lengths and min(lengths) > 0:
            return float(np.mean(lengths))
        ends = np.array([self.end(bone.name, end) for bone in self.armature.data.bones for end in ("head", "tail")])
        return max(float(np.ptp(ends, axis=0).max()) / 2, 1e-6)

    def facing(self, mapping: RigMapping) -> Array:
        """Horizontal direction in which the character faces; Blender's front where left and right do not show."""
        left = self._across(mapping)
        ahead = np.cross(left, (0.0, 0.0, 1.0))
        if np.linalg.det(self.world[:3, :3]) < 0:
            ahead = -ahead
        length = float(np.linalg.norm(ahead))
        return ahead / length if length > 1e-9 else np.array((0.0, -1.0, 0.0))

    def _across(self, mapping: RigMapping) -> Array:
        joints = mapping.joints
        for joint in ("hip", "shoulder", "knee", "ankle"):
            if f"{joint}_l" in joints and f"{joint}_r" in joints:
                across = self.end(*joints[f"{joint}_l"]) - self.end(*joints[f"{joint}_r"])
                if np.linalg.norm(across[:2]) > 1e-9:
                    return across
        return np.zeros(3)


def _foot_points(record: _Record, source: SoleSource, armature: bpy.types.Object) -> Array:
    """Paths of ankle and ball, (F, 2, 3)."""
    foot = record.of(source.bone)
    ball = (
        record.of(source.toe_bone)[:, :3, 3]
        if source.toe_bone
        else _end_path(foot, armature.data.bones[source.bone].length)
    )
    return np.stack([foot[:, :3, 3], ball], axis=1)


def _end_path(matrices: Array, along: float) -> Array:
    """Path of the point at a distance along the bone, (F, 3)."""
    return matrices[:, :3, 1] * along + matrices[:, :3, 3]


def _foot_motion(
    armature: bpy.types.Object,
    source: SoleSource,
    record: _Record,
    rest: _RestPose,
    mesh: FootMesh | None,
    planted: Array,
    *,
    leg: float,
    forward: Array,
) -> tuple[SoleMotion, float]:
    """A foot's sole in motion, and the height of its ankle."""
    foot_motion = _rigid_motion(record.of(source.bone), rest.matrix(source.bone))
    toe_motion = foot_motion
    if source.toe_bone:
        toe_motion = _rigid_motion(record.of(source.toe_bone), rest.matrix(source.toe_bone))
    ankle = rest.end(source.bone, "head")
    bones = FootBones(
        ankle=ankle,
        tail=rest.end(source.bone, "tail"),
        ball=rest.end(source.toe_bone, "head") if source.toe_bone else None,
        tip=rest.end(source.toe_bone, "tail") if source.toe_bone else None,
        forward=forward,
        foot_rotations=foot_motion[:, :3, :3],
        toe_rotations=toe_motion[:, :3, :3],
        planted=planted,
        leg=leg,
        mirrored=bool(np.linalg.det(rest.world[:3, :3]) < 0),
    )
    placed, flat = foot_sole(source, bones, mesh)
    carriers = [foot_motion @ flat.foot_frame, toe_motion @ flat.toe_frame][: len(placed.placements)]
    transforms = np.stack([c @ p for c, p in zip(carriers, placed.placements, strict=True)], axis=1)
    return SoleMotion(placed.sole, transforms), max(-float(placed.placements[:, 2, 3].min()), 0.0)


def _rigid_motion(matrices: Array, rest: Array) -> Array:
    """Rigid transforms that carry the rest pose to each sample, exact at the bone's head; scaling is left out."""
    turn = _nearest_rotation(matrices[:, :3, :3] @ np.linalg.inv(rest[:3, :3]))
    motion = np.zeros_like(matrices)
    motion[:, :3, :3] = turn
    motion[:, :3, 3] = matrices[:, :3, 3] - turn @ rest[:3, 3]
    motion[:, 3, 3] = 1.0
    return motion


def _nearest_rotation(matrices: Array) -> Array:
    """Rotations closest to the given matrices (polar decomposition)."""
    u, _, vh = np.linalg.svd(matrices)
    handed = np.ones(matrices.shape[:-1])
    handed[..., 2] = np.sign(np.linalg.det(u @ vh))
    return (u * handed[..., None, :]) @ vh


def _object_motion(source: SoleSource, record: _Record) -> SoleMotion:
    matrices = record.thing_matrices[:, record.things.index(source.object)]
    scale = np.linalg.norm(matrices[0, :3, :3], axis=0)
    placed = object_sole(source, _object_named(source.object), scale)
    rigid = matrices.copy()
    rigid[:, :3, :3] = _nearest_rotation(matrices[:, :3, :3] / scale)
    return SoleMotion(placed.sole, (rigid @ placed.placements[0])[:, None])
