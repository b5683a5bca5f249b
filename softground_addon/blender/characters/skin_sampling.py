"""The skin of a rig over time: its meshes as their bones move them, by weights and matrices alone.

No mesh is evaluated: linear blend skinning of a few thousand vertices is exact for what the Armature modifier does and
takes milliseconds, while Blender evaluates every mesh of a scene at every frame.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.motion import Array
from ...core.numerics.slices import Slices, sliced
from ...core.skin.skin_motion import SkinMotion
from ...core.skin.twins import twins
from .. import mesh_arrays
from ..settings import ObjectName, found, name_of
from .recording import Recording

Indices = NDArray[np.intp]

_WELD = 1e-5
"""Vertices nearer than this over the size of the mesh are one."""

_SLICE = 2_000
"""Vertices whose weights are read in one slice."""

_LEAST_WEIGHT = 1e-4
"""Weights that come to less leave a vertex where its object is, as in Blender's armature deformation."""


@dataclass(frozen=True)
class RigSkin:
    """The meshes of a rig in its rest pose, and what moves them.

    Attributes
    ----------
    vertices : (V, 3) float array
        In the armature's space [Blender units].
    triangles : (T, 3) int array
    bones : tuple of str
        Names of the bones that move some vertex; the armature itself is the last part, without a name here.
    weights : tuple of (vertices, weights) for each bone
        Which vertices (N,) a bone moves, and how much (N,).
    part : (V,) int array
        The bone that moves each vertex most, as an index; that of the armature where none does.
    hung : (V,) bool array
        Of objects that hang on a bone instead of being deformed.
    """

    vertices: Array
    triangles: Indices
    bones: tuple[str, ...]
    weights: tuple[tuple[Indices, Array], ...]
    part: Indices
    hung: NDArray[np.bool_]

    def weight_of(self, bones: Collection[str]) -> Array:
        """How much of each vertex some bones move, (V,)."""
        total = np.zeros(len(self.vertices))
        for name, (vertex, weight) in zip(self.bones, self.weights, strict=True):
            if name in bones:
                total[vertex] += weight
        return total


def meshes_on(scene: bpy.types.Scene, armature: bpy.types.Object) -> list[bpy.types.Object]:
    """The rendered mesh objects that an armature deforms or that hang on its bones; if none is rendered, all of them.

    Beside rendered ones, those that are not are mostly stand-ins.
    """
    worn = _worn_by(scene, armature)
    return [obj for obj in worn if not obj.hide_render] or worn


def hidden_on(scene: bpy.types.Scene, armature: bpy.types.Object, bones: Collection[str]) -> list[bpy.types.Object]:
    """The meshes on some bones of an armature that `meshes_on` leaves out, as they are not rendered."""
    read = meshes_on(scene, armature)
    left_out = (obj for obj in _worn_by(scene, armature) if obj not in read)
    return [
        obj for obj in left_out if obj.parent_bone in bones or {group.name for group in obj.vertex_groups} & set(bones)
    ]


def _worn_by(scene: bpy.types.Scene, armature: bpy.types.Object) -> list[bpy.types.Object]:
    return [
        obj for obj in scene.objects if obj.type == "MESH" and (_deformed_by(obj, armature) or _hangs(obj, armature))
    ]


def _deformed_by(obj: bpy.types.Object, armature: bpy.types.Object) -> bool:
    return any(m.type == "ARMATURE" and m.object == armature for m in obj.modifiers) or (
        obj.parent == armature and obj.parent_type == "ARMATURE"
    )


def _hangs(obj: bpy.types.Object, armature: bpy.types.Object) -> bool:
    return obj.parent == armature and obj.parent_type == "BONE" and obj.parent_bone in armature.data.bones


