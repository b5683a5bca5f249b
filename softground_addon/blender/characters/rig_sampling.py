"""What a rig does over a range of frames, as a `CharacterMotion`; the user's scene is only read.

A rig that nothing but its keys moves is not evaluated at all. Others are, in a temporary scene that depends on nothing
else: constraints, drivers, NLA, parents and object motion act as in the user's scene, its meshes cost nothing, and the
user's frame, pose and handlers are left alone.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from itertools import chain

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.motion.motion import CharacterMotion
from ...core.rig.mapping import RigMapping, bones_of
from ...core.rig.motion_assembly import assemble_motion
from ...core.rig.recording import Recording
from ...core.rig.rig_skin import RigSkin
from ...core.rig.skin_stances import LONGEST, skin_stances
from ...core.settings import SceneUnits
from ..animation_layer.nla_layer import without_layer
from ..compat import remove_scene
from ..jobs import meanwhile
from ..settings import found, name_of, units_of
from .control_poses import PoseRecorder
from .keyed_poses import is_moved_by_keys_alone, keyed_pose, keyed_world, with_parents
from .prop_extraction import check_props, read_prop
from .rig_mapping import CHOOSE_CONTACTS, require_armature, rest_bones
from .skin_sampling import meshes_on, read_skin

Sampling = Generator[int, None, CharacterMotion]
"""Yields the number of frames read so far, returns the motion."""

_SCALE_TOLERANCE = 1e-3
"""Relative difference of scale between axes, and cosine between them, that still counts as uniform."""

_FARTHEST = 1e6
"""Largest coordinate that a pose may have [Blender units]: single precision knows no centimetres beyond."""

TEMPORARY = "SoftGround Sampling"
"""Name of what exists only while a rig is read."""

IS_TEMPORARY = "softground_is_temporary"
"""Property of the scenes in which rigs are read, by which those that were left over are told from the user's."""

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
    frames: range,
    recorder: PoseRecorder | None = None,
    units: SceneUnits | None = None,
    skin_mass: float = 0.0,
) -> Sampling:
    """Read a character frame by frame.

    Parameters
    ----------
    scene : bpy.types.Scene
        The user's scene: its meshes; only read.
    armature : bpy.types.Object
        May be linked or overridden.
    mapping : RigMapping
        From `rig_mapping.map_rig`, corrected by the user or not.
    mass : float
        [kg]
    frames : range
        Scene frames.
    recorder : PoseRecorder, optional
        Takes down how its bones stand.
    units : SceneUnits, optional
        Those of the bake that it is read for; as they are now in the scene where it is read for itself.
    skin_mass : float
        That the volume of its skin suggests [kg], against which a bake is checked; 0 where unknown.

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
    check_rig(scene, armature, mapping, mass)
    _check_frames(frames)
    bones = [*bones_of(mapping), *(recorder.bones if recorder else ())]
    on_bones = any(source.bone and not source.object for source in mapping.soles)
    props = list(dict.fromkeys(source.object for source in mapping.soles if source.object))
    rig, skin = name_of(armature), None
    if on_bones and meshes_on(scene, armature):
        skin = yield from meanwhile(0, read_skin.slices(scene, armature))
        armature = found(rig)
    units = units or units_of(scene)
    bones += skin.bones if skin and len(frames) <= LONGEST else ()
    recording = yield from record(scene, armature, frames, bones, units, props, recorder)
    return (yield from recorded_motion(scene, found(rig), mapping, recording, skin, mass=mass, skin_mass=skin_mass))


def recorded_motion(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    mapping: RigMapping,
    recording: Recording,
    skin: RigSkin | None,
    *,
    mass: float,
    skin_mass: float = 0.0,
) -> Sampling:
    """The motion of a character that was recorded.

    Parameters
    ----------
    recording : Recording
        Of the `bones_of` its mapping and of its objects; also of `skin.bones` if it has at most `LONGEST` samples.
    skin : RigSkin or None
    scene, armature, mapping, mass, skin_mass
        As for `sample_character`; and so is what it yields, returns and raises.
    """
    _check_recording(armature.name, recording)
    name, bones = armature.name, rest_bones(armature)
    carried = {
        source.name: read_prop(scene, source, recording.props[source.object])[0]
        for source in mapping.soles
        if source.object
    }
    count, stances = len(recording.frames), None
    if skin and count <= LONGEST:
        step = float(recording.frames[1] - recording.frames[0]) if count > 1 else 1.0
        looking = skin_stances(skin, bones, mapping, recording, recording.units.frame_rate / step, mass=skin_mass)
        stances = yield from meanwhile(count, looking)
    assembling = assemble_motion(name, bones, mapping, recording, skin, mass=mass, carried=carried, stances=stances)
    return (yield from assembling)


def record(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    frames: range,
    bones: Iterable[str],
    units: SceneUnits,
    props: Sequence[str] = (),
    recorder: PoseRecorder | None = None,
) -> Generator[int, None, Recording]:
    """Where some bones of a rig and some objects are over time; yields the number of frames read.

    Raises InputError, with the frame, where that is no place.
    """
    names, rig = list(dict.fromkeys(bones)), armature.name
    with without_layer(armature):
        keyed = not props and is_moved_by_keys_alone(armature, names)
    if keyed:
        recording = yield from _read_keys(armature.name_full, frames, names, units, recorder)
    else:
        recording = yield from _evaluate(scene, armature.name_full, frames, names, units, props, recorder)
    _check_finite(rig, recording)
    return recording


def sample_prop(
    scene: bpy.types.Scene,
    name: str,
    mapping: RigMapping,
    *,
    mass: float,
    frames: range,
    units: SceneUnits,
) -> Sampling:
    """Read frame by frame a prop without a rig: one or more objects that fall, roll or slide together.

    Parameters
    ----------
    name : str
        What the user calls it.
    mapping : RigMapping
        Its soles are objects.
    scene, mass, frames, units
        As for `sample_character`; and so is what it yields, returns and raises.
    """
    _check_mass(name, mass)
    sources = tuple(source for source in mapping.soles if source.object)
    check_props(scene, name, sources)
    _check_frames(frames)
    props = list(dict.fromkeys(source.object for source in sources))
    recording = yield from _evaluate(scene, "", frames, [], units, props)
    _check_finite(name, recording)
    parts = [read_prop(scene, source, recording.props[source.object]) for source in sources]
    volumes = np.array([volume for _, volume in parts])
    shares = volumes / volumes.sum() if volumes.min() > 0 else np.full(len(parts), 1 / len(parts))
    motions = tuple(motion for motion, _ in parts)
    return CharacterMotion(
        name=name,
        mass=mass,
        leg_length=max(motion.sole.prop.size for motion in motions if motion.sole.prop),
        frames=recording.frames,
        frame_rate=units.frame_rate,
        soles=motions,
        gravity=units.gravity_m_s2,
        centre=np.einsum("p,pfi->fi", shares, [motion.transforms[:, 0, :3, 3] for motion in motions]),
    )


def _read_keys(
    armature: str, frames: range, bones: Sequence[str], units: SceneUnits, recorder: PoseRecorder | None
) -> Generator[int, None, Recording]:
    """Record the matrices of a rig that nothing but its keys moves, bone by bone.

    Yields the frames that come to as much work.
    """
    times = np.array(frames) * units.time_stretch
    chain = with_parents(object_named(armature), bones)
    poses = np.empty((len(frames), len(chain), 4, 4), dtype=np.float32)
    for done, name in enumerate(chain):
        obj = object_named(armature)
        above = obj.data.bones[name].parent
        parent = np.swapaxes(poses[:, chain.index(above.name) if above else done], -1, -2)
        with without_layer(obj):
            poses[:, done] = np.swapaxes(keyed_pose(obj, name, times, parent), -1, -2)
            if recorder:
                recorder.note_keys(obj, name, times, poses[:, done])
        yield len(frames) * (done + 1) // len(chain)
    obj = object_named(armature)
    with without_layer(obj):
        world = keyed_world(obj, times)
    if recorder:
        recorder.world[:] = world
    return Recording(
        frames=np.array(frames, dtype=float),
        bones=tuple(chain),
        poses=poses,
        world=world,
        props={},
        units=units,
    )


def _evaluate(
    scene: bpy.types.Scene,
    armature: str,
    frames: range,
    bones: Sequence[str],
    units: SceneUnits,
    props: Sequence[str],
    recorder: PoseRecorder | None = None,
) -> Generator[int, None, Recording]:
    """Record the matrices frame by frame, yielding the number of frames done; without an armature, of props alone."""
    poses = np.empty((len(frames), len(bones), 4, 4), dtype=np.float32)
    prop_matrices = np.empty((len(frames), len(props), 4, 4))
    armature_matrices = np.tile(np.eye(4), (len(frames), 1, 1))
    simulated = any(is_simulated(object_named(obj)) for obj in props)
    source = user_scene(scene) if simulated else sampling_scene(scene, armature, bones, props)
    with source as name:
        for frame in _simulated_before(scene, frames.start) if simulated else ():
            with handlers_silent():
                still_there(name).frame_set(frame)
            yield 0
        for done, frame in enumerate(frames):
            temporary = still_there(name)
            with handlers_silent(), without_layer(object_named(armature)) if armature else nullcontext():
                temporary.frame_set(frame)
                depsgraph = temporary.view_layers[0].depsgraph
                assert depsgraph is not None
                if armature:
                    evaluated = object_named(armature).evaluated_get(depsgraph)
                    armature_matrices[done] = evaluated.matrix_world
                    pose = evaluated.pose.bones
                    if done == 0:
                        places = [pose.find(bone) for bone in bones]
                        buffer = np.empty((len(pose), 4, 4), dtype=np.float32)
                    pose.foreach_get("matrix", buffer.reshape(-1))
                    poses[done] = buffer[places]
                    if recorder:
                        recorder.note(done, evaluated)
            for place, obj in enumerate(props):
                prop_matrices[done, place] = object_named(obj).evaluated_get(depsgraph).matrix_world
            yield done + 1
    yield len(frames)

    prop_matrices[..., :3, :] *= units.unit_scale_m
    return Recording(
        frames=np.array(frames, dtype=float),
        bones=tuple(bones),
        poses=poses,
        world=armature_matrices,
        props={obj: prop_matrices[:, place] for place, obj in enumerate(props)},
        units=units,
    )


@contextmanager
def sampling_scene(scene: bpy.types.Scene, armature: str, bones: Sequence[str], props: Sequence[str]) -> Iterator[str]:
    """Name of a scene in which only the given bones and objects are evaluated; gone afterwards, whatever happens.

    It holds a probe that depends on them instead of themselves: so they are evaluated even where the user hides them,
    and the objects' meshes are not.
    """
    temporary = bpy.data.scenes.new(TEMPORARY)
    probe = bpy.data.objects.new(TEMPORARY, None)
    names = temporary.name, probe.name
    temporary[IS_TEMPORARY] = True
    try:
        for setting in _SCENE_TIME:
            setattr(temporary.render, setting, getattr(scene.render, setting))
        for obj, bone in (*((armature, bone) for bone in bones), *((obj, "") for obj in props)):
            dependence = probe.constraints.new("COPY_LOCATION")
            dependence.target, dependence.subtarget = object_named(obj), bone
        temporary.collection.objects.link(probe)
        yield names[0]
    finally:
        with handlers_silent():
            if (left_scene := bpy.data.scenes.get(names[0])) is not None:
                remove_scene(left_scene)
            if (left_probe := bpy.data.objects.get(names[1])) is not None:
                bpy.data.objects.remove(left_probe)


def is_simulated(obj: bpy.types.Object) -> bool:
    """Whether Blender's rigid bodies move an object, or one that it is parented to."""
    node: bpy.types.Object | None = obj
    while node is not None:
        if node.rigid_body and node.rigid_body.type == "ACTIVE":
            return True
        node = node.parent
    return False


