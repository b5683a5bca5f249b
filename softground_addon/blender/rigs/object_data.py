"""What objects of a known kind have: Blender types `Object.data` as the data of any kind, or none."""

from __future__ import annotations

from typing import TypeVar

import bpy

Kind = TypeVar("Kind")


def _has(obj: bpy.types.Object, held: object, kind: type[Kind]) -> Kind:
    if not isinstance(held, kind):
        raise TypeError(f"'{obj.name}', of type {obj.type}, has no {kind.__name__}")
    return held


def mesh_of(obj: bpy.types.Object) -> bpy.types.Mesh:
    """The mesh of a mesh object."""
    return _has(obj, obj.data, bpy.types.Mesh)


def armature_of(rig: bpy.types.Object) -> bpy.types.Armature:
    """The armature of a rig."""
    return _has(rig, rig.data, bpy.types.Armature)


def pose_bones(rig: bpy.types.Object) -> bpy.types.bpy_prop_collection[bpy.types.PoseBone]:
    """Bones of a rig as they are posed."""
    return _has(rig, rig.pose, bpy.types.Pose).bones