@sliced
def read_skin(scene: bpy.types.Scene, armature: bpy.types.Object) -> Slices[RigSkin | None]:
    """The meshes on an armature that `meshes_on` names, or None where there is none.

    Raises
    ------
    InputError
        If one is being edited.
    """
    pieces, rig = [], name_of(armature)
    for name in [name_of(obj) for obj in meshes_on(scene, armature)]:
        obj, armature = found(name), found(rig)
        if obj.mode == "EDIT":
            raise InputError(f"'{obj.name}', which '{armature.name}' wears, is in Edit Mode: leave it with Tab first.")
        if not len(_mesh_of(obj).polygons):
            continue
        if _hangs(obj, armature):
            pieces.append(_hung(obj, armature))
        else:
            pieces.append((yield from _deformed(name, rig)))
        yield
    if not pieces:
        return None
    bones = tuple(dict.fromkeys(name for piece in pieces for name in piece.names))
    place = {name: number for number, name in enumerate(bones)}
    first = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    vertex = np.concatenate([piece.vertex + start for piece, start in zip(pieces, first[:-1], strict=True)])
    numbers = [np.array([place[name] for name in piece.names], dtype=np.intp) for piece in pieces]
    bone = np.concatenate([number[piece.group] for number, piece in zip(numbers, pieces, strict=True)])
    weight = np.concatenate([piece.weight for piece in pieces])
    return RigSkin(
        vertices=np.concatenate([piece.vertices for piece in pieces]),
        triangles=np.concatenate([piece.triangles + start for piece, start in zip(pieces, first[:-1], strict=True)]),
        bones=bones,
        weights=tuple((vertex[bone == number], weight[bone == number]) for number in range(len(bones))),
        part=_dominant(vertex, bone, weight, int(first[-1]), len(bones)),
        hung=np.concatenate([np.full(len(piece.vertices), piece.hung) for piece in pieces]),
    )


@dataclass(frozen=True)
class _Piece:
    """One mesh: its vertices in the armature's space, and the weights that bones have on them."""

    vertices: Array
    triangles: Indices
    names: tuple[str, ...]
    vertex: Indices
    group: Indices
    weight: Array
    hung: bool = False


def _mesh_of(obj: bpy.types.Object) -> bpy.types.Mesh:
    mesh = obj.data
    assert isinstance(mesh, bpy.types.Mesh), obj.name
    return mesh


def _hung(obj: bpy.types.Object, armature: bpy.types.Object) -> _Piece:
    mesh, bone = _mesh_of(obj), armature.data.bones[obj.parent_bone]
    parent = np.eye(4)
    if not bone.use_relative_parent:
        parent = np.array(bone.matrix_local)
        parent[:3, 3] += parent[:3, 1] * bone.length
    to_armature = parent @ np.array(obj.matrix_parent_inverse @ obj.matrix_basis)
    count = len(mesh.vertices)
    return _Piece(
        _moved(to_armature, mesh_arrays.positions(mesh)),
        mesh_arrays.triangles(mesh),
        (bone.name,),
        np.arange(count),
        np.zeros(count, dtype=np.intp),
        np.ones(count),
        hung=True,
    )


def _deformed(name: ObjectName, rig: ObjectName) -> Slices[_Piece]:
    vertex, group, weight = yield from _weights(name)
    obj, armature = found(name), found(rig)
    mesh, bones = _mesh_of(obj), armature.data.bones
    count = len(mesh.vertices)
    names = tuple(group.name for group in obj.vertex_groups)
    if vertex.max(initial=-1) >= count or group.max(initial=-1) >= len(names):
        raise InputError(f"'{obj.name}' was changed while it was read: try again.")
    deforms = np.array([name in bones and bones[name].use_deform for name in names] or [False])[group]
    vertex, group, weight = vertex[deforms], group[deforms], weight[deforms]
    used, group = np.unique(group, return_inverse=True)
    total = np.bincount(vertex, weight, count)
    held = total[vertex] > _LEAST_WEIGHT
    to_armature = np.array(armature.matrix_world.inverted_safe() @ obj.matrix_world)
    return _Piece(
        _moved(to_armature, mesh_arrays.positions(mesh)),
        mesh_arrays.triangles(mesh),
        tuple(names[number] for number in used),
        vertex[held],
        group[held],
        weight[held] / total[vertex[held]],
    )


