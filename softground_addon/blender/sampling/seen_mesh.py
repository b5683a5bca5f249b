"""The mesh of a skin as it is seen: with its shape keys and modifiers, but before bones move it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import log
from typing import Any

import bpy
import numpy as np

from ...core.rig.rig_skin import Shape
from .. import mesh_arrays
from ..animation_layer.layer_curves import animated_paths
from ..rigs.object_data import mesh_of
from ..settings import ObjectName, find, name_of
from .frame_handlers import handlers_silent
from .sampling_scene import temporary_scene

_MOST_FACES = 100_000
"""Faces up to which a surface is subdivided."""

_LEAST_OFFSET = 1e-4
"""Keyed shapes that move no vertex farther than this are not followed, over the size of the mesh."""

_AFTER_BONES = {
    *("BUILD", "CLOTH", "CURVE", "EXPLODE", "FLUID", "HOOK", "LAPLACIANDEFORM", "LATTICE", "MESH_CACHE"),
    *("MESH_DEFORM", "MESH_SEQUENCE_CACHE", "OCEAN", "REMESH", "SHRINKWRAP", "SKIN", "SOFT_BODY", "SURFACE_DEFORM"),
    *("WARP", "WAVE"),
}
"""Modifiers that act on the mesh where the bones have moved it, change over time, or lose the weights of bones."""

_WITHOUT_SHAPE = {"ARMATURE", "COLLISION", "DYNAMIC_PAINT", "PARTICLE_INSTANCE", "PARTICLE_SYSTEM"}
"""Modifiers that leave a mesh at rest as it is."""


def left_out(obj: bpy.types.Object) -> list[str]:
    """What changes the shape of a skin and is not read."""
    modifiers = (modifier for modifier in obj.modifiers if modifier.show_viewport and modifier.type in _AFTER_BONES)
    keys = mesh_of(obj).shape_keys
    by_time = ["the keyed time of its shape keys"] * bool(keys and not keys.use_relative and keys.animation_data)
    return [*(f"the modifier '{modifier.name}'" for modifier in modifiers), *by_time]


@contextmanager
def as_seen(obj: bpy.types.Object) -> Iterator[tuple[ObjectName, tuple[Shape, ...]]]:
    """A mesh object by its name whose vertices are those that bones move, and what keyed shapes add to them over time.

    Where shape keys or modifiers have a part in it, it is a copy that is gone afterwards; keyed shapes are at 0 in it.
    """
    shown = {modifier.type for modifier in obj.modifiers if modifier.show_viewport}
    if not (mesh_of(obj).shape_keys or shown - _AFTER_BONES - _WITHOUT_SHAPE):
        yield name_of(obj), ()
        return
    copy = obj.copy()
    name, meshes = name_of(copy), []
    try:
        copy.data = mesh_of(obj).copy()
        meshes.append(copy.data.name)
        copy.data, shapes = _evaluated(copy, obj)
        meshes.append(copy.data.name)
        copy.modifiers.clear()
        yield name, shapes
    finally:
        if (remaining := find(name)) is not None:
            bpy.data.objects.remove(remaining)
        bpy.data.batch_remove([bpy.data.meshes[mesh] for mesh in meshes if mesh in bpy.data.meshes])


def _evaluated(copy: bpy.types.Object, obj: bpy.types.Object) -> tuple[bpy.types.Mesh, tuple[Shape, ...]]:
    """The mesh that modifiers make of a copy of an object and of its mesh, and what each keyed shape adds to it."""
    copy.hide_viewport = False
    most = int(log(max(_MOST_FACES / max(len(mesh_of(obj).polygons), 1), 1), 4))
    for modifier in list(copy.modifiers):
        if modifier.type in _AFTER_BONES | _WITHOUT_SHAPE:
            copy.modifiers.remove(modifier)
        elif isinstance(modifier, bpy.types.SubsurfModifier | bpy.types.MultiresModifier):
            modifier.levels = min(modifier.levels, most)
    keyed = _keyed_shapes(mesh_of(obj).shape_keys)
    keys: Any = mesh_of(copy).shape_keys
    if keyed:
        keys.animation_data_clear()
    for name in keyed:
        keys.key_blocks[name].value = 0.0
    with temporary_scene() as scene, handlers_silent():
        scene.collection.objects.link(copy)
        scene.view_layers[0].update()
        depsgraph = scene.view_layers[0].depsgraph
        assert depsgraph is not None
        mesh = bpy.data.meshes.new_from_object(
            copy.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
        )
        rest, shapes = mesh_arrays.positions(mesh), []
        evaluated: Any
        for name in keyed:
            keys.key_blocks[name].value = 1.0
            scene.view_layers[0].update()
            evaluated = copy.evaluated_get(depsgraph).data
            offset = mesh_arrays.positions(evaluated)[: len(rest)] - rest
            keys.key_blocks[name].value = 0.0
            moved = np.flatnonzero(np.abs(offset).max(axis=1) > _LEAST_OFFSET * np.ptp(rest, axis=0).max())
            if len(moved):
                shapes.append(Shape((obj.name_full, name), moved, offset[moved].astype(float)))
        return mesh, tuple(shapes)


def _keyed_shapes(keys: bpy.types.Key | None) -> list[str]:
    """The shape keys whose values keys, strips or drivers set."""
    if not keys or not keys.use_relative:
        return []
    paths = {path for path, _ in animated_paths(keys)}
    return [block.name for block in keys.key_blocks if not block.mute and block.path_from_id("value") in paths]
