"""Grounds that do not stand still: what moves them, and what gives them another shape from frame to frame."""

from __future__ import annotations

from typing import Any

import bpy

from ..animation_layer.layer_curves import animated_paths
from ..compat import node_inputs
from ..nodes.node_modifiers import named_by_nodes, nodes_of
from . import ground_mesh

TIME_DEPENDENT = ("BUILD", "CLOTH", "EXPLODE", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "SOFT_BODY", "WAVE")
"""Modifiers that change a mesh from frame to frame with nothing keyed."""

TIME_NODES = ("GeometryNodeInputSceneTime", "GeometryNodeSimulationInput")

_PLACING = ("location", "rotation_", "scale", "delta_", "constraints[", "matrix_")
"""How the paths of what places an object begin."""


def mover_of(obj: bpy.types.Object) -> bpy.types.Object | None:
    """The object whose animation moves an object: itself, a parent, or what it or a parent is constrained to."""
    waiting, known = [obj], set()
    while waiting:
        node = waiting.pop(0)
        if node in known:
            continue
        known.add(node)
        # A parent or target may move what hangs on its bones or vertices without moving itself.
        paths = (path for path, _ in animated_paths(node) if node.type == "ARMATURE" or path.startswith(_PLACING))
        if any(paths):
            return node
        constraints: list[Any] = [item for item in node.constraints if not item.mute and item.influence]
        followed = [getattr(item, "target", None) for item in constraints]
        followed += [item.target for constraint in constraints for item in getattr(constraint, "targets", ())]
        waiting += filter(None, (node.parent, *followed))
    return None


def changes_with_time(ground: bpy.types.Object) -> str:
    """Name of the first modifier that gives the ground another shape at each frame, or an empty text."""
    theirs = [item for item in ground_mesh.users_modifiers(ground) if item.show_viewport]
    keyed = tuple(path for path, _ in animated_paths(ground))
    return next((item.name for item in theirs if _changes(item, ground, keyed)), "")


def changes_shape(obj: bpy.types.Object) -> str:
    """Name of what changes an object's shape over time: its shape keys or a modifier; empty if nothing does."""
    keys = getattr(obj.data, "shape_keys", None)
    moving = keys and keys.animation_data
    if moving and (moving.action or moving.drivers or any(track.strips for track in moving.nla_tracks)):
        return "its shape keys"
    modifier = changes_with_time(obj)
    return modifier and f"its modifier '{modifier}'"


def _changes(modifier: Any, ground: bpy.types.Object, keyed: tuple[str, ...]) -> bool:
    path = modifier.path_from_id()
    if modifier.type in TIME_DEPENDENT or any(item.startswith(path) for item in keyed):
        return True
    if any(node.bl_idname in TIME_NODES for node in nodes_of(modifier)):
        return True
    settings = [getattr(modifier, item.identifier) for item in modifier.bl_rna.properties if item.type == "POINTER"]
    inputs = [value for _, value in node_inputs(modifier)] if modifier.type == "NODES" else []
    inputs += [*settings, *named_by_nodes(modifier)]
    followed = [item for item in inputs if isinstance(item, bpy.types.Object) and item != ground]
    return any(mover_of(item) for item in followed)
