"""Grounds that do not stand still: what moves them, and what gives them another shape from frame to frame."""

from __future__ import annotations

from itertools import islice
from typing import Any

import bpy

from ..animation_layer.layer_curves import animated_paths
from ..compat import node_inputs
from ..nodes.node_modifiers import named_by_nodes, nodes_of
from . import ground_mesh

TIME_DEPENDENT = ("BUILD", "CLOTH", "EXPLODE", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "SOFT_BODY", "WAVE")
"""Modifiers that change a mesh from frame to frame with nothing keyed."""

TIME_NODES = ("GeometryNodeInputSceneTime", "GeometryNodeSimulationInput")

MOST_FOLLOWED = 1000
"""Objects and other data named by a ground's modifiers that are looked at: a panel asks at each redraw."""

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
    return next((item.name for item in theirs if _changes(item, keyed, {ground})), "")


def changes_shape(obj: bpy.types.Object) -> str:
    """Name of what changes an object's shape over time: keys or a modifier; empty if nothing does."""
    if (keys := getattr(obj.data, "shape_keys", None)) and _is_animated(keys):
        return "its shape keys"
    if obj.type == "MESH" and _is_animated(obj.data):
        return "keys on its mesh"
    modifier = changes_with_time(obj)
    return modifier and f"its modifier '{modifier}'"


def _changes(modifier: Any, keyed: tuple[str, ...], known: set[bpy.types.ID]) -> bool:
    path = modifier.path_from_id()
    if modifier.type in TIME_DEPENDENT or any(item.startswith(path) for item in keyed):
        return True
    if any(node.bl_idname in TIME_NODES for node in nodes_of(modifier)):
        return True
    settings = [getattr(modifier, item.identifier) for item in modifier.bl_rna.properties if item.type == "POINTER"]
    inputs = [value for _, value in node_inputs(modifier)] if modifier.type == "NODES" else []
    blocks = [item for item in (*settings, *inputs, *named_by_nodes(modifier)) if isinstance(item, bpy.types.ID)]
    trees = {node.id_data for node in nodes_of(modifier)}
    return any(_is_animated(tree) for tree in trees) or any(_acts_over_time(block, known) for block in blocks)


def _acts_over_time(block: bpy.types.ID, known: set[bpy.types.ID]) -> bool:
    """True if what a modifier names moves, or is another from frame to frame; those known are not looked at again, nor
    are materials, which change looks alone."""
    if block in known or len(known) > MOST_FOLLOWED or isinstance(block, bpy.types.Material):
        return False
    known.add(block)
    if isinstance(block, bpy.types.Collection):
        return any(_acts_over_time(obj, known) for obj in islice(block.all_objects, MOST_FOLLOWED))
    if isinstance(block, bpy.types.Object):
        return bool(mover_of(block) or _bends(block, known))
    tree = getattr(block, "node_tree", None)
    image = getattr(getattr(block, "image", None), "source", "")
    return _is_animated(block) or bool(tree and _is_animated(tree)) or image in ("SEQUENCE", "MOVIE")


def _bends(obj: bpy.types.Object, known: set[bpy.types.ID]) -> bool:
    keyed = tuple(path for path, _ in animated_paths(obj))
    keys = getattr(obj.data, "shape_keys", None)
    of_data = [block for block in (obj.data, keys) if block]
    shown = [item for item in ground_mesh.users_modifiers(obj) if item.show_viewport] if obj.modifiers else []
    return any(map(_is_animated, of_data)) or any(_changes(item, keyed, known) for item in shown)


def _is_animated(block: Any) -> bool:
    """True if keys, strips or drivers set anything of a data block."""
    return hasattr(block, "animation_data") and bool(animated_paths(block))
