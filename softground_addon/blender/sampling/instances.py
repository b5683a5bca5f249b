"""Copies that are shown by instancing: they are no objects of their own, and nothing tells where they bear."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from itertools import islice
from typing import Any

import bpy

from ...core.findings import Finding, listed
from ..compat import node_inputs
from ..nodes.node_modifiers import named_by_nodes

MOST_LOOKED_AT = 100_000
"""Instances that are looked at (0.3 s)."""


def instancers(scene: bpy.types.Scene, shown: Collection[bpy.types.Object]) -> dict[str, str]:
    """Names of the objects that show instances of some objects or of their meshes, each with the name of that object.

    Copies whose instances a modifier has realized are not among them.
    """
    of_groups: dict[Any, list[Any]] = {}  # which thousands of objects may share
    waiting = {obj.name for obj in scene.objects if not _drawn_on(obj, of_groups).isdisjoint(shown)}
    if not waiting:
        return {}
    names, showing = {obj.data.name_full: obj.name for obj in shown if obj.data}, {}
    scene.view_layers[0].update()
    depsgraph = scene.view_layers[0].depsgraph
    for instance in islice(depsgraph.object_instances if depsgraph else (), MOST_LOOKED_AT):
        parent = instance.parent
        if not (instance.is_instance and parent and parent.name in waiting):
            continue
        if (obj := instance.object) and obj.data and obj.data.name_full in names:  # evaluated, a copy of the same name
            showing[parent.name] = names[obj.data.name_full]
            waiting.remove(parent.name)
    return showing


def _drawn_on(obj: bpy.types.Object, of_groups: dict[Any, list[Any]]) -> set[bpy.types.Object]:
    """Objects of which an object may show instances."""
    given: list[object] = [obj.instance_collection] if obj.instance_type == "COLLECTION" else []
    given += obj.children if obj.instance_type in ("VERTS", "FACES") else ()
    for system in obj.particle_systems:
        given += (system.settings.instance_object, system.settings.instance_collection)
    for modifier in obj.modifiers:
        if isinstance(modifier, bpy.types.NodesModifier) and (group := modifier.node_group):
            if group not in of_groups:
                of_groups[group] = list(named_by_nodes(modifier))
            given += (*of_groups[group], *(value for _, value in node_inputs(modifier)))
    return set(_objects_in(given))


def _objects_in(given: list[object]) -> Iterator[bpy.types.Object]:
    for item in given:
        if isinstance(item, bpy.types.Object):
            yield item
        elif isinstance(item, bpy.types.Collection):
            yield from item.all_objects


def crowd_finding(names: Iterable[str], shown: str) -> Finding:
    """What the user should know of objects that show instances of another one that prints."""
    return Finding(
        "instances",
        "warning",
        f"'{shown}' is also shown as instances by {listed(names)}, which leave no prints",
        "give each figure that should print an armature and a mesh of its own (Shift-D), and add it to the characters.",
    )