@contextmanager
def user_scene(scene: bpy.types.Scene) -> Iterator[str]:
    """Name of the user's scene, which is put back to its frame afterwards."""
    shown = scene.frame_current, scene.frame_subframe
    name = scene.name
    try:
        yield name
    finally:
        left = bpy.data.scenes.get(name)
        if left is not None:
            with handlers_silent():
                left.frame_set(shown[0], subframe=shown[1])


def _simulated_before(scene: bpy.types.Scene, first: int) -> range:
    """Frames to step through before the first one.

    Rigid bodies exist in their own scene only, and only frame after frame. Those that are baked are read from their
    cache.
    """
    world = scene.rigidbody_world
    return range(world.point_cache.frame_start, first) if world and not world.point_cache.is_baked else range(0)


def still_there(name: str) -> bpy.types.Scene:
    """The scene of that name, in which a rig is being read; InputError if an undo or a new file has taken it away."""
    scene = bpy.data.scenes.get(name)
    if scene is None:
        raise InputError("The rig cannot be read any further: the scene was undone or reloaded. Start again.")
    return scene


def object_named(name: str) -> bpy.types.Object:
    """Object by its full name, which tells linked ones from local ones."""
    found = bpy.data.objects.get(name)
    if found is None or found.name_full != name:
        found = next((obj for obj in bpy.data.objects if obj.name_full == name), None)
    if found is None:
        raise InputError(f"Object '{name}' was deleted: choose another one for the character.")
    return found


