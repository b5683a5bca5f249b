"""Everything that a user could lose, as values that can be compared: bytes of meshes, keys, settings of objects."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from softground_addon.blender.compat import action_curves

_VALUE_FIELDS = {
    "FLOAT": ("value", np.float32, 1),
    "INT": ("value", np.int32, 1),
    "BOOLEAN": ("value", np.int8, 1),
    "FLOAT_VECTOR": ("vector", np.float32, 3),
    "FLOAT2": ("vector", np.float32, 2),
    "INT8": ("value", np.int32, 1),
    "INT32_2D": ("value", np.int32, 2),
    "FLOAT_COLOR": ("color", np.float32, 4),
    "BYTE_COLOR": ("color", np.float32, 4),
}


def of_file() -> dict[str, Any]:
    """Fingerprint of everything in the open file that a user made, by kind and name."""
    return {
        "objects": {o.name: of_object(o) for o in bpy.data.objects},
        "meshes": {m.name: of_mesh(m) for m in bpy.data.meshes},
        "actions": {a.name: of_action(a) for a in bpy.data.actions},
        "scenes": {s.name: (s.frame_current, s.frame_start, s.frame_end, s.frame_subframe) for s in bpy.data.scenes},
        "names": {
            kind: sorted(block.name for block in getattr(bpy.data, kind))
            for kind in ("collections", "materials", "node_groups", "armatures", "images", "texts", "worlds", "curves")
        },
    }


def differences(before: Any, after: Any, where: str = "") -> list[str]:
    """Where two fingerprints differ, and how where that is short."""
    if isinstance(before, dict) and isinstance(after, dict):
        names = sorted(set(before) | set(after), key=str)
        return [each for n in names for each in differences(before.get(n), after.get(n), f"{where}/{n}")]
    return [] if before == after else [f"{where}: {str(before)[:200]} -> {str(after)[:200]}"]


def of_mesh(mesh: bpy.types.Mesh) -> dict[str, Any]:
    keys = mesh.shape_keys
    return {
        "attributes": {a.name: (a.domain, a.data_type, of_attribute(a)) for a in mesh.attributes},
        "active_attribute": mesh.attributes.active_index,
        "shape_keys": {k.name: (k.value, k.mute, _points(k)) for k in keys.key_blocks} if keys else None,
        "materials": [m.name if m else None for m in mesh.materials],
        "properties": _properties(mesh),
        "users": mesh.users,
    }


def of_object(thing: bpy.types.Object) -> dict[str, Any]:
    pose = thing.pose.bones if thing.pose else ()
    animation = thing.animation_data
    return {
        "transform": [tuple(v) for v in (*thing.matrix_basis, *thing.matrix_parent_inverse)],
        "world": [tuple(v) for v in thing.matrix_world] if thing.visible_get() else None,  # else it is not kept up
        "visible": (thing.hide_viewport, thing.hide_render, thing.hide_get(), thing.select_get()),
        "instancer": (thing.show_instancer_for_viewport, thing.show_instancer_for_render),
        "data": thing.data.name if thing.data else None,
        "modifiers": [_rna(m) for m in thing.modifiers],
        "constraints": [_rna(c) for c in thing.constraints],
        "bones": {
            b.name: (
                [tuple(v) for v in b.matrix_basis],
                b.rotation_mode,
                [_rna(c) for c in b.constraints],
                _properties(b),
            )
            for b in pose
        },
        "vertex_groups": [g.name for g in thing.vertex_groups],
        "action": animation.action.name if animation and animation.action else None,
        "drivers": [(d.data_path, d.driver.expression) for d in animation.drivers] if animation else [],
        "nla": [[(s.name, s.frame_start, s.frame_end) for s in t.strips] for t in animation.nla_tracks]
        if animation
        else [],
        "properties": _properties(thing),
        "active_shape_key": thing.active_shape_key_index,
    }


def of_action(action: bpy.types.Action) -> list[Any]:
    curves = []
    for curve in action_curves(action):
        keys = np.empty(len(curve.keyframe_points) * 2, dtype=np.float32)
        curve.keyframe_points.foreach_get("co", keys)
        handles = [(tuple(k.handle_left), tuple(k.handle_right), k.interpolation) for k in curve.keyframe_points]
        curves.append((curve.data_path, curve.array_index, keys.tobytes(), handles, curve.mute))
    return [curves, _properties(action), action.users]


def of_attribute(attribute: bpy.types.Attribute) -> bytes:
    field, kind, width = _VALUE_FIELDS[attribute.data_type]
    values = np.empty(len(attribute.data) * width, dtype=kind)
    attribute.data.foreach_get(field, values)
    return values.tobytes()


def _points(key: bpy.types.ShapeKey) -> bytes:
    points = np.empty(len(key.points) * 3, dtype=np.float32)
    key.points.foreach_get("co", points)
    return points.tobytes()


def _properties(block: Any) -> dict[str, str]:
    if not hasattr(block, "keys"):
        return {}
    values = {key: block[key] for key in block.keys()}  # noqa: SIM118
    return {key: repr(v.to_dict() if hasattr(v, "to_dict") else v) for key, v in values.items()}


def _rna(block: Any) -> dict[str, str]:
    return {
        p.identifier: repr(getattr(block, p.identifier))
        for p in block.bl_rna.properties
        if not p.is_readonly
        and p.type in ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM", "POINTER")
        and p.identifier not in ("execution_time",)
    }
