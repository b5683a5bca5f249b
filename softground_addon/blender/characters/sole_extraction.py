"""Soles of a rig: from the meshes that hang on its feet where there are any, else from the lengths of its bones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.motion.motion import Array
from ...core.soles.foot_attitude import FlatFoot, FootSize
from ...core.soles.soles import ANKLE_POSITION, PlacedSole, anatomical_sole, sole_from_underside
from .. import mesh_arrays
from .rig_mapping import RigMapping, SoleSource

_REACH = 2.0
"""How far around a bone of the foot its skin is looked for, in its lengths; at least as far as the shank is long."""

_OWNED = 0.5
"""A vertex belongs to the foot when the foot's bones hold more than this share of its weight."""

_FEWEST_TRIANGLES = 4


@dataclass(frozen=True)
class FootMesh:
    """The part of the character's meshes that moves with one foot, in the rest pose.

    Attributes
    ----------
    vertices : (V, 3) float array
        World positions in the rest pose [m].
    toe_weight : (V,) float array
        How much of each vertex moves with the toes.
    triangles : (T, 3) int array
    """

    vertices: Array
    toe_weight: Array
    triangles: NDArray[np.intp]


def foot_sole(
    source: SoleSource, flat: FlatFoot, size: FootSize, mesh: FootMesh | None, *, has_toes: bool, mirrored: bool
) -> PlacedSole:
    """Sole of a foot, in the frame of `flat`.

    Parameters
    ----------
    source : SoleSource
    flat : FlatFoot
        How the foot stands.
    size : FootSize
        What the bones tell; not used where there is a mesh.
    mesh : FootMesh or None
    has_toes : bool
        Whether the toes bend.
    mirrored : bool
        Whether the armature is mirrored (negative scale), so that a foot named left has the shape of a right one.

    Raises
    ------
    InputError
        If the foot's mesh has no underside.
    """
    if mesh is not None:
        return sole_from_underside(
            _flattened(mesh, flat),
            mesh.triangles,
            name=source.name,
            side=source.side,
            ball=flat.ball if has_toes else None,
        )
    behind = ANKLE_POSITION * size.length
    placed = anatomical_sole(
        size.length,
        name=source.name,
        side=source.side,
        ball=behind + flat.ball if has_toes else None,
        medial={"L": -1.0, "R": 1.0}.get(source.side, 0.0) * (-1 if mirrored else 1),
    )
    return PlacedSole(placed.sole, placed.placements + _shift(-behind, -size.ankle_height))


def _shift(x: float, z: float) -> Array:
    shift = np.zeros((4, 4))
    shift[0, 3], shift[2, 3] = x, z
    return shift


def _flattened(mesh: FootMesh, flat: FlatFoot) -> Array:
    """Vertices in the sole frame with foot and toes laid flat, by linear blend skinning."""
    foot = _moved(np.linalg.inv(flat.foot_frame), mesh.vertices)
    toe = _moved(np.linalg.inv(flat.toe_frame), mesh.vertices)
    weight = mesh.toe_weight[:, None]
    return (1 - weight) * foot + weight * toe


def _moved(transform: Array, points: Array) -> Array:
    return points @ transform[:3, :3].T + transform[:3, 3]


def find_foot_meshes(
    scene: bpy.types.Scene, armature: bpy.types.Object, sources: Iterable[SoleSource], rest_world: Array
) -> dict[str, FootMesh]:
    """The meshes on each foot, by name of the sole.

    Parameters
    ----------
    scene : bpy.types.Scene
        Where to look for meshes; only read.
    armature : bpy.types.Object
    sources : iterable of SoleSource
    rest_world : (4, 4) float array
        Armature space to world in the rest pose [m].
    """
    return _find_meshes(
        scene,
        armature,
        {source.name: bone_families(armature, source) for source in sources if source.bone},
        rest_world,
    )


