"""Checks of a mesh that is to be the ground: faults that prevent a bake, with their remedies."""

from __future__ import annotations

import bpy

from ...core.errors import InputError
from ..playback import own_data, playback
from . import ground_mesh, still_ground, trail_detail


def check_writable(ground: bpy.types.Object) -> None:
    """Raise InputError, naming the object and the remedy, if this ground cannot be changed at the moment."""
    name = ground.name
    if ground.type != "MESH":
        raise InputError(f"Ground '{name}' is not a mesh: choose a mesh object, or press Create Ground.")
    if ground.library or ground_mesh.mesh_of(ground).library or ground.override_library:
        raise InputError(
            f"Ground '{name}' is linked from another file and cannot be changed here: make it local "
            "(Object > Relations > Make Local), or bake in the file that it comes from."
        )
    if ground.mode == "EDIT":
        raise InputError(f"Ground '{name}' is in Edit Mode: leave it with Tab first.")
    for key, beside in ground.items():  # debris and marks
        if key.startswith("softground") and isinstance(beside, bpy.types.Object) and _is_edited(beside):
            raise InputError(f"'{beside.name}' beside ground '{name}' is in Edit Mode: leave it with Tab first.")


def _is_edited(obj: bpy.types.Object) -> bool:
    return isinstance(obj.data, bpy.types.Mesh) and obj.data.is_editmode


def check_playable(display_mesh: bpy.types.Object) -> None:
    """Raise InputError, naming the modifier, if no playback could come before this object's modifiers."""
    if barrier := playback.barrier_on(display_mesh):
        raise InputError(
            f"The modifier '{barrier.name}' of '{display_mesh.name}' keeps prints from playing: apply or remove it."
        )


def hard_fault(obj: bpy.types.Object, ground: bpy.types.Object | None = None, where: str = "in Hard Ground") -> str:
    """Fault that prevents soles from standing on an object beside the ground, and the remedy; empty if there is none.

    `where` it is listed, for messages.
    """
    name = obj.name
    if obj.type != "MESH":
        return f"'{name}' {where} is not a mesh: convert it (Object > Convert > Mesh), or remove it from the list."
    if obj.mode == "EDIT":
        return f"'{name}' {where} is in Edit Mode: leave it with Tab first."
    mover, carrier = still_ground.mover_of(obj), still_ground.mover_of(ground) if ground else None
    if mover and mover != carrier:
        return f"'{name}' {where} moves, as '{mover.name}' is animated: remove it from the list, or its keys."
    if carrier and mover is None:
        return (
            f"'{name}' {where} stands still while '{carrier.name}' moves the ground: parent it to that, or "
            "remove it from the list."
        )
    if by := still_ground.changes_shape(obj):
        return f"'{name}' {where} changes its shape by {by}: remove it from the list, or apply that."
    return ""


def check_usable(ground: bpy.types.Object) -> None:
    """Raise InputError, naming the object and the remedy, if a bake could not be written to this ground."""
    if (of := trail_detail.ground_of(ground)) != ground:
        raise InputError(f"'{ground.name}' shows the prints of ground '{of.name}': choose '{of.name}' in Ground.")
    detail = trail_detail.detail_of(ground)
    for obj in filter(None, (ground, detail)):
        check_writable(obj)
    if detail:
        check_playable(detail)
    name = ground.name
    mesh = ground_mesh.mesh_of(ground)
    if mesh.users - mesh.use_fake_user > 1:
        raise InputError(
            f"Ground '{name}' shares its mesh with other objects: make it single-user first "
            "(Object > Relations > Make Single User > Object & Data)."
        )
    if not len(mesh.polygons) and not any(modifier.show_viewport for modifier in ground.modifiers):
        raise InputError(f"Ground '{name}' has no faces: choose a surface, or press Create Ground.")
    if mesh.shape_keys and not ground_mesh.has_remains(ground):
        raise InputError(
            f"Ground '{name}' has shape keys of its own: apply them (Object > Apply > Visual Geometry to Mesh), or "
            "choose a copy without them."
        )
    parent = ground.parent
    if parent and ground.parent_type in ("ARMATURE", "LATTICE") and parent.type == ground.parent_type:
        raise InputError(
            f"Ground '{name}' is bent by its parent '{parent.name}': apply that (Object > Apply > Visual Geometry to "
            "Mesh), and parent it again with Object (Ctrl-P > Object)."
        )
    if taken := own_data.users_own(ground):
        raise InputError(
            f"Ground '{name}' has data of its own called '{taken[0]}', which a bake would need: give it another name "
            "(Object Data > Attributes, Vertex Groups or Custom Properties), or choose a copy without it."
        )
    if abs(ground.matrix_world.to_3x3().determinant()) < 1e-12:
        raise InputError(f"Ground '{name}' is scaled to zero: give it a scale other than 0 (Alt-S).")
