"""Presets as a scene holds them: applied, compared, saved, taken by default, and fitted to the soles."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

import bpy

from ..core.errors import InputError
from ..core.ground import presets
from ..core.ground.presets import Preset
from ..core.motion.sole_motion import shortest_length
from .ground_slots import LENGTHS
from .preset_files import user_folder
from .settings import ADD_ON, MATERIAL_FIELDS, material_of, typed

SMALL_SOLE = 0.1
"""Lengths of presets are those of soles of a person; of soles smaller than this they are as much smaller [m]."""


def apply_preset(options: Any, preset: Preset) -> None:
    """Set the scene's ground to a preset's; what the preset does not say, and a cell size of the user's own, stay."""
    for group, field, value in _of_preset(options, preset):
        setattr(group, field, value)
    if preset.cells_along_sole is not None and options.cells_along_sole > 0:
        options.cells_along_sole = preset.cells_along_sole
        fit_cells(options)


def as_preset(options: Any, name: str, source: str = "") -> Preset:
    """The scene's ground as a preset of that name."""
    material = material_of(options.material)
    scale = typed(options.length_scale)
    return Preset(
        name,
        source,
        options.material.surface,
        replace(material, **{field: float(f"{getattr(material, field) / scale:.5g}") for field in LENGTHS}),
        options.pressure,
        typed(options.tread),
        typed(options.cells_along_sole) or None,
        options.debris,
    )


def holds(options: Any, preset: Preset) -> bool:
    """True if the scene's ground is as a preset says, or will be with its first character."""
    for group, field, value in _of_preset(options, preset):
        if not options.characters and not group.is_property_set(field):
            continue
        if not _is(group, field, value):
            return False
    return True


def _is(group: Any, field: str, value: Any) -> bool:
    """True if a setting has a value, but for rounding."""
    now = getattr(group, field)
    return bool(abs(now - value) <= 1e-6 * abs(value) if isinstance(value, float) else now == value)


def take_defaults(options: Any) -> None:
    """Set what the user has not set of the ground to the preset of the preferences, and the cells to fit the soles.

    For the first character of a scene. What is as by default is set too: a file keeps only what was set.
    """
    preset = default_preset()
    for group, field, value in _of_preset(options, preset):
        if not group.is_property_set(field):
            setattr(group, field, value)
    if not options.is_property_set("cell_size") and not options.is_property_set("cells_along_sole"):
        options.cells_along_sole = preset.cells_along_sole or options.cells_along_sole


def default_preset() -> Preset:
    """Preset that scenes start with: the one of the user's preferences, or the add-on's own where that is gone."""
    with suppress(InputError):
        return presets.find(_preferred(), (presets.FOLDER, user_folder()))
    return presets.find(presets.DEFAULT)


def _preferred() -> str:
    """The preset that the user's preferences name; in background the add-on's own, for farms to bake alike."""
    add_on: Any = bpy.context.preferences.addons.get(ADD_ON)
    if bpy.app.background or add_on is None or add_on.preferences is None:
        return presets.DEFAULT
    return str(add_on.preferences.default_preset)


def preset_of(options: Any) -> str:
    """The name of the preset that a scene was set to last, or will be with its first character."""
    if options.characters or options.material.is_property_set("preset"):
        return str(options.material.preset)
    return _preferred()


def untouched(options: Any) -> list[tuple[Any, str]]:
    """The settings that `take_defaults` would set, as groups and names."""
    fields = [(group, field) for group, field, _ in _of_preset(options, default_preset())]
    fields += [(options, "cell_size"), (options, "cells_along_sole")]
    return [(group, field) for group, field in fields if not group.is_property_set(field)]


def make_of(options: Any, material: Any, preset: Preset) -> None:
    """Set the material of one of the scene's grounds to a preset's."""
    for group, field, value in _of_material(options, material, preset):
        setattr(group, field, value)


def _of_material(options: Any, material: Any, preset: Preset) -> list[tuple[Any, str, Any]]:
    scale = {field: typed(options.length_scale) for field in LENGTHS}
    said = [(material, field, getattr(preset.material, field) * scale.get(field, 1.0)) for field in MATERIAL_FIELDS]
    return [*said, (material, "preset", preset.name), (material, "surface", preset.surface)]


def _of_preset(options: Any, preset: Preset) -> list[tuple[Any, str, Any]]:
    """Contents of a preset: groups of settings, names in them, values."""
    said = _of_material(options, options.material, preset)
    said += [(options, "pressure", preset.pressure), (options, "tread", preset.tread)]
    said += [(options, "debris", preset.debris)]
    return [entry for entry in said if entry[2] is not None]


def fit_cells(options: Any) -> None:
    """Set the cell size, and lengths for small soles, to what the preset says of them, unless the user has set them."""
    count, lengths = (
        options.cells_along_sole,
        [character.sole_length for character in options.characters if character.sole_length > 0],
    )
    if not lengths:
        return
    shortest = shortest_length(lengths)
    if count > 0:
        options.cell_size = float(f"{shortest / count:.2g}")
        options.cells_along_sole = count  # which a cell size of the user's own switches off
    with suppress(InputError):
        preset = presets.find(preset_of(options), (presets.FOLDER, user_folder()))
        as_said = [
            character for character in _of_preset(options, preset) if character[1] in LENGTHS and _is(*character)
        ]
        before, options.length_scale = options.length_scale, min(1.0, shortest / SMALL_SOLE)
        for group, field, value in as_said if options.length_scale != before else ():
            setattr(group, field, value / before * options.length_scale)
