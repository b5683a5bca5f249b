"""Hashes of what Blender's data say, by which a change of them is noticed. The same at every frame."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Collection, Container, Iterable, Iterator
from typing import Any, TypeVar, cast

import bpy
import numpy as np

from .. import mesh_arrays
from ..animation_layer.constraint_layer import is_response
from ..animation_layer.layer_curves import animated_paths
from ..compat import action_curves, node_inputs, slot_of
from ..ground import ground_mesh
from ..rigs.object_data import mesh_of, pose_bones

Value = TypeVar("Value")

_CHANNELS = (
    "location",
    "rotation_euler",
    "rotation_quaternion",
    "rotation_axis_angle",
    "scale",
    "delta_location",
    "delta_rotation_euler",
    "delta_rotation_quaternion",
    "delta_scale",
)
"""Properties that place, turn and scale an object."""

_POSE = _CHANNELS[:5]
"""Those that pose a bone."""

_BONE = ("head_local", "tail_local", "matrix_local")
"""How a bone lies in the rest pose."""

_KEY_SHAPE = ("interpolation", "easing", "back", "amplitude", "period")
"""How a curve runs from a key to the next, beside its handles."""

_NO_INPUT = frozenset(
    ("name", "action", "action_slot", "active", "select", "is_active", "is_override_data", "bake", "bake_directory")
)
"""Settings that change nothing of what their owner does."""

Known = dict[bpy.types.ID, str]
"""What data-blocks hold, as far as it was looked at: many bones follow the same objects."""

Shared = dict[Any, Any]
"""What was looked at of actions and meshes since the same call began: the figures of a crowd have the same."""

_LOOKED_AT = 5000
"""Vertices whose weights are compared, spread over the mesh: Blender reads weights one by one."""


def joined(texts: Iterable[str]) -> str:
    """One hash of several texts."""
    return f"{zlib.crc32(chr(10).join(texts).encode()):08x}"


def of_topology(mesh: bpy.types.Mesh) -> str:
    """Vertices that the faces of a mesh join."""
    corners = mesh_arrays.corner_vertices(mesh)
    return f"{len(mesh.vertices)}-{len(mesh.polygons)}-{zlib.crc32(corners.data):08x}"


def of_positions(mesh: bpy.types.Mesh) -> str:
    """Hash of the positions of a mesh without any bake."""
    rest = ground_mesh.rest_positions(mesh) + np.float32(0)  # Edit Mode makes negative zeros positive
    return f"{zlib.crc32(rest.data):08x}"


def of_weights(obj: bpy.types.Object, groups: Container[str], shared: Shared | None = None) -> str:
    """Weights of the vertices of a mesh in some of its vertex groups; of a large mesh, a sample of them."""
    numbers = {group.index: group.name for group in obj.vertex_groups if group.name in groups}
    mesh = ground_mesh.mesh_of(obj)
    return _once(shared, (mesh, *numbers.items()), lambda: _of_members(mesh.vertices, numbers))


def _of_members(vertices: Any, numbers: dict[int, str]) -> str:
    looked_at = range(0, len(vertices), -(-len(vertices) // _LOOKED_AT)) if numbers and len(vertices) else ()
    return joined(
        f"{index} {numbers[member.group]} {member.weight:.6g}"
        for index in looked_at
        for member in vertices[index].groups
        if member.group in numbers
    )


def _once(shared: Shared | None, key: Any, look: Callable[[], Value]) -> Value:
    """What was looked at under a key, or is now."""
    if shared is None:
        return look()
    if key not in shared:
        shared[key] = look()
    value: Value = shared[key]
    return value


def of_envelope(bone: bpy.types.Bone) -> str:
    """Size and weight of the envelope of a bone."""
    size = bone.head_radius, bone.tail_radius, bone.envelope_distance, bone.envelope_weight
    return f"{bone.name} {[f'{value:.6g}' for value in size]}"


def of_shapes(obj: bpy.types.Object) -> str:
    """Hash of the deformers of a skin other than bones: shape keys and modifiers; empty without any."""
    texts = [text for modifier in obj.modifiers if modifier.type != "ARMATURE" for text in of_settings(modifier)]
    keys = mesh_of(obj).shape_keys
    if keys is not None:
        keyed = animated_paths_of(keys)
        for block in keys.key_blocks:
            offsets = np.empty(len(block.data) * 3, dtype=np.float32)
            block.data.foreach_get("co", offsets)
            value = "" if block.path_from_id("value") in keyed else f"{block.value:.6g}"
            texts.append(f"{block.name} {block.mute} {value} {zlib.crc32(offsets.data):08x}")
        texts.append(of_keys(keys))
        for driver in keys.animation_data.drivers if keys.animation_data else ():
            texts += _of_driver(driver, {})
    return joined(texts) if texts else ""


def of_attribute(mesh: bpy.types.Mesh, name: str) -> str:
    """The values of a float attribute of a mesh; nothing where there is none."""
    attribute: Any = mesh.attributes.get(name)
    if attribute is None or attribute.data_type != "FLOAT":
        return ""
    values = np.empty(len(attribute.data), dtype=np.float32)
    attribute.data.foreach_get("value", values)
    return f"{zlib.crc32(values.data):08x}"


def of_place(objects: Iterable[bpy.types.Object]) -> str:
    """Hash of where objects stand in their parents, but for channels that their own animation sets."""
    values = []
    for obj in objects:
        animated = animated_paths(obj)
        values += [
            value
            for channel in _CHANNELS
            for index, value in enumerate(getattr(obj, channel))
            if (channel, index) not in animated
        ]
        values += np.array(obj.matrix_parent_inverse).ravel().tolist()
    return f"{zlib.crc32(np.array(values, dtype=np.float32).tobytes()):08x}"


def of_keys(obj: bpy.types.Object | bpy.types.Key, shared: Shared | None = None) -> str:
    """The keys of the user's own actions and strips, and when they are played."""
    animation = obj.animation_data
    if animation is None:
        return ""
    hashes = set()

    def of_action(owner: Any) -> str:
        action, slot = owner.action, slot_of(owner)
        return _once(shared, (action, slot, "keys"), lambda: _of_action(action, slot))

    if animation.action:
        hashes.add(of_action(animation))
    for _, strip in _playing_strips(animation):
        if strip.action is None:
            continue
        influence = None if strip.use_animated_influence else strip.influence
        placed = (strip.frame_start, strip.frame_end, strip.action_frame_start, influence)
        hashes.add(f"{of_action(strip)}@{placed}")
    return " ".join(sorted(hashes))


