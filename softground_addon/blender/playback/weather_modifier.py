"""The modifier that plays weather over a bake, and the attributes that are its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy

from .. import compat
from ..nodes import node_modifiers
from ..rigs.object_data import mesh_of
from . import own_data, playback, weather_inputs, weather_table
from . import weather_nodes as nodes

MODIFIER = weather_inputs.GROUP
FOLLOWS = weather_inputs.MARK
"""Name of the variable of drivers by which inputs of other modifiers follow the weather's."""
SAME = 1e-6
"""Difference of values that are the same in a single-precision property."""
NAMES = frozenset(name for name, *_ in weather_inputs.INPUTS)


def modifier_of(ground: bpy.types.Object) -> bpy.types.Modifier | None:
    """The ground's weather, whatever the names of the modifier and its node group have become."""
    return node_modifiers.modifier_with(ground, weather_inputs.is_weather)


def inputs_of(modifier: Any) -> dict[str, str]:
    """Identifier of each of the inputs that set the weather, by its name."""
    return {name: identifier for name, identifier in node_modifiers.inputs_of(modifier).items() if name in NAMES}


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
    own_data.remove(mesh_of(ground), nodes.OF_WEATHER)


def remove_unused() -> None:
    """Remove the groups that no modifier has any more."""
    groups = [group for group in bpy.data.node_groups if weather_inputs.is_weather(group)]
    for group in [group for group in groups if not (group.users or group.library)]:
        inners = nodes.groups_within(group)
        bpy.data.node_groups.remove(group)
        nodes.remove_unused(inners)


def lead(ground: bpy.types.Object, modifier: Any, values: Mapping[str, float]) -> None:
    """Have inputs of another object's modifier follow the weather's on a ground, by drivers without Python.

    Parameters
    ----------
    values : mapping of str to float
        Those that follow, by the names that they have in both, and their values where there is no weather. Others are
        the user's, as are those that the user keys or drives: they stay.
    """
    let_go(modifier, values)
    weather: Any = modifier_of(ground)
    if weather is None or weather.node_group is None:
        return
    obj, inputs = modifier.id_data, node_modifiers.inputs_of(modifier)
    driven = {curve.data_path for curve in obj.animation_data.drivers} if obj.animation_data else set()
    for name in values.keys() & inputs.keys() - node_modifiers.curves_of(modifier).keys():
        path, value = compat.input_path(modifier, inputs[name]), compat.read_input(modifier, inputs[name])
        if path in driven or abs((values[name] if value is None else value) - values[name]) > SAME:
            continue
        driver = obj.driver_add(path).driver
        driver.type = "SUM"
        variable = driver.variables.new()
        variable.name, target = FOLLOWS, variable.targets[0]
        target.id, target.data_path = ground, compat.input_path(weather, inputs_of(weather)[name])
        target.use_fallback_value, target.fallback_value = True, values[name]  # where the user removes the weather


def let_go(modifier: Any, values: Mapping[str, float]) -> None:
    """Have no input of a modifier follow weather any more; see `lead`."""
    obj, inputs = modifier.id_data, node_modifiers.inputs_of(modifier)
    for name, curve in _followers(modifier).items():
        obj.animation_data.drivers.remove(curve)
        compat.write_input(modifier, inputs[name], values[name])
        obj.update_tag()


def led_values(modifier: Any, frame: float) -> dict[str, float]:
    """Values of the inputs of a modifier that follow weather, at a frame of the animation, by name."""
    values = {}
    for name, curve in _followers(modifier).items():
        ground: Any = curve.driver and curve.driver.variables[0].targets[0].id
        if weather := ground and modifier_of(ground):
            keyed = node_modifiers.curves_of(weather).get(name)
            values[name] = keyed.evaluate(frame) if keyed else compat.read_input(weather, inputs_of(weather)[name])
    return values


def _followers(modifier: Any) -> dict[str, bpy.types.FCurve]:
    """Drivers by which inputs of a modifier follow weather, by name."""
    animation, inputs = modifier.id_data.animation_data, node_modifiers.inputs_of(modifier)
    paths = {compat.input_path(modifier, identifier): name for name, identifier in inputs.items() if name in NAMES}
    return {
        paths[curve.data_path]: curve
        for curve in (animation.drivers if animation else ())
        if curve.data_path in paths and [each.name for each in curve.driver.variables] == [FOLLOWS]
    }