def _weights(name: ObjectName) -> Slices[tuple[Indices, Indices, Array]]:
    """Vertex, group and weight of every weight of a mesh, which can only be read one by one."""
    read, tables = 0, [np.empty((0, 3))]
    while read < len(vertices := _mesh_of(found(name)).vertices):
        some = enumerate(vertices[read : read + _SLICE], read)
        entries = [x for index, vertex in some for each in vertex.groups for x in (index, each.group, each.weight)]
        tables.append(np.array(entries, dtype=float).reshape(-1, 3))
        read += _SLICE
        yield
    table = np.concatenate(tables)
    return table[:, 0].astype(np.intp), table[:, 1].astype(np.intp), table[:, 2]


def _moved(transform: Array, points: NDArray[np.float32]) -> Array:
    return np.asarray(points @ transform[:3, :3].T + transform[:3, 3], dtype=float)


def _dominant(vertex: Indices, bone: Indices, weight: Array, count: int, none: int) -> Indices:
    """The bone with the largest weight on each vertex."""
    order = np.lexsort((weight, vertex))
    last = np.flatnonzero(np.diff(vertex[order], append=-1))
    part = np.full(count, none, dtype=np.intp)
    part[vertex[order[last]]] = bone[order[last]]
    return part


@sliced
def skinned(
    skin: RigSkin, armature: bpy.types.Object, recording: Recording, chosen: Indices, *, axes: slice = slice(3)
) -> Slices[NDArray[np.float32]]:
    """World positions of the chosen vertices over time, (F, N, 3) [m], or some of their `axes`.

    Parameters
    ----------
    skin : RigSkin
    armature : bpy.types.Object
    recording : Recording
        Of all `skin.bones`.
    chosen : (N,) int array
    """
    place = np.full(len(skin.vertices), -1, dtype=np.intp)
    place[chosen] = np.arange(len(chosen))
    rest = np.column_stack([skin.vertices, np.ones(len(skin.vertices))])
    backs = [np.linalg.inv(np.array(armature.data.bones[name].matrix_local, dtype=float)) for name in skin.bones]
    frames, rows = len(recording.frames), len(range(3)[axes])
    result = np.zeros((frames, rows, len(chosen)), dtype=np.float32)  # one product for all frames is the fastest
    held = np.zeros(len(chosen), dtype=bool)
    for name, back, (moved_by, weights) in zip(skin.bones, backs, skin.weights, strict=True):
        here = place[moved_by] >= 0
        if not here.any():
            continue
        vertex, weight = moved_by[here], weights[here]
        moved = (recording.bone(name) @ back)[:, :3][:, axes].reshape(-1, 4).astype(np.float32)
        weighted = (weight[:, None] * rest[vertex]).T.astype(np.float32)
        result[..., place[vertex]] += (moved @ weighted).reshape(frames, rows, -1)
        held[place[vertex]] = True
        yield
    if not held.all():
        unheld = recording.armature[:, :3][:, axes].reshape(-1, 4)
        result[..., ~held] = (unheld @ rest[chosen[~held]].T).reshape(frames, rows, -1)
    return np.swapaxes(result, 1, 2)


_PROBES = 8
"""Poses in which the vertices near the ground are looked for."""

_NEAR = 0.15
"""Vertices that never come this near to the lowest are left out, in body heights."""

_MOST_POINTS = 1500
"""Vertices that are followed at most."""

_MOST_PLACES = 6_000_000
"""The same times the samples, so that long shots fit into memory."""


@dataclass(frozen=True)
class FollowedSkin:
    """The skin near the ground over time.

    Attributes
    ----------
    motion : SkinMotion
    bones : tuple of str
        Bone of each part of the motion; empty where only the armature moves it.
    """

    motion: SkinMotion
    bones: tuple[str, ...]