def of_animation(obj: bpy.types.Object, known: Known, shared: Shared | None = None) -> str:
    """Hash of what moves an object: curves, strips, drivers, constraints, physics and bones.

    Of data-blocks that it follows, `known` has what they hold, as far as it was looked at; they are added.
    """
    animated = animated_paths_of(obj)
    parts: list[str] = [obj.rotation_mode]
    animation = obj.animation_data

    def courses(owner: Any) -> set[str]:
        action, slot = owner.action, slot_of(owner)
        return _once(shared, (action, slot, "courses"), lambda: set(_of_curves(action_curves(action, slot))))

    if animation is not None:
        curves: set[str] = set()
        if animation.action:
            curves |= courses(animation)
        for track, strip in _playing_strips(animation):
            if strip.action:
                curves |= courses(strip)
            parts += [f"{animation.use_nla} {track.is_solo}", *_of_strip(strip)]
        parts += sorted(curves)
        for driver in animation.drivers:
            parts += _of_driver(driver, known)
    for owner in (obj, *(obj.pose.bones if obj.pose else ())):
        for constraint in owner.constraints:
            if not is_response(constraint):
                parts += of_settings(constraint, animated, known)
    if obj.rigid_body is not None:
        parts += of_settings(obj.rigid_body)
    if obj.pose is not None:
        parts += _of_bones(obj)
    return joined(parts)


def of_settings(owner: Any, animated: Collection[str] = (), known: Known | None = None) -> Iterator[str]:
    """Settings of a modifier, a constraint or the like, but for those that are animated.

    Data-blocks that it names are compared by what they hold; `known` has that of some.
    """
    known = {} if known is None else known
    yield owner.bl_rna.identifier
    path = _path(owner) if animated else ""
    for setting in owner.bl_rna.properties:
        name = setting.identifier
        if name in _NO_INPUT or (name.startswith(("show_", "open_")) and name != "show_viewport"):
            continue
        if name == "targets":
            for target in owner.targets:
                yield from of_settings(target, animated, known)
        elif setting.type != "COLLECTION" and not setting.is_readonly and f"{path}.{name}" not in animated:
            value = getattr(owner, name)
            if setting.subtype in ("FILE_PATH", "DIR_PATH"):
                value = bpy.path.basename(value)  # where it is changes with the place of the .blend
            if isinstance(value, bpy.types.Texture):
                yield from of_settings(value)
            elif setting.type != "POINTER" or isinstance(value, bpy.types.ID):
                yield f"{name} {_plain(value, known)}"
    if isinstance(owner, bpy.types.NodesModifier):
        yield from (f"{name} {_plain(value, known)}" for name, value in node_inputs(owner))


def _path(owner: Any) -> str:
    try:
        return str(owner.path_from_id())
    except ValueError:  # of what has no path, nothing is animated
        return ""


def _plain(value: Any, known: Known) -> str:
    """A value as text; of data-blocks what they hold. Booleans become integers when a file is read."""
    if isinstance(value, bpy.types.ID):
        return _of_block(value, known)
    if isinstance(value, bool):
        return str(int(value))
    parts = hasattr(value, "__len__") and not isinstance(value, str)
    return str([_plain(part, known) for part in value] if parts else value)


