"""Bodies that no armature moves, read frame by frame from their evaluated meshes; the user's scene is only read.

Rigid parts under an empty, shape keys and mesh caches are one to it: vertices over time.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.ground_frame import GroundFrame
from ...core.motion.motion import CharacterMotion
from ...core.rig.bare_body import BareBody, bare_body, body_motion, recorded
from ...core.rig.mapping import RigMapping
from ...core.rig.recording import Recording, Timeline
from ...core.settings import ObjectName
from .. import mesh_arrays
from ..placement import units_about, world_matrix
from ..rigs.frame_ranges import frames_with_shapes
from ..rigs.libraries import check_libraries
from ..rigs.object_data import mesh_of
from ..rigs.rig_mapping import parts_of
from ..settings import resolve, timeline_of
from .rig_checks import check_frames, check_mass
from .sampling_scene import depsgraph_at, object_named, sampling_scene
from .take import Take

POSES = 24
"""Poses of the whole animation by which parts that move together are found, whatever frames are baked."""

FARTHEST = 1e6
"""Largest coordinate that a vertex may have [m]."""

_CACHES = ("MESH_CACHE", "MESH_SEQUENCE_CACHE")


def meshes_of(body: bpy.types.Object) -> list[bpy.types.Object]:
    """The mesh objects of a body: itself, or the rendered ones below an empty; if none is rendered, all of them."""
    parts = [body] if body.type == "MESH" else parts_of(body)
    return [part for part in parts if not part.hide_render] or parts


def deforms(obj: bpy.types.Object) -> bool:
    """True if shape keys over time or a mesh cache move the vertices of a mesh that no armature does."""
    if obj.type != "MESH" or obj.find_armature():
        return False
    keys = mesh_of(obj).shape_keys
    return bool(keys and keys.animation_data) or any(m.type in _CACHES and m.show_viewport for m in obj.modifiers)


def body_frames(timeline: Timeline, body: bpy.types.Object) -> tuple[int, int]:
    """First and last frame of the scene in which a body is animated; all of it for caches."""
    return frames_with_shapes(timeline, [body, *meshes_of(body)])


def read_body(
    scene: bpy.types.Scene, name: ObjectName, known: Collection[str] = ()
) -> Generator[int | None, None, BareBody]:
    """The parts of a body, from poses over its whole animation.

    Parameters
    ----------
    name : ObjectName
        An empty above mesh objects, or a mesh object.
    known : collection of str
        Names that parts had.

    Raises
    ------
    InputError
        If its meshes cannot be read, or are other ones from frame to frame.
    """
    body = resolve(name)
    for mesh in meshes_of(body):
        check_libraries(mesh)
        if mesh.mode == "EDIT":
            raise InputError(f"'{mesh.name}', which prints, is in Edit Mode: leave it with Tab first.")
    first, last = body_frames(timeline_of(scene), body)
    poses = np.unique(np.linspace(first, last, POSES).round().astype(int)).tolist()
    objects = [mesh.name_full for mesh in meshes_of(body)]
    positions, counts, triangles = yield from _positions(scene, objects, poses, None, units_about(scene, body).frame)
    if not len(triangles):
        raise InputError(f"'{name.name}' has no faces to print with: give its mesh faces, or select another object.")
    return (yield from bare_body.slices(positions, triangles, list(zip(objects, counts, strict=True)), known))


def record_body(take: Take, name: ObjectName, body: BareBody) -> Generator[int, None, Recording]:
    """Poses of the parts of a body over time; yields the number of frames read, and raises as `read_body` does."""
    objects = [mesh.name_full for mesh in meshes_of(resolve(name))]
    positions, counts, _ = yield from _positions(take.scene, objects, take.frames, body.followed, take.units.frame)
    if sum(counts) != len(body.skin.vertices):
        raise InputError(f"The meshes of '{name.name}' were changed while they were read: try again.")
    return recorded(body, positions, take.frames, take.units)


def sample_body(
    take: Take, name: ObjectName, mapping: RigMapping, *, mass: float, skin_mass: float = 0.0
) -> Generator[int | None, None, CharacterMotion]:
    """Read a body without an armature frame by frame.

    Parameters
    ----------
    name : ObjectName
        As for `read_body`.
    mapping : RigMapping
        Its soles are on parts.
    take, mass, skin_mass
        As for `rig_sampling.sample_character`; and so is what it yields, returns and raises.
    """
    check_mass(name.name, mass)
    check_frames(take.frames)
    bones = [bone for source in mapping.soles for bone in (source.bone, source.toe_bone, *source.parts)]
    body = yield from read_body(take.scene, name, bones)
    for source in mapping.soles:
        missing = [bone for bone in (source.bone, source.toe_bone) if bone and bone not in body.bones]
        if source.object or missing:
            what = f"object '{source.object}'" if source.object else f"part '{missing[0]}'"
            raise InputError(
                f"Contact '{source.name}' of '{name.name}' has no {what} that moves with it: remove the contact, or "
                "remove the character and press Add Character again."
            )
    recording = yield from record_body(take, name, body)
    return (yield from body_motion(name.name, body, mapping, recording, mass=mass, skin_mass=skin_mass))


def _positions(
    scene: bpy.types.Scene,
    objects: Sequence[str],
    frames: Sequence[int],
    chosen: NDArray[np.intp] | None = None,
    frame_of_ground: GroundFrame | None = None,
) -> Generator[int, None, tuple[NDArray[np.float32], list[int], NDArray[np.intp]]]:
    """Positions (F, V, 3) of vertices of some objects, or of the `chosen` ones, in the world or a ground's frame
    [Blender units]; the number of vertices of each object, and all triangles (T, 3)."""
    rows: list[NDArray[np.float32]] = []
    counts: list[int] = []
    with sampling_scene(scene, "", (), (), meshes=objects) as temporary:
        for done, frame in enumerate(frames):
            depsgraph = depsgraph_at(temporary, frame)
            pieces, triangles, first = [], [], 0
            for evaluated in (object_named(obj).evaluated_get(depsgraph) for obj in objects):
                matrix, mesh = np.array(evaluated.matrix_world), mesh_of(evaluated)
                if frame_of_ground:
                    matrix = frame_of_ground.from_world([frame])[0] @ world_matrix(evaluated)
                pieces.append(mesh_arrays.positions(mesh) @ matrix[:3, :3].T + matrix[:3, 3])
                if not rows:
                    triangles.append(mesh_arrays.triangles(mesh) + first)
                    first += len(pieces[-1])
            if not rows:
                faces, counts = np.concatenate(triangles), [len(piece) for piece in pieces]
            for obj, piece, count in zip(objects, pieces, counts, strict=True):
                if len(piece) != count:
                    raise InputError(
                        f"'{obj}' has {len(piece):,} vertices at frame {frame} and {count:,} before: no part can be "
                        "followed. Cache it again with as many vertices in all frames, or switch off what changes them."
                    )
                if not (np.abs(piece) <= FARTHEST).all():
                    raise InputError(f"'{obj}' has vertices without a valid position at frame {frame}: mend its mesh.")
            everywhere = np.concatenate(pieces).astype(np.float32)
            rows.append(everywhere if chosen is None else everywhere[chosen])
            yield done + 1
    return np.stack(rows), counts, faces
