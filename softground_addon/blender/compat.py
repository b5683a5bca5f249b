"""Differences between Blender versions, each behind one name. The only reader of `bpy.app.version`."""

from __future__ import annotations

from typing import Any

import bpy

HAS_SLOTS = bpy.app.version >= (4, 4, 0)
"""Actions keep their curves in the channelbag of a slot instead of one list."""

VERSION, SERIES = bpy.app.version_string, "{}.{}".format(*bpy.app.version)
"""The version, with corrections and without."""

WRITES_CLOUDS = bpy.app.version >= (4, 3, 0)
"""Point clouds are written to USD; earlier Blenders write the vertices of meshes alone."""


def action_curves(action: bpy.types.Action, slot: Any = None) -> list[bpy.types.FCurve]:
    """The action's curves: those of one slot, of all slots if none is given, or the whole action before slots."""
    if not HAS_SLOTS:
        return list(action.fcurves)
    strips: list[Any] = [strip for layer in action.layers for strip in layer.strips]
    return [
        curve
        for strip in strips
        for bag in strip.channelbags
        if slot is None or bag.slot_handle == slot.handle
        for curve in bag.fcurves
    ]


def new_channels(action: bpy.types.Action, name: str) -> tuple[Any, Any]:
    """A slot for an object of that name in an empty action, None before slots, and the collection of its curves."""
    if not HAS_SLOTS:
        return None, action.fcurves
    slot = action.slots.new(id_type="OBJECT", name=name)
    strip: Any = action.layers.new("Layer").strips.new(type="KEYFRAME")
    return slot, strip.channelbag(slot, ensure=True).fcurves


def channels_of(action: bpy.types.Action, slot: Any) -> Any:
    """The collection of an action's curves for one of its slots, made if need be; of all its curves before slots."""
    if not HAS_SLOTS:
        return action.fcurves
    layer = action.layers[0] if action.layers else action.layers.new("Layer")
    strip: Any = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(slot, ensure=True).fcurves


def new_curve(curves: Any, path: str, index: int, group: str) -> bpy.types.FCurve:
    """A new curve in a collection from `new_channels`, in a named group where this Blender can make one."""
    if not HAS_SLOTS:
        return curves.new(path, index=index, action_group=group)
    if bpy.app.version >= (5, 0, 0):
        return curves.new(path, index=index, group_name=group)
    return curves.new(path, index=index)


def slot_of(owner: Any) -> Any:
    """The slot that animation data or a strip uses; None before slots."""
    return owner.action_slot if HAS_SLOTS else None


def set_slot(owner: Any, slot: Any) -> None:
    """Let animation data or a strip use a slot; nothing before slots."""
    if HAS_SLOTS and slot is not None:
        owner.action_slot = slot


def node_inputs(modifier: Any) -> list[tuple[str, Any]]:
    """Identifiers and values of what is set in a Geometry Nodes modifier; early Blenders keep custom properties."""
    tree = modifier.node_group
    sockets = [] if tree is None else [item for item in tree.interface.items_tree if item.item_type == "SOCKET"]
    names = [socket.identifier for socket in sockets if socket.in_out == "INPUT"]
    if hasattr(modifier, "properties"):
        held: list[tuple[str, Any]] = [(name, getattr(modifier.properties.inputs, name, None)) for name in names]
        return [(name, holder.value) for name, holder in held if hasattr(holder, "value")]
    return [(name, modifier[name]) for name in names if name in modifier.keys()]  # noqa: SIM118  (no mapping)


def input_field(modifier: Any, identifier: str) -> tuple[Any, str]:
    """An input of a geometry nodes modifier as `layout.prop` takes it: what has it, and the path of the property."""
    if hasattr(modifier, "properties"):  # from 5.2 on
        return getattr(modifier.properties.inputs, identifier), "value"
    return modifier, f'["{identifier}"]'


def input_path(modifier: Any, identifier: str) -> str:
    """The data path of an input of a geometry nodes modifier, as curves of its object have it."""
    owner, path = input_field(modifier, identifier)
    return owner.path_from_id(path) if path == "value" else owner.path_from_id() + path


def read_input(modifier: Any, identifier: str) -> Any:
    """Value of an input of a geometry nodes modifier."""
    owner, path = input_field(modifier, identifier)
    return owner.value if path == "value" else owner.get(identifier)


def write_input(modifier: Any, identifier: str, value: Any) -> None:
    """Set an input of a geometry nodes modifier."""
    owner, path = input_field(modifier, identifier)
    if path == "value":
        owner.value = value
    else:
        owner[identifier] = value


def shader_tree(material: bpy.types.Material) -> Any:
    """The nodes of a material, switched on if need be: from 5.0 on it has them anyway, and the switch warns."""
    if bpy.app.version < (5, 0, 0) or material.node_tree is None:
        material.use_nodes = True
    return material.node_tree


def remove_scene(scene: bpy.types.Scene) -> None:
    """Remove a scene. `bpy.data.scenes.remove` crashes Blender where it has no window: in `--background --command`."""
    bpy.data.batch_remove([scene])


def straighten(curves: Any) -> None:
    """Make curves of all splines of curves; early Blenders take one of a single point more, in nobody's way."""
    if hasattr(curves, "set_types"):
        curves.set_types(type="POLY")
    else:
        kinds = curves.attributes.new("curve_type", "INT8", "CURVE")
        kinds.data.foreach_set("value", [1] * len(curves.curves))
        curves.add_curves([1])  # lets Blender count the kinds anew


PLAYS_SOUND = bool(bpy.app.build_options.audaspace)
"""Some builds, such as modules for servers, know no sound."""


def strips_of(scene: bpy.types.Scene) -> Any:
    """The strips of a scene's sequencer, which it gets if it has none."""
    editor: Any = scene.sequence_editor or scene.sequence_editor_create()
    return editor.strips if hasattr(editor, "strips") else editor.sequences


def show_in_sequencer(context: bpy.types.Context, scene: bpy.types.Scene) -> None:
    """Let the workspace's sequencer show a scene where it shows none yet: from 5.0 on it shows one of its own."""
    workspace: Any = context.workspace
    if workspace is not None and getattr(workspace, "sequencer_scene", scene) is None:
        workspace.sequencer_scene = scene
