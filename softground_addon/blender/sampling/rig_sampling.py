"""What a rig does over a range of frames, as a `CharacterMotion`; the user's scene is only read.

A rig that nothing but its keys moves is not evaluated at all. Others are, in a temporary scene that depends on nothing
else: constraints, drivers, NLA, parents and object motion act as in the user's scene, its meshes cost nothing, and the
user's frame, pose and handlers are left alone. Frame handlers of others act in that scene where they move the rig.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from itertools import chain
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.findings import Finding
from ...core.motion.motion import CharacterMotion
from ...core.rig.mapping import RigMapping, bones_of
from ...core.rig.motion_assembly import assemble_motion
from ...core.rig.recording import Recording
from ...core.rig.rig_skin import RigSkin
from ...core.rig.skin_stances import LONGEST, skin_stances
from ...core.settings import SceneUnits
from ..animation_layer.constraint_layer import LayerKind, is_own, without_layers
from ..jobs import meanwhile
from ..rigs.rig_mapping import CHOOSE_CONTACTS, require_armature, rest_bones
from ..settings import found, name_of, units_of
from .control_poses import RigPoses
from .keyed_poses import is_moved_by_keys_alone, keyed_pose, keyed_world, with_parents
from .prop_extraction import check_props, read_prop
from .skin_sampling import meshes_on, read_skin
from .temporary import TEMPORARY, handlers_silent, temporary_scene

Sampling = Generator[int, None, CharacterMotion]
"""Yields the number of frames read so far, returns the motion."""

_SCALE_TOLERANCE = 1e-3
"""Relative difference of scale between axes, and cosine between them, that still counts as uniform."""

_FARTHEST = 1e6
"""Largest coordinate that a pose may have [m]: single precision knows no centimetres beyond."""

_ON_EARTH = 1e8
"""Poses that are all within this are a place far away, as of maps; others are broken [m]."""

_SCENE_TIME = ("fps", "fps_base", "frame_map_old", "frame_map_new")
"""Render settings that decide which time a frame number means."""


def sample_character(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    mapping: RigMapping,
    *,
    mass: float,
    frames: range,
    poses: RigPoses | None = None,
    units: SceneUnits | None = None,
    skin_mass: float = 0.0,
    below: LayerKind = LayerKind.RESPONSE,
    findings: list[Finding] | None = None,
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
    poses : RigPoses, optional
        Gets the poses of its bones.
    units : SceneUnits, optional
        Those of the bake that it is read for; as they are now in the scene where it is read for itself.
    skin_mass : float
        That the volume of its skin suggests [kg], against which a bake is checked; 0 where unknown.
    below : LayerKind
        Lowest of the add-on's layers that is not read.
    findings : list of Finding, optional
        Takes what the user should know of how it was read.

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
    check_frames(frames)
    bones = [*bones_of(mapping), *(poses.bones if poses else ())]
    on_bones = any(source.bone and not source.object for source in mapping.soles)
    props = list(dict.fromkeys(source.object for source in mapping.soles if source.object))
    rig, skin = name_of(armature), None
    if on_bones and meshes_on(scene, armature):
        skin = yield from meanwhile(0, read_skin.slices(scene, armature))
        armature = found(rig)
    units = units or units_of(scene)
    bones += skin.bones if skin and len(frames) <= LONGEST else ()
    shapes = [shape.key for shape in skin.shapes] if skin else []
    recording = yield from record(scene, armature, frames, bones, units, props, shapes, below=below, findings=findings)
    if poses:
        poses.take(recording)
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
    shapes: Sequence[tuple[str, str]] = (),
    *,
    below: LayerKind = LayerKind.RESPONSE,
    findings: list[Finding] | None = None,
) -> Generator[int, None, Recording]:
    """Where some bones of a rig and some objects are over time, and what values some shape keys of objects have.

    Yields the number of frames read.

    Raises InputError, with the frame, where that is no place.
    """
    names, rig, full_name = list(dict.fromkeys(bones)), armature.name, armature.name_full
    handled = yield from _moved_by_handlers(scene, full_name, frames, names, props)
    with without_layers(object_named(full_name), below):
        keyed = not (props or shapes or handled) and is_moved_by_keys_alone(object_named(full_name), names)
    if keyed:
        recording = yield from _read_keys(full_name, frames, names, units, below)
    else:
        recording = yield from _evaluate(scene, full_name, frames, names, units, props, shapes, below, handled=handled)
    if handled and findings is not None:
        findings.append(_handled_finding(rig))
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
    findings: list[Finding] | None = None,
) -> Sampling:
    """Read frame by frame a prop without a rig: one or more objects that fall, roll or slide together.

    Parameters
    ----------
    name : str
        What the user calls it.
    mapping : RigMapping
        Its soles are objects.
    scene, mass, frames, units, findings
        As for `sample_character`; and so is what it yields, returns and raises.
    """
    check_mass(name, mass)
    sources = tuple(source for source in mapping.soles if source.object)
    check_props(scene, name, sources)
    check_frames(frames)
    props = list(dict.fromkeys(source.object for source in sources))
    handled = yield from _moved_by_handlers(scene, "", frames, [], props)
    recording = yield from _evaluate(scene, "", frames, [], units, props, handled=handled)
    if handled and findings is not None:
        findings.append(_handled_finding(name))
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
    armature: str, frames: range, bones: Sequence[str], units: SceneUnits, below: LayerKind
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
        with without_layers(obj, below):
            poses[:, done] = np.swapaxes(keyed_pose(obj, name, times, parent), -1, -2)
        yield len(frames) * (done + 1) // len(chain)
    obj = object_named(armature)
    with without_layers(obj, below):
        world = keyed_world(obj, times)
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
    shapes: Sequence[tuple[str, str]] = (),
    below: LayerKind = LayerKind.RESPONSE,
    *,
    handled: bool,
) -> Generator[int, None, Recording]:
    """Record the matrices frame by frame, yielding the number of frames done; without an armature, of props alone.

    `handled` lets frame handlers of others act.
    """
    poses = np.empty((len(frames), len(bones), 4, 4), dtype=np.float32)
    prop_matrices = np.empty((len(frames), len(props), 4, 4))
    values = np.empty((len(shapes), len(frames)))
    armature_matrices = np.tile(np.eye(4), (len(frames), 1, 1))
    simulated = any(is_simulated(object_named(obj)) for obj in props)
    source = user_scene(scene) if simulated else sampling_scene(scene, armature, bones, props, shapes, handled=handled)
    with source as name:
        for frame in _simulated_before(scene, frames.start) if simulated else ():
            with handlers_silent():
                still_there(name).frame_set(frame)
            yield 0
        for done, frame in enumerate(frames):
            temporary = still_there(name)
            if handled:
                _let_handlers_act(temporary, frame)
            with handlers_silent(), without_layers(object_named(armature), below) if armature else nullcontext():
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
            for place, obj in enumerate(props):
                prop_matrices[done, place] = object_named(obj).evaluated_get(depsgraph).matrix_world
            for place, (obj, key) in enumerate(shapes):
                keys = object_named(obj).data.shape_keys.evaluated_get(depsgraph)
                values[place, done] = keys.key_blocks[key].value
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
        shapes=dict(zip(shapes, values, strict=True)),
    )


@contextmanager
def sampling_scene(
    scene: bpy.types.Scene,
    armature: str,
    bones: Sequence[str],
    props: Sequence[str],
    shapes: Sequence[tuple[str, str]] = (),
    *,
    meshes: Sequence[str] = (),
    handled: bool = False,
) -> Iterator[str]:
    """Name of a scene in which only the given bones, objects and shape keys are evaluated, and the meshes of some.

    It is gone afterwards, whatever happens.

    It holds a probe that depends on them instead of themselves: so they are evaluated even where the user hides them,
    and the objects' meshes are not. What `handled` handlers set in the user's data ends as at the frame that is shown.
    """
    shown = scene.frame_current, scene.frame_subframe
    with temporary_scene() as temporary:
        probe = bpy.data.objects.new(TEMPORARY, None)
        names = temporary.name, probe.name
        try:
            for setting in _SCENE_TIME:
                setattr(temporary.render, setting, getattr(scene.render, setting))
            of_vertices = ((obj, "any vertices") for obj in meshes)  # depends on the mesh, if no group has that name
            for obj, bone in (*((armature, bone) for bone in bones), *((obj, "") for obj in props), *of_vertices):
                dependence = probe.constraints.new("COPY_LOCATION")
                dependence.target, dependence.subtarget = object_named(obj), bone
            for obj, key in shapes:
                driver = probe.driver_add("location", 0).driver
                driver.type = "SUM"
                follows = driver.variables.new().targets[0]
                follows.id_type, follows.id = "KEY", object_named(obj).data.shape_keys
                follows.data_path = follows.id.key_blocks[key].path_from_id("value")
            temporary.collection.objects.link(probe)
            yield names[0]
        finally:
            left_scene = bpy.data.scenes.get(names[0])
            if left_scene is not None and handled:
                _let_handlers_act(left_scene, *shown)
            if (left_probe := bpy.data.objects.get(names[1])) is not None:
                with handlers_silent():
                    bpy.data.objects.remove(left_probe)


def is_simulated(obj: bpy.types.Object) -> bool:
    """Return whether Blender's rigid bodies move an object, or one that it is parented to."""
    node: bpy.types.Object | None = obj
    while node is not None:
        if node.rigid_body and node.rigid_body.type == "ACTIVE":
            return True
        node = node.parent
    return False