@contextmanager
def handlers_silent() -> Iterator[None]:
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


def _check_frames(frames: range) -> None:
    if not frames or frames.step < 0:
        raise InputError(f"The frame range {frames.start} to {frames.stop - 1} is empty: set a start before the end.")


def _check_mass(name: str, mass: float) -> None:
    if not (np.isfinite(mass) and mass > 0):
        raise InputError(f"The mass of '{name}' is {mass} kg: give it a positive mass.")


def check_rig(scene: bpy.types.Scene, armature: bpy.types.Object, mapping: RigMapping, mass: float) -> None:
    """Whether a character can be read.

    Raises
    ------
    InputError
        If not; names the armature and the remedy.
    """
    require_armature(armature)
    name = armature.name
    _check_mass(name, mass)
    if not mapping.soles:
        raise InputError(f"'{name}' has no feet, and nothing else to print with: {CHOOSE_CONTACTS}.")
    bones = armature.data.bones
    for source in mapping.soles:
        if not source.bone and not source.object:
            raise InputError(f"Sole '{source.name}' of '{name}' has neither a bone nor an object: choose one.")
    check_props(scene, name, mapping.soles)
    missing = [bone for bone in bones_of(mapping) if bone not in bones]
    if missing:
        raise InputError(f"Armature '{name}' has no bone '{missing[0]}': choose the bones of the character again.")
    if armature.mode == "EDIT":
        raise InputError(f"Armature '{name}' is in Edit Mode and stands still: leave it with Tab first.")
    if armature.data.pose_position == "REST":
        raise InputError(f"Armature '{name}' shows its rest position: set it to Pose Position in its data properties.")
    if not is_animated(armature):
        raise InputError(f"Armature '{name}' has no animation: give it an action, or choose the armature that has one.")


