"""Presets that the material slots of a ground name, and which faces are of which slot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.errors import InputError
from ..core.ground import presets
from ..core.settings import RegionSettings
from .state import state

HARD = "none"
"""In `Material.softground_preset`, in place of the file name of a preset: a floor that bears and does not give way."""
ATTRIBUTE = "softground_region"
"""Integer attribute on faces: number of the slot whose preset counts instead of the face's own; less than 0 is none."""
OVER = "softground_over"
"""Custom property of the add-on's copies of the user's materials, with the material that they are of."""
LENGTHS = ("rim_reach", "blur_sigma")
"""Fields of a material that go with the soles."""

USER_FOLDER = "presets/softground"
"""Where the user's presets are, below the folder of Blender's user scripts."""


def user_folder() -> Path:
    """Folder of the user's presets, which may not be there yet."""
    return Path(bpy.utils.user_resource("SCRIPTS", path=USER_FOLDER))


def loaded(path: Path) -> presets.Preset:
    """The preset in a file, read again only where it was written since."""
    written = path.stat().st_mtime_ns
    if path not in state.presets or state.presets[path][0] != written:
        state.presets[path] = written, presets.load(path)
    preset: presets.Preset = state.presets[path][1]
    return preset


def listed(folder: Path) -> tuple[list[tuple[Path, presets.Preset]], list[str]]:
    """The presets of a folder by name, and what is wrong with the files that are none."""
    entries, broken = [], []
    for path in sorted(folder.glob("*.json")):
        try:
            entries.append((path, loaded(path)))
        except InputError as error:
            broken.append(str(error))
    return sorted(entries, key=lambda entry: entry[1].name.casefold()), broken


def named(name: str) -> presets.Preset:
    """The preset of that file name; errors as of `presets.find`."""
    for folder in (presets.FOLDER, user_folder()):
        path = folder / f"{name}.json"
        if path.parent == folder and path.is_file():
            return loaded(path)
    return presets.find(name, (presets.FOLDER, user_folder()))


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


def regions_of(ground: bpy.types.Object, length_scale: float = 1.0) -> tuple[RegionSettings, ...]:
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
