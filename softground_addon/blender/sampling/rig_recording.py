"""Matrices of bones and objects over time: from keys alone where nothing else moves a rig, or evaluated by frames."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from operator import attrgetter
from typing import Any

import bpy
import numpy as np

from ...core.rig.recording import Recording
from ..animation_layer.constraint_layer import without_layers
from ..placement import world_matrix
from ..rigs.frame_ranges import held_range
from ..rigs.object_data import armature_of, mesh_of, pose_bones
from ..settings import timeline_of
from .frame_handlers import handled_finding, let_handlers_act, moving_handlers
from .keyed_poses import is_moved_by_keys_alone, keyed_pose, keyed_world, with_parents
from .rig_checks import check_finite
from .sampling_scene import depsgraph_at, object_named, sampling_scene, still_there, user_scene
from .take import Take


def record(
    take: Take,
    armature: bpy.types.Object,
    bones: Iterable[str],
    props: Sequence[str] = (),
    shapes: Sequence[tuple[str, str]] = (),
) -> Generator[int, None, Recording]:
    """Transforms over time of bones and objects, and values of shape keys.

    Yields the number of frames read.

    Raises InputError, with the frame, where that is no place.
    """
    names, rig, full_name = list(dict.fromkeys(bones)), armature.name, armature.name_full
    handled = yield from _moved_by_handlers(take, full_name, names, props)
    with without_layers(object_named(full_name), take.below):
        keyed = not (props or shapes or handled) and is_moved_by_keys_alone(object_named(full_name), names)
    if keyed:
        recording = yield from _read_keys(take, full_name, names)
    else:
        recording = yield from _evaluate(take, full_name, names, props, shapes, handled=handled)
    animated = None if handled else held_range(timeline_of(take.scene), object_named(full_name))
    if animated:
        stretch = take.units.time_stretch
        recording = replace(recording, animated=(animated[0] / stretch, animated[1] / stretch))
    return _checked(take, rig, recording, handled=handled)


def record_props(take: Take, name: str, props: Sequence[str]) -> Generator[int, None, Recording]:
    """Transforms of objects over time; `name` is their common name in errors.

    Yields the number of frames read.

    Raises InputError, with the frame, where that is no place.
    """
    handled = yield from _moved_by_handlers(take, "", [], props)
    recording = yield from _evaluate(take, "", [], props, handled=handled)
    return _checked(take, name, recording, handled=handled)


def _checked(take: Take, name: str, recording: Recording, *, handled: bool) -> Recording:
    """The recording, which must be finite; the findings take that handlers of others moved it."""
    if handled:
        take.findings.append(handled_finding(name))
    recording = recording.in_frame()
    check_finite(name, recording)
    return recording


def _read_keys(take: Take, armature: str, bones: Sequence[str]) -> Generator[int, None, Recording]:
    """Record the matrices of a rig that nothing but its keys moves, bone by bone.

    Yields the frames that come to as much work.
    """
    frames, below = take.frames, take.below
    times = np.array(frames) * take.units.time_stretch
    chain = with_parents(object_named(armature), bones)
    poses = np.empty((len(frames), len(chain), 4, 4), dtype=np.float32)
    for done, name in enumerate(chain):
        obj = object_named(armature)
        above = armature_of(obj).bones[name].parent
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
        units=take.units,
    )


def _evaluate(
    take: Take,
    armature: str,
    bones: Sequence[str],
    props: Sequence[str],
    shapes: Sequence[tuple[str, str]] = (),
    *,
    handled: bool,
) -> Generator[int, None, Recording]:
    """Record the matrices frame by frame, yielding the number of frames done; without an armature, of props alone.

    `handled` lets frame handlers of others act.
    """
    scene, frames, units = take.scene, take.frames, take.units
    placed = world_matrix if units.frame else attrgetter("matrix_world")
    poses = np.empty((len(frames), len(bones), 4, 4), dtype=np.float32)
    prop_matrices = np.empty((len(frames), len(props), 4, 4))
    values = np.empty((len(shapes), len(frames)))
    armature_matrices = np.tile(np.eye(4), (len(frames), 1, 1))
    simulated = any(is_simulated(object_named(obj)) for obj in props)
    source = user_scene(scene) if simulated else sampling_scene(scene, armature, bones, props, shapes, handled=handled)
    with source as name:
        for frame in _simulated_before(scene.rigidbody_world, frames.start) if simulated else ():
            depsgraph_at(name, frame)
            yield 0
        for done, frame in enumerate(frames):
            if handled:
                let_handlers_act(still_there(name), frame)
            with without_layers(object_named(armature), take.below) if armature else nullcontext():
                depsgraph = depsgraph_at(name, frame)
                if armature:
                    evaluated = object_named(armature).evaluated_get(depsgraph)
                    armature_matrices[done] = placed(evaluated)
                    pose = pose_bones(evaluated)
                    if done == 0:
                        places = [pose.find(bone) for bone in bones]
                        buffer = np.empty((len(pose), 4, 4), dtype=np.float32)
                    pose.foreach_get("matrix", buffer.reshape(-1))
                    poses[done] = buffer[places]
            for place, obj in enumerate(props):
                prop_matrices[done, place] = placed(object_named(obj).evaluated_get(depsgraph))
            for place, (obj, key) in enumerate(shapes):
                keys: Any = mesh_of(object_named(obj)).shape_keys
                values[place, done] = keys.evaluated_get(depsgraph).key_blocks[key].value
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


def is_simulated(obj: bpy.types.Object) -> bool:
    """True if Blender's rigid bodies move an object, or one that it is parented to."""
    node: bpy.types.Object | None = obj
    while node is not None:
        if node.rigid_body and node.rigid_body.type == "ACTIVE":
            return True
        node = node.parent
    return False


def _moved_by_handlers(
    take: Take, armature: str, bones: Sequence[str], props: Sequence[str]
) -> Generator[int, None, bool]:
    """True if frame handlers of others move a rig or objects, from a few frames with them and without."""
    if not moving_handlers() or any(is_simulated(object_named(obj)) for obj in props):
        return False
    objects, frames = [*([armature] if armature else []), *props], take.frames
    with sampling_scene(take.scene, armature, bones, props, handled=True) as name:
        for frame in dict.fromkeys((frames[0], frames[len(frames) // 3], frames[-1])):
            seen: list[Any] = []
            for handled in (False, True):
                if handled:
                    let_handlers_act(still_there(name), frame)
                depsgraph = depsgraph_at(name, frame)
                at = [object_named(obj).evaluated_get(depsgraph) for obj in objects]
                poses = (pose_bones(at[0])[bone].matrix for bone in bones)
                seen.append(np.array([*(obj.matrix_world for obj in at), *poses]))
            yield 0
            if not np.allclose(seen[0], seen[1], rtol=1e-5, atol=1e-5, equal_nan=True):
                return True
    return False


def _simulated_before(world: bpy.types.RigidBodyWorld | None, first: int) -> range:
    """Frames to step through before the first one.

    Rigid bodies exist in their own scene only, and only frame after frame. Those that are baked are read from their
    cache.
    """
    return range(world.point_cache.frame_start, first) if world and not world.point_cache.is_baked else range(0)
