"""Whether a bake still fits what it was made from: the settings, the ground's mesh, the animation. By hash."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import bpy
import numpy as np

from ..core import report
from . import ground_mesh, mesh_arrays, nla_layer
from .baked_ground import carrier_of
from .character_setup import ancestors
from .compat import action_curves, slot_of

FINGERPRINTS = "softground_fingerprints"
"""Property of the mesh that carries a bake: what it was made from, as JSON."""

SETTINGS, GROUND, PRINTS, ANIMATION, PLACE = "settings", "ground", "prints", "animation", "place"

_NOT_INPUTS = ("file", "scene")
"""Entries of a bake's inputs that may change without the bake changing."""

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

_ANSWERS = (nla_layer.RESPONSE, nla_layer.EXTRA, nla_layer.STANDING)
"""Tracks that hold the ground's answer to the rig, and not what the rig was animated to do."""


def store(inputs: Mapping[str, object], ground: bpy.types.Object, armatures: Sequence[bpy.types.Object]) -> None:
    """Note with the bake that was just written what it was made from."""
    mesh = ground_mesh.mesh_of(carrier_of(ground))
    mesh[FINGERPRINTS] = json.dumps(_fingerprints(inputs, ground, armatures))


def reasons(
    inputs: Mapping[str, object], ground: bpy.types.Object, armatures: Sequence[bpy.types.Object]
) -> tuple[str, ...]:
    """What has changed since the ground's bake, for the user to read; nothing if it is up to date or there is none.

    Parameters
    ----------
    inputs : mapping
        What a bake would be made with now.
    ground : bpy.types.Object
    armatures : sequence of bpy.types.Object
        Those whose animation a bake would read.
    """
    carrier = carrier_of(ground)
    if not ground_mesh.is_baked(carrier):
        return ()
    try:
        then: dict[str, str] = json.loads(ground_mesh.mesh_of(carrier)[FINGERPRINTS])
        now = _fingerprints(inputs, ground, armatures)
        told = [key for key in now if key in then or not key.startswith(PLACE)]  # earlier bakes do not tell of places
        changed = [key for key in dict.fromkeys((*then, *told)) if then.get(key) != now.get(key)]
    except (KeyError, TypeError, ValueError, AttributeError):
        return ("The bake does not say what it was made from",)
    texts = {
        SETTINGS: "The settings have changed",
        GROUND: f"The mesh or the place of '{ground.name}' has changed",
        PRINTS: f"The mesh of '{carrier.name}' has been edited",
    }
    of_movers = {ANIMATION: "The animation of '{}' has changed", PLACE: "'{}' or a parent of it was moved"}
    kinds = (key.partition(":") for key in changed)
    return tuple(texts[kind] if kind in texts else of_movers[kind].format(name) for kind, _, name in kinds)


def _fingerprints(
    inputs: Mapping[str, object], ground: bpy.types.Object, armatures: Sequence[bpy.types.Object]
) -> dict[str, str]:
    carrier = carrier_of(ground)
    animations = {f"{ANIMATION}:{armature.name}": _of_animation(armature) for armature in armatures}
    places = {f"{PLACE}:{armature.name}": _of_place(armature) for armature in armatures}
    return {
        SETTINGS: report.hash_inputs({key: value for key, value in inputs.items() if key not in _NOT_INPUTS}),
        GROUND: _of_ground(ground),
        PRINTS: _of_topology(ground_mesh.mesh_of(carrier)),
        **animations,
        **places,
    }


def _of_ground(ground: bpy.types.Object) -> str:
    mesh = ground_mesh.mesh_of(ground)
    positions = ground_mesh.rest_positions(mesh)
    place = np.round(ground_mesh.to_world_of(ground, 1.0), 6) + 0.0  # no negative zeros
    modifiers = [modifier.type for modifier in ground.modifiers if modifier.show_viewport]
    return f"{_of_topology(mesh)}-{zlib.crc32(positions.tobytes()):08x}-{zlib.crc32(place.tobytes()):08x}-{modifiers}"


def _of_topology(mesh: bpy.types.Mesh) -> str:
    corners = mesh_arrays.corner_vertices(mesh)
    return f"{len(mesh.vertices)}-{len(mesh.polygons)}-{zlib.crc32(corners.tobytes()):08x}"


def _of_place(thing: bpy.types.Object) -> str:
    """Where an object and its parents stand, but for what their own animation decides."""
    values = []
    for one in (thing, *ancestors(thing)):
        animated = nla_layer.animated_paths(one)
        values += [
            value
            for channel in _CHANNELS
            for index, value in enumerate(getattr(one, channel))
            if (channel, index) not in animated
        ]
        values += np.array(one.matrix_parent_inverse).ravel().tolist()
    return f"{zlib.crc32(np.array(values, dtype=np.float32).tobytes()):08x}"


def _of_animation(armature: bpy.types.Object) -> str:
    """All that the user's own actions and strips make the armature do."""
    animation = armature.animation_data
    if animation is None:
        return ""
    found = set()
    action, slot = nla_layer.own_action(armature)
    if action:
        found.add(_of_action(action, slot))
    for track in animation.nla_tracks:
        if track.name in _ANSWERS or (track.mute and track.name != nla_layer.SOURCE):
            continue
        for strip in track.strips:
            if strip.action is None:
                continue
            digest = _of_action(strip.action, slot_of(strip))
            if track.name != nla_layer.SOURCE:
                placed = (strip.frame_start, strip.frame_end, strip.action_frame_start, strip.influence)
                digest += f"@{placed}"
            found.add(digest)
    return " ".join(sorted(found))


def _of_action(action: bpy.types.Action, slot: Any) -> str:
    digest = 0
    for curve in sorted(action_curves(action, slot), key=lambda curve: (curve.data_path, curve.array_index)):
        digest = zlib.crc32(f"{curve.data_path}[{curve.array_index}]{curve.mute}".encode(), digest)
        for part in ("co", "handle_left", "handle_right"):
            values = np.empty(len(curve.keyframe_points) * 2, dtype=np.float32)
            curve.keyframe_points.foreach_get(part, values)
            digest = zlib.crc32(values.tobytes(), digest)
    return f"{digest:08x}"
