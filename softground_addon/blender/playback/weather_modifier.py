"""The modifier that plays weather over a bake, and the attributes that are its own."""

from __future__ import annotations

from typing import Any, cast

import bpy

from ..nodes import node_modifiers
from . import own_data, playback, weather_inputs, weather_table
from . import weather_nodes as nodes

MODIFIER = weather_inputs.GROUP


def modifier_of(ground: bpy.types.Object) -> bpy.types.Modifier | None:
    """The ground's weather, whatever the names of the modifier and its node group have become."""
    modifier: bpy.types.Modifier | None = node_modifiers.modifier_with(ground, weather_inputs.is_weather)
    return modifier


def inputs_of(modifier: Any) -> dict[str, str]:
    """Identifier of each of the inputs that set the weather, by its name."""
    known = {name for name, *_ in weather_inputs.INPUTS}
    return {name: identifier for name, identifier in node_modifiers.inputs_of(modifier).items() if name in known}


def put(ground: bpy.types.Object, tree: bpy.types.NodeTree) -> Any:
    """Have weather act on an object, right behind its playback; the modifier that is active stays so."""
    before = playback.modifier_of(ground)
    place = list(ground.modifiers).index(before) + 1 if before else 0
    return node_modifiers.put(ground, MODIFIER, tree, place)


def separate(modifier: Any) -> bool:
    """Give weather a group of its own, with its tables, if a copy of its object has the same; False if none has."""
    tree = modifier.node_group
    if tree.users - tree.use_fake_user < 2:
        return False
    tree = modifier.node_group = tree.copy()
    for holder in tree.nodes:
        if getattr(holder, "node_tree", None):
            inner = holder.node_tree = holder.node_tree.copy()
            for name in weather_table.TABLES:
                weather_table.separate(inner, name)
    return True


def remove(ground: bpy.types.Object) -> None:
    """Take weather off a ground and copies of it with the same mesh; nothing happens where there is none."""
    for shown in node_modifiers.showing(ground):
        while modifier := modifier_of(shown):
            shown.modifiers.remove(modifier)
    remove_unused()
    own_data.remove(cast("bpy.types.Mesh", ground.data), nodes.OF_WEATHER)


def remove_unused() -> None:
    """Remove the groups that no modifier has any more."""
    groups = [group for group in bpy.data.node_groups if weather_inputs.is_weather(group)]
    for group in [group for group in groups if not (group.users or group.library)]:
        inners = nodes.groups_within(group)
        bpy.data.node_groups.remove(group)
        nodes.remove_unused(inners)
