"""Presets that the material slots of a ground name, and which faces are of which slot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.errors import InputError
from ..core.ground.surfaces import SURFACES
from ..core.settings import RegionSettings
from .preset_files import named

HARD = "none"
"""In `Material.softground_preset`, in place of the file name of a preset: a floor that bears and does not give way."""
ATTRIBUTE = "softground_region"
"""Integer attribute on faces: number of the slot whose preset counts instead of the face's own; less than 0 is none."""
MARK = "softground_surface"
"""Custom property of the add-on's own materials, with the surface that they show: no other material is touched."""
OVER = "softground_over"
"""Custom property of the add-on's copies of the user's materials, with the material that they are of."""
LENGTHS = ("rim_reach", "blur_sigma")
"""Fields of a material that go with the soles."""


def theirs(material: bpy.types.Material | None) -> Any:
    """The user's material that a slot shows, or that the add-on's copy in it is of."""
    return material and (material.get(OVER) or material)


def naming(ground: bpy.types.Object) -> Iterator[tuple[int, bpy.types.Material, str]]:
    """Slots that name a preset, by their numbers, with the user's material and the name."""
    for number, slot in enumerate(ground.material_slots):
        material = theirs(slot.material)
        if material is not None and material.softground_preset:
            yield number, material, material.softground_preset


def surface_of(material: bpy.types.Material | None) -> str:
    """Surface of the preset that the material of a slot names; empty where it names none, or a hard floor."""
    named_by = theirs(material)
    return _region(0, named_by.softground_preset, 1.0).surface if named_by and named_by.softground_preset else ""


def title_of(material: bpy.types.Material | None) -> str:
    """Name of the preset that a material of the user's names, as the panel says it; after a `?` where there is none."""
    name = material.softground_preset if material else ""
    if name in ("", HARD):
        return "Hard Floor" if name else "As the Ground"
    try:
        return named(name).name
    except InputError:
        return f"? {name}"


def choose(ground: bpy.types.Object | None, slot: int | str, preset: str) -> None:
    """Have the material of a slot of a ground name a preset.

    Parameters
    ----------
    ground : bpy.types.Object or None
    slot : int or str
        Its number, or the name of its material.
    preset : str
        Name of its file, `HARD`, or nothing for what the rest of the ground is made of.

    Raises
    ------
    InputError
        If there is no such slot, it has no material of the user's that can be changed, or there is no such preset.
    """
    materials = [theirs(each.material) for each in ground.material_slots] if ground else []
    number = next((n for n, each in enumerate(materials) if each and each.name == slot), slot)
    if ground is None or number not in range(len(materials)):
        names = ", ".join(repr(each.name) for each in materials if each)
        raise InputError(f"The ground has no such material slot, {slot!r}: choose one of its materials ({names}).")
    material = materials[int(number)]
    if material is None:
        raise InputError(f"Slot {int(number) + 1} of '{ground.name}' has no material: give it one first.")
    if material.library or material.override_library:
        raise InputError(f"Material '{material.name}' is linked from another file: make it local, and choose then.")
    if material.get(MARK) in SURFACES:
        raise InputError(
            f"Material '{material.name}' goes with the preset of the ground: choose that one, or give the slot a "
            "material of your own."
        )
    if preset not in ("", HARD):
        named(preset)
    material.softground_preset = preset


def regions_of(ground: bpy.types.Object, length_scale: float) -> tuple[RegionSettings, ...]:
    """Slots of a ground that name a preset; those of one that is not there have no material.

    Parameters
    ----------
    length_scale : float
        Of the rims, for small soles.
    """
    return tuple(_region(number, name, length_scale) for number, _, name in naming(ground))


def _region(number: int, name: str, length_scale: float) -> RegionSettings:
    if name == HARD:
        return RegionSettings(number, HARD, "", None)
    try:
        preset = named(name)
    except InputError:
        return RegionSettings(number, name, "", None)
    scaled = {field: float(f"{getattr(preset.material, field) * length_scale:.7g}") for field in LENGTHS}
    return RegionSettings(number, name, preset.surface, replace(preset.material, **scaled))


def check(ground: bpy.types.Object) -> None:
    """Raise InputError if a slot of a ground names a preset that cannot be read, or the attribute is none of faces."""
    slots = list(naming(ground))
    for _, material, name in slots:
        if name != HARD:
            try:
                named(name)
            except InputError as error:
                raise InputError(f"Material '{material.name}' of ground '{ground.name}': {error}") from None
    mesh: Any = ground.data
    attribute = mesh.attributes.get(ATTRIBUTE)
    if slots and attribute and (attribute.domain, attribute.data_type) != ("FACE", "INT"):
        raise InputError(
            f"Attribute '{ATTRIBUTE}' of ground '{ground.name}' is not an integer on faces: convert it in Object Data "
            "Properties > Attributes (domain Face, type Integer)."
        )


def of_faces(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Number of the slot whose preset counts on each face, (P,)."""
    slot, other = (_integers(mesh, name) for name in ("material_index", ATTRIBUTE))
    slots = np.zeros(len(mesh.polygons), np.int32) if slot is None else np.maximum(slot, 0)
    return slots if other is None else np.where(other < 0, slots, other)


def _integers(mesh: bpy.types.Mesh, name: str) -> NDArray[np.int32] | None:
    attribute: Any = mesh.attributes.get(name)
    if attribute is None or (attribute.domain, attribute.data_type) != ("FACE", "INT"):
        return None
    values = np.empty(len(attribute.data), np.int32)
    attribute.data.foreach_get("value", values)
    return values
