"""A body for any rig that has none, such as an imported motion file: a rounded stick along each bone."""

from __future__ import annotations

from collections.abc import Collection

import bpy
import numpy as np
from numpy.typing import NDArray

from sample_scenes.stage import plain_material

Array = NDArray[np.float64]

_AROUND = 12  # vertices around a stick
_CAP = 4  # rings over each rounded end
_SLENDERNESS = 7.0  # length of a bone over its stick's radius
_THICKEST = 0.034  # radius over the height of the rig


def add_stick_figure(
    armature: bpy.types.Object, collection: bpy.types.Collection, only: Collection[str] | None = None
) -> bpy.types.Object | None:
    """A mesh of sticks that follows the rig, each stick with the weight of its own bone only; None without bones.

    `only` names the bones to draw, for rigs with helper bones.
    """
    lines = _lines(armature.data, only)
    if not lines:
        return None
    height = np.ptp(np.concatenate([line for _, *line in lines]), axis=0).max()
    vertices, faces, groups = [], [], []
    for bone, head, tail in lines:
        length = np.linalg.norm(tail - head)
        if length < 1e-3 * height:
            continue
        radius = min(length / _SLENDERNESS + 0.014 * height, _THICKEST * height)
        stick, quads = _stick(head, tail, radius, 0.8 * radius)
        first = len(vertices) * len(stick)
        vertices.append(stick)
        faces += (quads + first).tolist()
        groups.append((bone, range(first, first + len(stick))))

    mesh = bpy.data.meshes.new(f"{armature.name} Figure")
    mesh.from_pydata(np.concatenate(vertices).tolist(), [], faces)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), dtype=bool))
    mesh.materials.append(plain_material("SoftGround Sample stick", (0.42, 0.055, 0.035), 0.5))
    figure = bpy.data.objects.new(mesh.name, mesh)
    collection.objects.link(figure)
    for bone in armature.data.bones:
        figure.vertex_groups.new(name=bone.name)
    for bone, stick in groups:
        figure.vertex_groups[bone].add(stick, 1.0, "REPLACE")
    figure.parent = armature
    figure.modifiers.new("Armature", "ARMATURE").object = armature
    return figure


def _lines(rest: bpy.types.Armature, only: Collection[str] | None) -> list[tuple[str, Array, Array]]:
    """What to draw, each with the bone that carries it: the bones, and what joins them where they do not touch."""
    lines = []
    for bone in rest.bones:
        if only is not None and bone.name not in only:
            continue
        head, tail = np.array(bone.head_local), np.array(bone.tail_local)
        lines.append((bone.name, head, tail))
        if bone.parent and (only is None or bone.parent.name in only):
            ends = [np.array(bone.parent.head_local), np.array(bone.parent.tail_local)]
            lines.append((bone.parent.name, min(ends, key=lambda end: float(np.linalg.norm(end - head))), head))
    return lines


def _stick(head: Array, tail: Array, head_radius: float, tail_radius: float) -> tuple[Array, NDArray[np.intp]]:
    """A closed tapered stick with rounded ends: vertices and quads; the poles are rings of no width."""
    axis = (tail - head) / np.linalg.norm(tail - head)
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    around = 2 * np.pi * np.arange(_AROUND) / _AROUND
    ring = np.cos(around)[:, None] * side + np.sin(around)[:, None] * np.cross(axis, side)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 2 * _CAP + 2)
    at_head = angle < 0
    centre = np.where(at_head[:, None], head, tail)
    radius = np.where(at_head, head_radius, tail_radius)
    rings = centre + (radius * np.sin(angle))[:, None] * axis
    vertices = rings[:, None] + (radius * np.cos(angle))[:, None, None] * ring
    i, j = np.meshgrid(np.arange(len(angle) - 1), np.arange(_AROUND), indexing="ij")
    a, b = i * _AROUND + j, i * _AROUND + (j + 1) % _AROUND
    return vertices.reshape(-1, 3), np.stack([a, b, b + _AROUND, a + _AROUND], axis=-1).reshape(-1, 4)