def is_animated(armature: bpy.types.Object) -> bool:
    """Whether anything could move the rig: keys, NLA, drivers or constraints, its own or its parents'."""
    obj: bpy.types.Object | None = armature
    while obj is not None:
        animation = obj.animation_data
        if animation and (animation.action or animation.drivers or any(track.strips for track in animation.nla_tracks)):
            return True
        if obj.constraints or (obj.type == "ARMATURE" and any(bone.constraints for bone in obj.pose.bones)):
            return True
        obj = obj.parent
    return bool(armature.data.animation_data)


def _check_finite(name: str, recording: Recording) -> None:
    for matrices in chain([recording.armature], map(recording.bone, recording.bones), recording.props.values()):
        bad = ~(np.abs(matrices) <= _FARTHEST).all(axis=(1, 2))
        if bad.any():
            raise InputError(
                f"'{name}' has no finite pose at frame {int(recording.frames[bad.argmax()])}: "
                "look for broken keys (NaN, infinite or huge values) in its action and delete them."
            )


def _check_recording(name: str, recording: Recording) -> None:
    axes = recording.armature[:, :3, :3]
    gram = np.swapaxes(axes, -1, -2) @ axes
    size = np.sqrt(np.diagonal(gram, axis1=-2, axis2=-1))
    if (size < 1e-9).any():
        raise InputError(f"'{name}' has a scale of zero: set its scale, or apply it (Object > Apply > Scale).")
    spread = np.ptp(size, axis=-1) > _SCALE_TOLERANCE * size.max(axis=-1)
    cosines = gram / (size[:, :, None] * size[:, None, :])
    sheared = np.abs(cosines - np.eye(3)).max(axis=(1, 2)) > _SCALE_TOLERANCE
    if spread.any() or sheared.any():
        values = ", ".join(f"{value:.4g}" for value in size[spread | sheared][0])
        raise InputError(
            f"'{name}' is stretched or sheared (scale {values}): "
            "make its scale the same along all axes, or apply it (Object > Apply > Scale), also on its parents."
        )