def find_limb_meshes(
    scene: bpy.types.Scene, armature: bpy.types.Object, mapping: RigMapping, rest_world: Array
) -> dict[str, FootMesh]:
    """The meshes on each limb that prints, by name of the sole: what moves with its bone, up to the next joints."""
    families = {
        source.name: (limb_family(armature, source, mapping), frozenset[str]())
        for source in mapping.soles
        if source.limb and not source.object
    }
    return _find_meshes(scene, armature, families, rest_world)


def limb_family(armature: bpy.types.Object, source: SoleSource, mapping: RigMapping) -> frozenset[str]:
    """Names of the bones that move with a limb, up to the next joints and soles."""
    joints = {bone for bone, end in mapping.joints.values() if end == "head"}
    soles = {bone for other in mapping.soles for bone in (other.bone, other.toe_bone) if bone}
    family, waiting = set(), [armature.data.bones[source.bone]]
    while waiting:
        bone = waiting.pop()
        family.add(bone.name)
        waiting += [child for child in bone.children if child.name not in joints | soles]
    return frozenset(family)


def _find_meshes(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    groups: Mapping[str, tuple[frozenset[str], frozenset[str]]],
    rest_world: Array,
) -> dict[str, FootMesh]:
    """The meshes on some families of bones.

    Raises
    ------
    InputError
        If one is being edited.
    """
    pieces: dict[str, list[FootMesh]] = {}
    if not groups:
        return {}
    for thing in meshes_on(scene, armature):
        if thing.mode == "EDIT":
            raise InputError(
                f"'{thing.name}', which '{armature.name}' wears, is in Edit Mode: leave it with Tab first."
            )
        if _deformed_by(thing, armature):
            to_armature = np.array(armature.matrix_world.inverted_safe() @ thing.matrix_world)
            found = _weighted_parts(thing, armature, groups, rest_world, to_armature)
        else:
            found = _rigid_part(thing, armature, groups, rest_world)
        for name, part in found.items():
            pieces.setdefault(name, []).append(part)
    return {
        name: _joined(parts)
        for name, parts in pieces.items()
        if sum(len(p.triangles) for p in parts) >= _FEWEST_TRIANGLES
    }


def meshes_on(scene: bpy.types.Scene, armature: bpy.types.Object) -> list[bpy.types.Object]:
    """The rendered mesh objects that an armature deforms or that hang on its bones."""
    return [
        thing
        for thing in scene.objects
        if thing.type == "MESH"
        and not thing.hide_render
        and (_deformed_by(thing, armature) or (thing.parent == armature and thing.parent_type == "BONE"))
    ]


def bone_families(armature: bpy.types.Object, source: SoleSource) -> tuple[frozenset[str], frozenset[str]]:
    """Names of the bones that move with the foot and, of these, with the toes."""
    bones = armature.data.bones
    toes: frozenset[str] = frozenset()
    if source.toe_bone in bones:
        toe = bones[source.toe_bone]
        toes = frozenset((toe.name, *(bone.name for bone in toe.children_recursive)))
    foot = bones[source.bone]
    return frozenset((foot.name, *(bone.name for bone in foot.children_recursive))) | toes, toes


def _deformed_by(thing: bpy.types.Object, armature: bpy.types.Object) -> bool:
    return any(m.type == "ARMATURE" and m.object == armature for m in thing.modifiers) or (
        thing.parent == armature and thing.parent_type == "ARMATURE"
    )