def _of_block(block: bpy.types.ID, known: Known) -> str:
    """Content of a data-block, whatever its name."""
    if block not in known:
        known[block] = ""  # groups may hold each other
        if isinstance(block, bpy.types.Object):
            parts = [of_place([block]), of_keys(block)]
        elif isinstance(block, bpy.types.Collection):
            parts = sorted(_of_block(obj, known) for obj in block.all_objects)
        elif isinstance(block, bpy.types.NodeTree):
            parts = [*_of_nodes(block, known)]
        else:
            parts = [cast("Any", block.bl_rna).identifier, bpy.path.basename(getattr(block, "filepath", ""))]
        known[block] = joined(parts)
    return known[block]


def _of_nodes(tree: Any, known: Known) -> Iterator[str]:
    """The nodes of a group and what is set in their sockets, unless something animates that."""
    yield str(len(tree.links))
    for node in tree.nodes:
        yield f"{node.bl_idname} {_plain(getattr(node, 'node_tree', None), known)}"
        if tree.animation_data is None:
            values = (getattr(socket, "default_value", "") for socket in (*node.inputs, *node.outputs))
            yield from (_plain(value, known) for value in values)


def animated_paths_of(obj: bpy.types.Object | bpy.types.Key) -> set[str]:
    """Data paths that something sets at each frame."""
    return {path for path, _ in animated_paths(obj)}


def _playing_strips(animation: bpy.types.AnimData) -> Iterator[tuple[bpy.types.NlaTrack, bpy.types.NlaStrip]]:
    """Strips of the tracks that are not muted, with their tracks."""
    return ((track, strip) for track in animation.nla_tracks if not track.mute for strip in track.strips)


def _of_action(action: bpy.types.Action, slot: Any) -> str:
    digest = 0
    for curve in sorted(action_curves(action, slot), key=lambda curve: (curve.data_path, curve.array_index)):
        digest = zlib.crc32(f"{curve.data_path}[{curve.array_index}]{curve.mute}".encode(), digest)
        for part in ("co", "handle_left", "handle_right"):
            values = np.empty(len(curve.keyframe_points) * 2, dtype=np.float32)
            curve.keyframe_points.foreach_get(part, values)
            digest = zlib.crc32(values.tobytes(), digest)
    return f"{digest:08x}"


def _of_curves(curves: Iterable[bpy.types.FCurve]) -> Iterator[str]:
    """Course of curves between and beyond their keys."""
    for curve in curves:
        parts = [curve.data_path, str(curve.array_index), curve.extrapolation]
        for part in _KEY_SHAPE:
            values = np.empty(len(curve.keyframe_points), dtype=np.float32)
            curve.keyframe_points.foreach_get(part, values)
            parts.append(f"{zlib.crc32(values.data):08x}")
        for modifier in curve.modifiers:
            parts += of_settings(modifier)
        yield joined(parts)


def _of_strip(strip: bpy.types.NlaStrip) -> Iterator[str]:
    """Settings by which a strip plays its action; its own curves where these decide."""
    animated = {f"{_path(strip)}.{curve.data_path}" for curve in strip.fcurves}
    yield from of_settings(strip, animated)
    yield from _of_curves(strip.fcurves)
    for curve in strip.fcurves:
        yield from (f"{key.co[0]:.6g} {key.co[1]:.6g}" for key in curve.keyframe_points)


def _of_driver(curve: bpy.types.FCurve, known: Known) -> Iterator[str]:
    """Expression of a driver, and the custom properties that it reads."""
    driver: Any = curve.driver
    yield f"{curve.data_path} {curve.array_index} {curve.mute} {driver.type} {driver.expression}"
    yield from _of_curves([curve])
    for variable in driver.variables:
        yield f"{variable.name} {variable.type}"
        for target in variable.targets:
            yield f"{_plain(target.id, known)} {target.data_path} {target.bone_target}"
            yield f"{target.transform_type} {target.transform_space} {target.rotation_mode} {_value_of(target, known)}"


def _value_of(target: Any, known: Known) -> str:
    """The value of a custom property that a driver reads, unless it is animated itself."""
    path = target.data_path
    if not path.endswith('"]') or not target.id:
        return ""
    if isinstance(target.id, bpy.types.Object) and path in animated_paths_of(target.id):
        return ""
    try:
        return _plain(target.id.path_resolve(path), known)
    except ValueError:
        return "missing"


def _of_bones(obj: bpy.types.Object) -> Iterator[str]:
    """Rest pose of the bones of an armature, and poses of those that nothing animates."""
    armature: Any = obj.data
    yield armature.pose_position
    for bone in armature.bones:
        yield f"{bone.name} {bone.parent.name if bone.parent else ''} {bone.use_inherit_rotation}"
        yield f"{bone.inherit_scale} {bone.use_local_location} {bone.use_relative_parent}"
    for part in _BONE:
        values = np.empty(len(armature.bones) * (16 if part == "matrix_local" else 3), dtype=np.float32)
        armature.bones.foreach_get(part, values)
        yield f"{zlib.crc32(values.data):08x}"
    animated = animated_paths(obj)
    for bone in pose_bones(obj):
        path = bone.path_from_id()
        pose = [
            value
            for channel in _POSE
            for index, value in enumerate(getattr(bone, channel))
            if (f"{path}.{channel}", index) not in animated
        ]
        yield f"{bone.rotation_mode} {pose}"
