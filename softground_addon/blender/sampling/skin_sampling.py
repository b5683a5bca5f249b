"""The skin of a rig as it is read: its meshes in the rest pose, and the weights by which bones move them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.numerics.arrays import Array, Indices
from ...core.numerics.slices import Slices, sliced
from ...core.rig.bones import envelope
from ...core.rig.rig_skin import RigSkin, Shape
from .. import mesh_arrays
from ..placement import beside
from ..rigs.carried import carrier_of
from ..rigs.libraries import check_libraries
from ..rigs.object_data import armature_of, mesh_of
from ..rigs.worn_rigs import carriers, hung_on, worn_rigs
from ..settings import ObjectName, Objects, name_of, resolve
from .seen_mesh import as_seen, left_out

_SLICE = 2_000
"""Vertices whose weights are read in one slice."""

_LEAST_WEIGHT = 1e-4
"""Weights that come to less leave a vertex where its object is, as in Blender's armature deformation."""


_STAND_INS = ("WIRE", "BOUNDS")

Weights = tuple[Indices, Indices, Array]
"""Vertex, vertex group and weight of every weight of a mesh, (N,) each."""


def meshes_on(objects: Objects, armature: bpy.types.Object) -> list[bpy.types.Object]:
    """The rendered mesh objects that an armature deforms or that hang on its bones; if none is rendered, all of them.

    With those of rigs that it wears, if it has any by itself. Beside rendered ones, those that are not, or that are
    shown as wires or bounds, are mostly stand-ins: collision shapes.
    """
    worn = _worn_by(objects, armature)
    return [obj for obj in worn if not obj.hide_render and obj.display_type not in _STAND_INS] or worn


def has_skin(objects: Objects, armature: bpy.types.Object) -> bool:
    """True if `meshes_on` an armature has any."""
    return any(obj.type == "MESH" and _wears(armature, obj) for obj in objects)


def hidden_on(objects: Objects, armature: bpy.types.Object, bones: Collection[str]) -> list[bpy.types.Object]:
    """The meshes on some bones of an armature that `meshes_on` leaves out, as they are not rendered."""
    read = meshes_on(objects, armature)
    return [obj for obj in _worn_by(objects, armature) if obj not in read and _is_on(obj, armature, bones)]


def left_out_on(objects: Objects, armature: bpy.types.Object, bones: Collection[str]) -> dict[str, list[str]]:
    """Deformers of the meshes on some bones that are not read, by the name of the mesh."""
    on_bones = (obj for obj in meshes_on(objects, armature) if _is_on(obj, armature, bones))
    return {obj.name: names for obj in on_bones if (names := left_out(obj))}


def _is_on(obj: bpy.types.Object, armature: bpy.types.Object, bones: Collection[str]) -> bool:
    carried = carrier_of(obj, armature)
    holding = {group.name for group in obj.vertex_groups} | {bone.name for bone in enveloping(obj, armature)}
    return bool(carried and carried[0] in bones) or bool(holding & set(bones))


def _worn_by(objects: Objects, armature: bpy.types.Object) -> list[bpy.types.Object]:
    worn = [obj for obj in objects if obj.type == "MESH" and _wears(armature, obj)]
    rigs = worn_rigs(objects, armature) if worn else []
    more = (obj for obj in objects if obj.type == "MESH" and any(_wears(rig, obj) for rig in rigs))
    return list(dict.fromkeys([*worn, *more]))


def _wears(armature: bpy.types.Object, obj: bpy.types.Object) -> bool:
    return _deformed_by(obj, armature) or _hangs(obj, armature)


def _deformed_by(obj: bpy.types.Object, armature: bpy.types.Object) -> bool:
    return bool(_modifiers(obj, armature)) or (obj.parent == armature and obj.parent_type == "ARMATURE")


def _hangs(obj: bpy.types.Object, armature: bpy.types.Object) -> bool:
    return (obj.parent_type == "BONE" or not _deformed_by(obj, armature)) and carrier_of(obj, armature) is not None


SHOD = 0.3
"""A body stands on what hangs on its bones and is below it at rest, up to there, in its heights."""


