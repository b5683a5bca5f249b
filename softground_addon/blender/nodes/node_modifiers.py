"""Node groups of ours and the modifiers that run them, found and read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import bpy

from .. import compat


class GroupInput(NamedTuple):
    """An input of a group: its value at first, its range, and the kind of its socket as Blender's types end."""

    name: str
    value: Any
    meaning: str
    span: tuple[float, float] | None = None
    kind: str = "Float"


def new_group(name: str, mark: str, inputs: Iterable[GroupInput] = ()) -> Any:
    """A new group for a modifier: geometry in and out, inputs, and no nodes.

    It has a custom property by which it is known whatever the user calls it.
    """
    tree: Any = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.is_modifier = True
    tree[mark] = True
    add_sockets(tree, inputs)
    return tree


def add_sockets(tree: Any, inputs: Iterable[GroupInput]) -> None:
    """Give a group geometry in and out, and inputs."""
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    for name, value, meaning, span, kind in inputs:
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        socket.description = meaning
        if value is not None:
            socket.default_value = value
        if span:
            socket.min_value, socket.max_value = span


def modifier_with(obj: bpy.types.Object, is_it: Callable[[Any], bool]) -> Any:
    """The first modifier whose node group is of a kind, whatever the names of both have become; None without one."""
    return next(
        (modifier for modifier in obj.modifiers if (group := getattr(modifier, "node_group", None)) and is_it(group)),
        None,
    )


def put(obj: bpy.types.Object, name: str, group: bpy.types.NodeTree, place: int) -> Any:
    """A new modifier that runs a group, at a place among an object's; the one that is active stays so."""
    active = obj.modifiers.active
    modifier: Any = obj.modifiers.new(name, "NODES")
    modifier.node_group, modifier.show_in_editmode = group, False
    obj.modifiers.move(len(obj.modifiers) - 1, place)
    if active:
        obj.modifiers.active = active
    return modifier


def showing(ground: bpy.types.Object) -> set[bpy.types.Object]:
    """A ground and the copies of it that show the same mesh."""
    shared: Any = ground.data
    copies = [obj for obj in bpy.data.objects if obj.data == shared] if shared.users > 1 else []
    return {ground, *copies}


def inputs_of(modifier: Any) -> dict[str, str]:
    """Identifier of each input of a modifier's node group, by its name."""
    sockets = [item for item in modifier.node_group.interface.items_tree if item.item_type == "SOCKET"]
    return {socket.name: socket.identifier for socket in sockets if socket.in_out == "INPUT"}


def curves_of(modifier: Any) -> dict[str, bpy.types.FCurve]:
    """Curves by which the object of a modifier keys its inputs, by their names; without those that are muted."""
    animation = modifier.id_data.animation_data
    if animation is None or animation.action is None:
        return {}
    curves = compat.action_curves(animation.action, compat.slot_of(animation))
    valued, inputs = dict(compat.node_inputs(modifier)), inputs_of(modifier)  # a geometry has no value
    paths = {compat.input_path(modifier, each): name for name, each in inputs.items() if each in valued}
    return {paths[curve.data_path]: curve for curve in curves if curve.data_path in paths and not curve.mute}


def set_inputs(modifier: Any, values: Mapping[str, Any]) -> None:
    """Set inputs of a modifier by their names, of those that its node group has."""
    for name, identifier in inputs_of(modifier).items():
        if name in values:
            compat.write_input(modifier, identifier, values[name])


def nodes_of(modifier: Any) -> list[Any]:
    """The nodes of a modifier's group and of all groups within; none of a modifier without a group."""
    waiting, known, nodes = [getattr(modifier, "node_group", None)], set(), []
    while waiting:
        tree = waiting.pop()
        if tree is not None and tree not in known:
            known.add(tree)
            nodes += tree.nodes
            waiting += [getattr(node, "node_tree", None) for node in tree.nodes]
    return nodes


def named_by_nodes(modifier: Any) -> Iterator[Any]:
    """The objects and collections that the nodes of a modifier's group name, or None."""
    sockets = (socket for node in nodes_of(modifier) for socket in node.inputs)
    return (socket.default_value for socket in sockets if socket.type in ("OBJECT", "COLLECTION"))
