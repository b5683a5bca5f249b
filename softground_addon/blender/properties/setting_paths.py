"""Settings by path, as `PATH=VALUE` on a command line: found, checked, assigned."""

from __future__ import annotations

import re
from typing import Any

import bpy

from ...core.errors import InputError
from .. import ground_slots

SLOTS = "slots"
"""Begin of a path to the preset of a material slot of the ground, by its number or the name of its material."""

_STEP = re.compile(r"\.?([A-Za-z_]\w*)|\[(-?\d+)\]|\[(?:\"([^\"]*)\"|'([^']*)')\]")


def check_stored(group: Any) -> None:
    """True if all values of a group of settings are such as its fields take: those of a forged file may be any.

    Raises
    ------
    InputError
        If one is not; names it.
    """
    for field in group.bl_rna.properties:
        if field.identifier in (*_OTHERS, "name"):
            continue
        value = getattr(group, field.identifier)
        if field.type == "COLLECTION":
            for item in value:
                check_stored(item)
        elif field.type == "POINTER":
            if isinstance(value, bpy.types.PropertyGroup):
                check_stored(value)
        elif not _takes(field, value):
            raise InputError(
                f"The file holds {value!r} as '{field.name}', which it cannot be: right-click it, choose Reset to "
                "Default Value, and set it again."
            )


def _takes(field: Any, value: Any) -> bool:
    if field.type in ("FLOAT", "INT"):
        return all(field.hard_min <= number <= field.hard_max for number in (value if field.is_array else (value,)))
    return field.type != "ENUM" or value != ""  # Blender gives no name to a number that names nothing


def assign(settings: bpy.types.PropertyGroup, path: str, text: str) -> None:
    """Set one setting by its path below `scene.softground`, e.g. `characters[0].mass` to `80`, or the preset of a
    material of the ground, e.g. `slots["Rock"]` to `none`.

    Raises
    ------
    InputError
        If there is no such setting, or the value is none that it takes; says which there are.
    """
    owner: Any = settings
    steps = _parse(path)
    if steps[0] == SLOTS and len(steps) == 2:
        ground_slots.choose(owner.ground, steps[1], text)
        return
    for step in steps[:-1]:
        owner = _descend(owner, step, path)
    name = steps[-1]
    properties = getattr(owner, "bl_rna", None) and owner.bl_rna.properties
    if not properties or not isinstance(name, str) or name not in properties or properties[name].is_readonly:
        raise InputError(f"There is no setting '{path}'. {_choices(owner)}")
    setattr(owner, name, _value(properties[name], text, path))


def _parse(path: str) -> list[str | int]:
    steps: list[str | int] = []
    position = 0
    while position < len(path):
        match = _STEP.match(path, position)
        if not match or (match[0].startswith(".") and not steps):
            raise InputError(
                f"'{path}' is not a path to a setting, like material.youngs_modulus or characters[0].mass."
            )
        name, index, *quoted = match.groups()
        steps.append(int(index) if index else name or next(text for text in quoted if text is not None))
        position = match.end()
    if not steps:
        raise InputError("An empty path names no setting.")
    return steps


_OTHERS = ("rna_type", "armature", "ground", "tread_image")
"""What settings name but do not hold."""


def _descend(owner: Any, step: str | int, path: str) -> Any:
    is_list = isinstance(owner, bpy.types.bpy_prop_collection) or not hasattr(owner, "bl_rna")
    try:
        if is_list:
            return owner[step]
        if isinstance(step, str) and step in owner.bl_rna.properties and step not in _OTHERS:
            return getattr(owner, step)
    except (KeyError, IndexError, TypeError):
        pass
    raise InputError(f"There is no setting '{path}' ({step!r} is unknown). {_choices(owner)}")


def _choices(owner: Any) -> str:
    properties = getattr(owner, "bl_rna", None) and owner.bl_rna.properties
    if not properties:
        return ""
    return "There are: " + ", ".join(key for key in properties.keys() if key not in ("rna_type", "name")) + "."  # noqa: SIM118


def _value(setting: Any, text: str, path: str) -> Any:
    kind = setting.type
    if kind in ("FLOAT", "INT"):
        try:
            number = float(text) if kind == "FLOAT" else int(text)
        except ValueError:
            number = float("nan")
        if not setting.hard_min <= number <= setting.hard_max:
            raise InputError(
                f"'{path}' cannot be {text!r}: it takes a number from {setting.hard_min:g} to {setting.hard_max:g}."
            )
        return number
    if kind == "BOOLEAN":
        if text.lower() not in ("true", "false", "1", "0", "on", "off"):
            raise InputError(f"'{path}' cannot be {text!r}: it takes true or false.")
        return text.lower() in ("true", "1", "on")
    if kind == "ENUM":
        names = [item.identifier for item in setting.enum_items]
        if text not in names:
            raise InputError(f"'{path}' cannot be {text!r}: it takes one of {', '.join(names)}.")
        return text
    if kind == "STRING":
        return text
    blocks: dict[str, Any] = {"Object": bpy.data.objects, "Image": bpy.data.images}
    if kind == "POINTER" and (target := setting.fixed_type.identifier) in blocks:
        if text not in blocks[target]:
            raise InputError(f"'{path}' cannot be {text!r}: there is no {target.lower()} of that name.")
        return blocks[target][text]
    raise InputError(f"'{path}' is a group of settings: name one of those in it.")