@sliced
def followed_skin(
    skin: RigSkin, armature: bpy.types.Object, recording: Recording, rate: float, *, linked: bool = False
) -> Slices[FollowedSkin | None]:
    """Some vertices over time, by which the contacts of a rig are found, or None where it is flat or nowhere.

    Parameters
    ----------
    skin : RigSkin
    armature : bpy.types.Object
    recording : Recording
        Of all `skin.bones`.
    rate : float
        Samples per second [Hz].
    linked : bool
        Whether to tell which parts hang together, and which are mirror images.
    """
    rig = name_of(armature)
    body = np.flatnonzero(~carried(skin, armature))
    probes = recording.of(np.unique(np.linspace(0, len(recording.frames) - 1, _PROBES).astype(int)))
    height = (yield from skinned.slices(skin, armature, probes, body, axes=slice(2, 3)))[..., 0]
    size = float(np.median(np.ptp(height, axis=1)))
    if not 0 < size < np.inf:
        return None
    above = (height - height.min(axis=1, keepdims=True)).min(axis=0)
    chosen = body[above < _NEAR * size]
    chosen = chosen[np.argsort(skin.part[chosen], kind="stable")]
    most = min(_MOST_POINTS, max(_MOST_PLACES // len(recording.frames), 1))
    chosen = chosen[_thinned(np.unique(skin.part[chosen], return_counts=True)[1], most)]
    used, part = np.unique(skin.part[chosen], return_inverse=True)
    yield
    places = yield from skinned.slices(skin, found(rig), recording, chosen)
    if not np.isfinite(places).all():
        return None
    yield
    links = twin = None
    if linked:
        links = _links(skin, found(rig))[np.ix_(used, used)]
        yield
        place = np.full(len(skin.bones) + 1, -1)
        place[used] = np.arange(len(used))
        twin = place[twins(skin.vertices[body], skin.part[body], len(place))[used]]
    motion = SkinMotion(places, part, links, rate, size, twin)
    return FollowedSkin(motion, tuple((*skin.bones, "")[number] for number in used))


def _thinned(counts: Indices, most: int) -> NDArray[np.bool_]:
    """Which points to follow of parts with so many each (P,): of large parts fewer, evenly, until `most` are left."""
    ordered = np.sort(counts)
    caps = (most - np.cumsum(ordered) + ordered) / np.arange(len(counts), 0, -1)
    cap = caps[(caps <= ordered).argmax()] if counts.sum() > most else ordered[-1]
    count = np.repeat(counts, counts)
    rank = np.arange(len(count)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = np.minimum(max(cap, 1) / count, 1.0)
    return np.asarray(np.floor((rank + 1) * share + 1e-9) > np.floor(rank * share + 1e-9))


def carried(skin: RigSkin, armature: bpy.types.Object) -> NDArray[np.bool_]:
    """Vertices of what a character carries: hung on bones that hang from bones with a skin.

    A robot of rigid pieces has no such skin above them; there they are its body.
    """
    bones = armature.data.bones
    clothed = {skin.bones[number] for number in np.unique(skin.part[~skin.hung]) if number < len(skin.bones)}
    carries = [any(above.name in clothed for above in bones[name].parent_recursive) for name in skin.bones]
    return skin.hung & np.array([*carries, False])[skin.part]


def _links(skin: RigSkin, armature: bpy.types.Object) -> NDArray[np.bool_]:
    """Which parts hang together, by welded skin or as parent and child, (P, P) with the armature's own last."""
    count = len(skin.bones) + 1
    links = np.zeros((count, count), dtype=bool)
    corners = skin.part[skin.triangles]
    for one, other in ((0, 1), (1, 2), (2, 0)):
        links[corners[:, one], corners[:, other]] = True
    # Imported meshes are cut open along their edges: vertices in one place are one.
    size = max(float(np.ptp(skin.vertices, axis=0).max()), 1e-12)
    _, place = np.unique(np.round(skin.vertices / (_WELD * size)), axis=0, return_inverse=True)
    order = np.lexsort((skin.part, place.ravel()))
    same = np.diff(place.ravel()[order]) == 0
    links[skin.part[order[1:]][same], skin.part[order[:-1]][same]] = True
    number = {name: index for index, name in enumerate(skin.bones)}
    for name, index in number.items():
        above = next((bone.name for bone in armature.data.bones[name].parent_recursive if bone.name in number), None)
        if above:
            links[index, number[above]] = True
    return np.asarray(links | links.T)