@sliced
def read_skin(
    objects: Objects, armature: bpy.types.Object, weights: dict[str, Weights] | None = None
) -> Slices[RigSkin | None]:
    """The meshes on an armature that `meshes_on` names, or None where there is none.

    Parameters
    ----------
    weights : dict of str to Weights, optional
        Takes the weights of meshes that several objects have, and gives them to the next.

    Raises
    ------
    InputError
        If one is being edited.
    """
    pieces, body = [], name_of(armature)
    rigs = [armature, *worn_rigs(objects, armature)]
    worn = [(obj, next(rig for rig in rigs if _wears(rig, obj))) for obj in meshes_on(objects, armature)]
    for name, rig in [(name_of(obj), name_of(rig)) for obj, rig in worn]:
        obj, armature = resolve(name), resolve(rig)
        if obj.mode == "EDIT":
            raise InputError(f"'{obj.name}', which '{armature.name}' wears, is in Edit Mode: leave it with Tab first.")
        check_libraries(obj)
        with as_seen(obj) as (seen, shapes):
            if not len(mesh_of(resolve(seen)).polygons):
                continue
            if _hangs(obj, armature):
                pieces.append(_hung(resolve(seen), armature, shapes))
            else:
                of_mesh = yield from _weights(seen, weights if seen == name else None)
                pieces.append(_deformed(seen, shapes, name, rig, of_mesh))
        if rig != body:
            pieces[-1] = _carried(pieces[-1], resolve(rig), resolve(body))
        yield
    if not pieces:
        return None
    pieces = _shod(pieces, resolve(body))
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
        shapes=tuple(
            replace(shape, vertices=shape.vertices + start)
            for piece, start in zip(pieces, first[:-1], strict=True)
            for shape in piece.shapes
        ),
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
    shapes: tuple[Shape, ...]
    hung: bool = False


def _shod(pieces: list[_Piece], armature: bpy.types.Object) -> list[_Piece]:
    """Meshes, where what hangs below bones of the skin, and lower than all that is deformed, is no prop, but shoes."""
    up, bones = np.array(armature.matrix_world)[2, :3], armature_of(armature).bones
    heights = [piece.vertices @ up if len(piece.vertices) else np.full(1, np.inf) for piece in pieces]
    deformed = np.concatenate([[], *(height for height, piece in zip(heights, pieces, strict=True) if not piece.hung)])
    deformed = deformed[np.isfinite(deformed)]
    if not len(deformed):
        return pieces
    low, top = deformed.min(), deformed.min() + SHOD * np.ptp(deformed)
    clothed = {name for piece in pieces if not piece.hung for name in piece.names}

    def is_prop(piece: _Piece, height: Array) -> bool:
        below = piece.hung and any(parent.name in clothed for parent in bones[piece.names[0]].parent_recursive)
        return piece.hung and bool(not below or height.min() > low or height.max() > top)

    return [replace(piece, hung=is_prop(piece, height)) for height, piece in zip(heights, pieces, strict=True)]


def _hung(obj: bpy.types.Object, armature: bpy.types.Object, shapes: tuple[Shape, ...]) -> _Piece:
    mesh, carried = mesh_of(obj), carrier_of(obj, armature)
    assert carried, obj.name
    bone, to_armature = carried
    count = len(mesh.vertices)
    return _Piece(
        _moved(to_armature, mesh_arrays.positions(mesh)),
        mesh_arrays.triangles(mesh),
        (bone,),
        np.arange(count),
        np.zeros(count, dtype=np.intp),
        np.ones(count),
        _turned(to_armature, shapes),
        hung=True,
    )


def _carried(piece: _Piece, rig: bpy.types.Object, body: bpy.types.Object) -> _Piece:
    """A mesh on a rig that a body wears, as one on the body's bones that carry it."""
    held = carriers(rig, body)
    rest = hung_on(rig, body) or next(iter(held.values()))
    names, matrices = zip(*(held.get(name, rest) for name in piece.names), strict=True) if piece.names else ((), ())
    bones, number = np.unique(np.array(names, dtype=str), return_inverse=True)
    to_body = np.array([*matrices, rest[1]])
    count = len(piece.vertices)
    alone = np.setdiff1d(np.arange(count), piece.vertex)  # what no bone moves
    vertex = np.append(piece.vertex, alone)
    group = np.append(piece.group, np.full(len(alone), len(names)))
    weight = np.append(piece.weight, np.ones(len(alone)))
    places = np.append(piece.vertices[vertex], np.ones((len(vertex), 1)), axis=1)
    moved = weight[:, None] * np.einsum("nij,nj->ni", to_body[group, :3], places)
    entry, of = np.unique(piece.vertex * len(bones) + number[piece.group], return_inverse=True)
    return _Piece(
        np.stack([np.bincount(vertex, along, count) for along in moved.T], axis=-1),
        piece.triangles,
        tuple(bones.tolist()),
        entry // max(len(bones), 1),
        entry % max(len(bones), 1),
        np.asarray(np.bincount(of, piece.weight, len(entry)), dtype=float),
        _turned(rest[1], piece.shapes),
        piece.hung,
    )