_CHANNELS = re.compile("location|rotation|scale|matrix|pose|bone|influence|value|foreach_set|frame_set")
"""What the code names of a handler that moves something."""


def _moving_handlers() -> list[Callable[..., None]]:
    """Frame handlers of other add-ons and scripts that may move what is read, by what their code names."""
    package = (__package__ or "").rpartition(".blender.")[0]
    handlers = (*bpy.app.handlers.frame_change_pre, *bpy.app.handlers.frame_change_post)
    theirs = [handler for handler in handlers if not str(handler.__module__).startswith(f"{package}.")]
    return [handler for handler in theirs if any(map(_CHANNELS.match, _names_in(handler)))]


def _names_in(function: Any) -> set[str]:
    """The names in the code of a function, and of those of its module that it calls."""
    waiting, known, names = [function], set(), set()
    while waiting:
        function = inspect.unwrap(waiting.pop())
        code = getattr(function, "__code__", None)
        if code is None or code in known:
            continue
        known.add(code)
        names.update(code.co_names)
        waiting += [function.__globals__[name] for name in code.co_names if callable(function.__globals__.get(name))]
    return names


def _handled_finding(name: str) -> Finding:
    modules = dict.fromkeys(str(handler.__module__) for handler in _moving_handlers())
    return Finding(
        "frame_handler",
        "note",
        f"'{name}' is moved by a frame handler of {' or '.join(map(repr, modules))}, and was read with it.",
        "Bake again when it moves otherwise: that does not show as outdated.",
    )


