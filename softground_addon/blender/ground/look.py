"""The look of a ground follows its preset: what the add-on made changes with it, the user's own only when asked.

What is mixed over a material of the user's is a copy of it, which knows whose it is; the material itself stays.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ...core.ground.surfaces import SURFACES
from ..ground_slots import HARD, MARK, OVER, surface_of, theirs
from ..materials import materials
from ..rigs.object_data import mesh_of
from . import baked_ground


def follow(options: Any) -> None:
    """Show the scene's surface on its ground wherever the add-on's own material is."""
    ground = options.ground
    for obj in dict.fromkeys((ground, baked_ground.display_mesh_of(ground))) if ground else ():
        _show(obj, options.material.surface, over_theirs=False)


def apply(ground: bpy.types.Object, surface: str) -> int:
    """Show a surface on a ground, over the user's materials by where its prints are; and in each slot that names a
    preset, the surface of that. Hard floors stay as they are.

    Returns
    -------
    int
        Number of the user's materials that it is mixed over.
    """
    obj = baked_ground.display_mesh_of(ground)
    if not obj.material_slots:
        mesh_of(obj).materials.append(materials.ensure_material(surface))
    _show(obj, surface, over_theirs=True)
    return count_over_theirs(obj)


def count_over_theirs(obj: bpy.types.Object) -> int:
    """Number of an object's slots that show a material that was mixed over one of the user's."""
    return sum(slot.material is not None and slot.material.get(OVER) is not None for slot in obj.material_slots)


def take_off(obj: bpy.types.Object) -> None:
    """Give an object the user's materials back, over which the add-on's were mixed; mixed ones that went with a copy of
    a ground go, too."""
    for slot in _writable_slots(obj):
        if (mixed := slot.material) and (under := mixed.get(OVER)):
            _replace(slot, under)
    unused = [each for each in bpy.data.materials if each.get(OVER) and not (each.users or each.library)]
    bpy.data.batch_remove(unused)


def _show(obj: bpy.types.Object, surface: str, *, over_theirs: bool) -> None:
    for slot in _writable_slots(obj):
        now, look = slot.material, surface
        if (named := theirs(now)) and named.softground_preset:
            if named.softground_preset == HARD:
                continue
            look = surface_of(now) or surface
        if now is None:
            if over_theirs:
                slot.material = materials.ensure_material(look)
        elif mixed_over := now.get(OVER):
            _replace(slot, materials.ensure_over(mixed_over, look))
        elif now.get(MARK) in SURFACES:
            slot.material = materials.ensure_material(look)
        elif over_theirs and now.get(MARK) is None:
            slot.material = materials.ensure_over(now, look)


def _writable_slots(obj: bpy.types.Object) -> Iterator[Any]:
    for slot in obj.material_slots:
        owner: Any = obj if slot.link == "OBJECT" else obj.data
        if owner.library is None:
            yield slot


def _replace(slot: Any, material: bpy.types.Material) -> None:
    """Put another material in place of a mixed one, which goes where nothing else shows it."""
    mixed = slot.material
    slot.material = material
    if mixed != material and not mixed.users:
        bpy.data.materials.remove(mixed)