def _deformed(
    name: ObjectName, shapes: tuple[Shape, ...], placed: ObjectName, rig: ObjectName, weights: Weights
) -> _Piece:
    """A mesh of that name where the object `placed` is."""
    vertex, group, weight = weights
    obj, armature = resolve(name), resolve(rig)
    mesh, bones = mesh_of(obj), armature_of(armature).bones
    count = len(mesh.vertices)
    names = tuple(group.name for group in obj.vertex_groups)
    if vertex.max(initial=-1) >= count or group.max(initial=-1) >= len(names):
        raise InputError(f"'{obj.name}' was changed while it was read: try again.")
    by_groups = all(modifier.use_vertex_groups for modifier in _modifiers(resolve(placed), armature))
    deforms = np.array([by_groups and name in bones and bones[name].use_deform for name in names] or [False])[group]
    vertex, group, weight = vertex[deforms], group[deforms], weight[deforms]
    to_armature = beside(resolve(placed), armature)
    points = _moved(to_armature, mesh_arrays.positions(mesh))
    envelopes = enveloping(resolve(placed), armature)
    vertex, group, weight = _with_envelopes(envelopes, points, vertex, group + len(envelopes), weight)
    names = (*(bone.name for bone in envelopes), *names)
    used, group = np.unique(group, return_inverse=True)
    total = np.bincount(vertex, weight, count)
    held = total[vertex] > _LEAST_WEIGHT
    return _Piece(
        points,
        mesh_arrays.triangles(mesh),
        tuple(names[number] for number in used),
        vertex[held],
        group[held],
        weight[held] / total[vertex[held]],
        _turned(to_armature, shapes),
    )


def enveloping(obj: bpy.types.Object, armature: bpy.types.Object) -> list[bpy.types.Bone]:
    """The bones of an armature whose envelopes move what no vertex group holds of a mesh."""
    by_parent = obj.parent == armature and obj.parent_type == "ARMATURE"
    deforms = any([modifier.use_bone_envelopes for modifier in _modifiers(obj, armature)] or [by_parent])
    return [bone for bone in armature_of(armature).bones if bone.use_deform and deforms]


def _modifiers(obj: bpy.types.Object, armature: bpy.types.Object) -> list[bpy.types.ArmatureModifier]:
    return [m for m in obj.modifiers if isinstance(m, bpy.types.ArmatureModifier) and m.object == armature]


def _with_envelopes(
    bones: list[bpy.types.Bone], points: Array, vertex: Indices, group: Indices, weight: Array
) -> tuple[Indices, Indices, Array]:
    """Vertex, group and weight of each weight, with those of envelopes on vertices (V, 3) that no group holds."""
    free = np.setdiff1d(np.arange(len(points)), vertex)
    for number, bone in enumerate(bones):
        ends, radii = np.array([bone.head_local, bone.tail_local]), (bone.head_radius, bone.tail_radius)
        inside = bone.envelope_weight * envelope(points[free], ends, radii, bone.envelope_distance)
        vertex, weight = np.append(vertex, free[inside > 0]), np.append(weight, inside[inside > 0])
        group = np.append(group, np.full(len(vertex) - len(group), number))
    return vertex, group, weight


def _weights(name: ObjectName, weights: dict[str, Weights] | None) -> Slices[Weights]:
    """The weights of a mesh, which can only be read one by one, from those of meshes that were read if it is shared."""
    mesh = mesh_of(resolve(name))
    shared = mesh.name_full if mesh.users > 1 else ""
    if weights and shared in weights:
        return weights[shared]
    read, tables = 0, [np.empty((0, 3))]
    while read < len(vertices := mesh_of(resolve(name)).vertices):
        piece = enumerate(vertices[read : read + _SLICE], read)
        entries = [x for index, vertex in piece for each in vertex.groups for x in (index, each.group, each.weight)]
        tables.append(np.array(entries, dtype=float).reshape(-1, 3))
        read += _SLICE
        yield
    table = np.concatenate(tables)
    of_mesh = table[:, 0].astype(np.intp), table[:, 1].astype(np.intp), table[:, 2]
    if weights is not None and shared:
        weights[shared] = of_mesh
    return of_mesh


def _moved(transform: Array, points: NDArray[np.float32]) -> Array:
    return np.asarray(points @ transform[:3, :3].T + transform[:3, 3], dtype=float)


def _turned(transform: Array, shapes: tuple[Shape, ...]) -> tuple[Shape, ...]:
    return tuple(replace(shape, offset=shape.offset @ transform[:3, :3].T) for shape in shapes)


def _dominant(vertex: Indices, bone: Indices, weight: Array, count: int, none: int) -> Indices:
    """The bone with the largest weight on each vertex."""
    order = np.lexsort((weight, vertex))
    last = np.flatnonzero(np.diff(vertex[order], append=-1))
    part = np.full(count, none, dtype=np.intp)
    part[vertex[order[last]]] = bone[order[last]]
    return part
