"""Soles of a rig: from the meshes that hang on its feet where there are any, else from the lengths of its bones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from ..soles.foot_attitude import FlatFoot, FootSize
from ..soles.soles import ANKLE_POSITION, PlacedSole, anatomical_sole, sole_from_underside
from .bones import RigBones, family
from .mapping import RigMapping, SoleSource
from .rig_skin import RigSkin

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
        Share of each vertex that moves with the toes.
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
    flat : FlatFoot
        Attitude of the standing foot.
    size : FootSize
        Size by the bones; not used where there is a mesh.
    has_toes : bool
        True if the toes bend.
    mirrored : bool
        True if the armature is mirrored (negative scale), so that a foot named left has the shape of a right one.

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
            toe_weight=mesh.toe_weight,
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


def skin_meshes(
    skin: RigSkin | None, families: Mapping[str, tuple[frozenset[str], frozenset[str]]], rest_world: Array
) -> dict[str, FootMesh]:
    """The parts of a skin that move with families of bones, by name; families with hardly any skin have none.

    Parameters
    ----------
    families : mapping of str to (bones, toes)
        Names of the bones, and of those among them that are toes.
    rest_world : (4, 4) float array
        Armature space to world in the rest pose [m].
    """
    if skin is None:
        return {}
    meshes = {}
    for name, (members, toes) in families.items():
        weight = skin.weight_of(members)
        used, triangles = np.unique(skin.triangles[(weight > _OWNED)[skin.triangles].all(axis=1)], return_inverse=True)
        if triangles.size >= 3 * _FEWEST_TRIANGLES:
            toe_weight = np.clip(skin.weight_of(toes)[used] / weight[used], 0.0, 1.0)
            meshes[name] = FootMesh(_moved(rest_world, skin.vertices[used]), toe_weight, triangles.reshape(-1, 3))
    return meshes


def limb_family(bones: RigBones, source: SoleSource, mapping: RigMapping) -> frozenset[str]:
    """Names of the bones that move with a limb, up to the next joints and soles."""
    joints = {bone for bone, end in mapping.joints.values() if end == "head"}
    soles = {bone for other in mapping.soles for bone in (other.bone, other.toe_bone) if bone}
    return family(bones, source.bone, joints | soles)


def bone_families(bones: RigBones, source: SoleSource) -> tuple[frozenset[str], frozenset[str]]:
    """Names of the bones that move with the foot and, of these, with the toes."""
    toes = family(bones, source.toe_bone) if source.toe_bone in bones else frozenset[str]()
    return family(bones, source.bone) | toes, toes