def _weighted_parts(
    thing: bpy.types.Object,
    armature: bpy.types.Object,
    groups: Mapping[str, tuple[frozenset[str], frozenset[str]]],
    rest_world: Array,
    to_armature: Array,
) -> dict[str, FootMesh]:
    """Parts of a skinned mesh that belong to each foot."""
    names = {group.index: group.name for group in thing.vertex_groups}
    feet = frozenset(name for family, _ in groups.values() for name in family)
    if not feet.intersection(names.values()):
        return {}
    bones = frozenset(names.values())
    vertices, triangles = _read_mesh(thing)
    vertex, group, weight = _read_weights(thing, _near_feet(armature, feet, _moved(to_armature, vertices)))
    count = len(vertices)
    group_name = np.array([names.get(index, "") for index in range(max(names, default=0) + 1)])
    total = np.bincount(vertex, weight, count)
    parts = {}
    for name, (family, toes) in groups.items():
        if not family & bones:
            continue
        in_foot = np.isin(group_name, list(family))[group]
        in_toes = np.isin(group_name, list(toes))[group] if toes else np.zeros(len(group), dtype=bool)
        foot_weight = np.bincount(vertex[in_foot], weight[in_foot], count)
        toe_weight = np.bincount(vertex[in_toes], weight[in_toes], count)
        owned = foot_weight > _OWNED * np.maximum(total, 1e-9)
        chosen = triangles[owned[triangles].all(axis=1)]
        if len(chosen):
            share = toe_weight / np.maximum(foot_weight, 1e-9)
            parts[name] = FootMesh(_moved(rest_world @ to_armature, vertices), np.clip(share, 0.0, 1.0), chosen)
    return parts


def _rigid_part(
    thing: bpy.types.Object,
    armature: bpy.types.Object,
    groups: Mapping[str, tuple[frozenset[str], frozenset[str]]],
    rest_world: Array,
) -> dict[str, FootMesh]:
    """A mesh parented to a bone of a foot, as it sits in the rest pose."""
    bone = armature.data.bones.get(thing.parent_bone)
    if bone is None:
        return {}
    parent = np.eye(4)
    if not bone.use_relative_parent:
        parent = np.array(bone.matrix_local)
        parent[:3, 3] += parent[:3, 1] * bone.length
    to_world = rest_world @ parent @ np.array(thing.matrix_parent_inverse @ thing.matrix_basis)
    vertices, triangles = _read_mesh(thing)
    return {
        name: FootMesh(_moved(to_world, vertices), np.full(len(vertices), float(bone.name in toes)), triangles)
        for name, (family, toes) in groups.items()
        if bone.name in family
    }


def _joined(parts: list[FootMesh]) -> FootMesh:
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return FootMesh(
        vertices=np.concatenate([part.vertices for part in parts]),
        toe_weight=np.concatenate([part.toe_weight for part in parts]),
        triangles=np.concatenate([part.triangles + start for part, start in zip(parts, first[:-1], strict=True)]),
    )


def _read_mesh(thing: bpy.types.Object) -> tuple[Array, NDArray[np.intp]]:
    """Vertices (V, 3) and triangles (T, 3) of a mesh object as modelled."""
    mesh = _mesh_of(thing)
    return mesh_arrays.positions(mesh).astype(float), mesh_arrays.triangles(mesh)


def _near_feet(armature: bpy.types.Object, feet: frozenset[str], points: Array) -> NDArray[np.intp]:
    """Which of the points, in armature space, are near enough to a bone of the feet to be moved by it."""
    near = np.zeros(len(points), dtype=bool)
    for name in feet & set(armature.data.bones.keys()):
        bone = armature.data.bones[name]
        ends = np.array([bone.head_local, bone.tail_local])
        reach = max(_REACH * bone.length, bone.parent.length if bone.parent else 0.0)
        near |= ((points > ends.min(axis=0) - reach) & (points < ends.max(axis=0) + reach)).all(axis=1)
    return np.flatnonzero(near)


def _read_weights(
    thing: bpy.types.Object, wanted: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Vertex, group and weight of every weight of the wanted vertices, which can only be read one by one."""
    vertices = _mesh_of(thing).vertices
    entries = [(index, group.group, group.weight) for index in wanted.tolist() for group in vertices[index].groups]
    table = np.array(entries, dtype=float).reshape(-1, 3)
    return table[:, 0].astype(np.intp), table[:, 1].astype(np.intp), table[:, 2]


def _mesh_of(thing: bpy.types.Object) -> bpy.types.Mesh:
    mesh = thing.data
    assert isinstance(mesh, bpy.types.Mesh), thing.name
    return mesh