def _moved_by_handlers(
    scene: bpy.types.Scene, armature: str, frames: range, bones: Sequence[str], props: Sequence[str]
) -> Generator[int, None, bool]:
    """True if frame handlers of others move a rig or objects, from a few frames with them and without."""
    if not _moving_handlers() or any(is_simulated(object_named(obj)) for obj in props):
        return False
    objects = [*([armature] if armature else []), *props]
    with sampling_scene(scene, armature, bones, props, handled=True) as name:
        for frame in dict.fromkeys((frames[0], frames[len(frames) // 3], frames[-1])):
            seen: list[Any] = []
            for handled in (False, True):
                temporary = still_there(name)
                if handled:
                    _let_handlers_act(temporary, frame)
                with handlers_silent():
                    temporary.frame_set(frame)
                depsgraph = temporary.view_layers[0].depsgraph
                assert depsgraph is not None
                at = [object_named(obj).evaluated_get(depsgraph) for obj in objects]
                poses = (at[0].pose.bones[bone].matrix for bone in bones)
                seen.append(np.array([*(obj.matrix_world for obj in at), *poses]))
            yield 0
            if not np.allclose(seen[0], seen[1], rtol=1e-5, atol=1e-5, equal_nan=True):
                return True
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
    block = bpy.data.objects.get(name)
    if block is None or block.name_full != name:
        block = next((obj for obj in bpy.data.objects if obj.name_full == name), None)
    if block is None:
        raise InputError(f"Object '{name}' was deleted: choose another one for the character.")
    return block


def _let_handlers_act(scene: bpy.types.Scene, frame: int, subframe: float = 0.0) -> None:
    """Let the handlers of others that may move what is read act at a frame, with a scene as the current one.

    What Blender then updates has the keys of the user's frame: the scene is yet to be set to the frame once more.
    """
    with handlers_silent(_moving_handlers()), bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        scene.frame_set(frame, subframe=subframe)


def check_frames(frames: range) -> None:
    """Raise InputError where there are no frames."""
    if not frames or frames.step < 0:
        raise InputError(f"The frame range {frames.start} to {frames.stop - 1} is empty: set a start before the end.")


def check_mass(name: str, mass: float) -> None:
    """Raise InputError where a mass is none."""
    if not (np.isfinite(mass) and mass > 0):
        raise InputError(f"The mass of '{name}' is {mass} kg: give it a positive mass.")


def check_rig(scene: bpy.types.Scene, armature: bpy.types.Object, mapping: RigMapping, mass: float) -> None:
    """Return whether a character can be read.

    Raises
    ------
    InputError
        If not; names the armature and the remedy.
    """
    require_armature(armature)
    name = armature.name
    check_mass(name, mass)
    if not mapping.soles:
        raise InputError(
            f"'{name}' has no feet, and nothing else to print with: {CHOOSE_CONTACTS}. Remove it from the characters "
            "if nothing of it touches the ground, as of what swims or flies."
        )
    for source in mapping.soles:
        if not source.bone and not source.object:
            raise InputError(f"Sole '{source.name}' of '{name}' has neither a bone nor an object: choose one.")
    check_props(scene, name, mapping.soles)
    check_bones(armature, mapping)
    if armature.mode == "EDIT":
        raise InputError(f"Armature '{name}' is in Edit Mode and stands still: leave it with Tab first.")
    if armature.data.pose_position == "REST":
        raise InputError(f"Armature '{name}' shows its rest position: set it to Pose Position in its data properties.")
    if not is_animated(armature):
        raise InputError(f"Armature '{name}' has no animation: give it an action, or choose the armature that has one.")


def check_bones(armature: bpy.types.Object, mapping: RigMapping) -> None:
    """Raise InputError where an armature has no bone of a name that its mapping has."""
    missing = [bone for bone in bones_of(mapping) if bone not in armature.data.bones]
    if missing:
        raise InputError(
            f"Armature '{armature.name}' has no bone '{missing[0]}': choose the bones of the character again."
        )


def is_animated(armature: bpy.types.Object) -> bool:
    """Return whether anything could move the rig: keys, NLA, drivers or constraints, its own or its parents'."""
    obj: bpy.types.Object | None = armature
    while obj is not None:
        animation = obj.animation_data
        if animation and (animation.action or animation.drivers or any(track.strips for track in animation.nla_tracks)):
            return True
        owners = (obj, *(obj.pose.bones if obj.type == "ARMATURE" else ()))
        if any(not is_own(constraint) for owner in owners for constraint in owner.constraints):
            return True
        obj = obj.parent
    return bool(armature.data.animation_data)


def _check_finite(name: str, recording: Recording) -> None:
    for matrices in chain([recording.armature], map(recording.bone, recording.bones), recording.props.values()):
        furthest = np.abs(matrices).max(axis=(1, 2))
        bad = ~(furthest <= _FARTHEST)
        if not bad.any():
            continue
        first = int(bad.argmax())
        if bad.all() and furthest.max() < _ON_EARTH:
            rounding = float(np.spacing(np.float32(furthest[first])))
            raise InputError(
                f"'{name}' is {furthest[first] / 1e3:,.0f} km from the world's origin, where Blender rounds positions "
                f"to {rounding * 100:.2g} cm: move it and its ground to the origin."
            )
        raise InputError(
            f"'{name}' has no finite pose at frame {int(recording.frames[first])}: "
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
