"""Whether a mesh can be the ground: what keeps it from taking a bake, and what the user should know of it."""

from __future__ import annotations

import bpy

from ...core.errors import InputError
from . import ground_mesh, trail_detail

TIME_DEPENDENT = ("BUILD", "CLOTH", "EXPLODE", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "SOFT_BODY", "WAVE")
"""Modifiers that change a mesh from frame to frame with nothing keyed."""


def check_writable(ground: bpy.types.Object) -> None:
    """Raise InputError, naming the object and the remedy, if this ground cannot be changed at the moment."""
    name = ground.name
    if ground.type != "MESH":
        raise InputError(f"Ground '{name}' is no mesh: choose a mesh object, or press Create Ground.")
    if ground.library or ground_mesh.mesh_of(ground).library or ground.override_library:
        raise InputError(
            f"Ground '{name}' is linked from another file and cannot be changed here: make it local "
            "(Object > Relations > Make Local), or bake in the file that it comes from."
        )
    if ground.mode == "EDIT":
        raise InputError(f"Ground '{name}' is in Edit Mode: leave it with Tab first.")


def check_usable(ground: bpy.types.Object) -> None:
    """Raise InputError, naming the object and the remedy, if a bake could not be written to this ground."""
    for thing in filter(None, (ground, trail_detail.detail_of(ground))):
        check_writable(thing)
    name = ground.name
    mesh = ground_mesh.mesh_of(ground)
    if mesh.users - mesh.use_fake_user > 1:
        raise InputError(
            f"Ground '{name}' shares its mesh with other objects: make it single-user first "
            "(Object > Relations > Make Single User > Object & Data)."
        )
    if not len(mesh.polygons):
        raise InputError(f"Ground '{name}' has no faces: choose a surface, or press Create Ground.")
    if mesh.shape_keys and not ground_mesh.has_remains(ground):
        raise InputError(
            f"Ground '{name}' has shape keys of its own: apply them (Object > Apply > Visual Geometry to Mesh), or "
            "choose a copy without them."
        )
    if abs(ground.matrix_world.to_3x3().determinant()) < 1e-12:
        raise InputError(f"Ground '{name}' is scaled to nothing: give it a scale other than 0 (Alt-S).")
    moved_by = _what_moves(ground)
    if moved_by:
        raise InputError(
            f"Ground '{name}' moves: {moved_by} is animated. Only ground that stands still takes prints: take the "
            "keys and drivers off it, or choose a copy without them."
        )


def changes_with_time(ground: bpy.types.Object) -> str:
    """Name of the first modifier that gives the ground another shape at each frame, or an empty text."""
    theirs = (item for item in ground.modifiers if item not in ground_mesh.own_modifiers(ground))
    return next((item.name for item in theirs if item.show_viewport and item.type in TIME_DEPENDENT), "")


def _what_moves(ground: bpy.types.Object) -> str:
    """Name of the object whose animation moves the ground, or an empty text."""
    node: bpy.types.Object | None = ground
    while node:
        animation = node.animation_data
        if animation and (animation.action or animation.drivers or any(not t.mute for t in animation.nla_tracks)):
            return f"'{node.name}'"
        node = node.parent
    return ""
