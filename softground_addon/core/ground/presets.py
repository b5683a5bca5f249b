"""Ground presets: named materials as JSON, validated; nothing in a preset is executed."""

from __future__ import annotations

import json
import math
import re
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import cast, get_args

from ..errors import InputError, damaged
from . import surfaces
from .field_tests import boot_depth
from .material import MATERIAL_RANGES, GroundMaterial, Pressure

FOLDER = Path(__file__).parents[2] / "presets"
"""Where the presets that come with the add-on are."""

DEFAULT = "Snow"
"""The preset that a scene starts with."""

SCHEMA_VERSION = 1

LARGEST = 2**20
"""Size of a preset that is read [bytes]."""


SECTIONS = {"EVERYDAY": "Everyday", "MEASURED": "Measured", "PAPER": "Paper"}
"""Parts of the menu that a preset may ask for, with their titles, in their order."""


@dataclass(frozen=True)
class Preset:
    """A named ground.

    Attributes
    ----------
    name : str
        What the user sees.
    source : str
        Where its numbers come from.
    surface : str
        See `surfaces`.
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE', optional
    tread : float, optional
        Depth of the bars of shoes [m].
    cells_along_sole : float, optional
        Cells that lie along the shortest sole.
    debris : bool, optional
        True if steps throw what physics says.
    section : str, optional
        One of `SECTIONS`.

    What is optional stays as it was where it is None.
    """

    name: str
    source: str
    surface: str
    material: GroundMaterial
    pressure: Pressure | None = None
    tread: float | None = None
    cells_along_sole: float | None = None
    debris: bool | None = None
    section: str | None = None


RANGES = {"tread": (0.0, 0.1), "cells_along_sole": (4.0, 1000.0)}
"""Smallest and largest value of the numbers beside the material: [m], and a count."""


def validate_material(values: Mapping[str, object], origin: str) -> GroundMaterial:
    """The material with these values, each checked against `MATERIAL_RANGES`.

    Raises
    ------
    InputError
        Naming `origin`, the field and the accepted range. Fields that have a default may be missing.
    """
    known = {field.name for field in fields(GroundMaterial)}
    for name, value in values.items():
        if name not in known:
            raise damaged(origin, f"unknown field '{name}'. Known are: {', '.join(sorted(known))}.")
        _check(name, value, MATERIAL_RANGES.get(name, (-math.inf, math.inf)), origin)
    try:
        return GroundMaterial(**{name: float(value) for name, value in values.items()})  # type: ignore[arg-type]
    except TypeError:
        missing = sorted({"youngs_modulus", "poisson_ratio", "characteristic_time"} - set(values))
        raise damaged(origin, f"the material lacks {', '.join(missing)}.") from None


def _check(name: str, value: object, limits: tuple[float, float], origin: str) -> None:
    low, high = limits
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise damaged(origin, f"'{name}' is {value!r}; it must be a number from {low:g} to {high:g}.")


def parse(text: str, origin: str) -> Preset:
    """A preset from the text of its JSON file.

    Raises
    ------
    InputError
        If the text is no JSON, is of another schema, or holds values out of range. Names `origin` and the remedy.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise damaged(origin, f"this is not JSON ({error}). Save the preset again, or delete the file.") from None
    if not isinstance(content, dict) or content.get("schema_version") != SCHEMA_VERSION:
        raise damaged(origin, f"this is not a SoftGround preset of schema_version {SCHEMA_VERSION}.")
    name, source, surface = (
        content.get(key, default) for key, default in (("name", ""), ("source", ""), ("surface", surfaces.DEFAULT))
    )
    material = content.get("material")
    if not isinstance(name, str) or not name.strip():
        raise damaged(origin, "the preset has no 'name'.")
    if not isinstance(source, str):
        raise damaged(origin, "'source' must be text.")
    surfaces.find(surface, origin)
    if not isinstance(material, dict):
        raise damaged(origin, "the preset has no 'material' table.")
    pressure, numbers = content.get("pressure"), {}
    if pressure is not None and pressure not in get_args(Pressure):
        raise damaged(origin, f"'pressure' is {pressure!r}; it must be one of {', '.join(get_args(Pressure))}.")
    for key, limits in RANGES.items():
        if (number := content.get(key)) is not None:
            _check(key, number, limits, origin)
            numbers[key] = float(number)
    debris = content.get("debris")
    if not isinstance(debris, bool | None):
        raise damaged(origin, f"'debris' is {debris!r}; it must be true or false.")
    section = content.get("section")
    if section is not None and section not in SECTIONS:
        raise damaged(origin, f"'section' is {section!r}; it must be one of {', '.join(SECTIONS)}.")
    checked, spread = validate_material(material, origin), cast("Pressure | None", pressure)
    return Preset(name, source, surface, checked, spread, **numbers, debris=debris, section=section)


def load(path: Path) -> Preset:
    """The preset in a file.

    Raises
    ------
    InputError
        If the file cannot be read or is no valid preset.
    """
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode) or about.st_size > LARGEST:
            raise OSError(f"it is not a regular file of up to {LARGEST} bytes")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Preset '{path}' cannot be read: {error}", "unreadable_file", path=path) from None
    return parse(text, f"Preset '{path}'")


def dump(preset: Preset) -> str:
    """The text of the preset's JSON file."""
    content = {key: value for key, value in asdict(preset).items() if value is not None}
    content = {"schema_version": SCHEMA_VERSION, **content}
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def bare(name: str) -> str:
    """A name as it is compared: letters and digits, whatever their case and what stands between them."""
    return re.sub(r"[\W_]+", "_", name.casefold()).strip("_")


def soft_to_firm(shown: Iterable[Preset]) -> list[Preset]:
    """Presets of one section as the menu lists them: look by look, the one with the softest ground first."""
    depths = {preset: boot_depth(preset.material) for preset in shown}
    softest: dict[str, float] = {}
    for preset, depth in depths.items():
        softest[preset.surface] = max(depth, softest.get(preset.surface, 0.0))
    return sorted(depths, key=lambda item: (-softest[item.surface], item.surface, -depths[item], item.name.casefold()))


def _files(folders: tuple[Path, ...]) -> list[Path]:
    return [path for folder in folders for path in sorted(folder.glob("*.json"))]


def names(folders: tuple[Path, ...] = (FOLDER,)) -> list[str]:
    """Names of the presets in some folders, in their order; broken files are left out."""
    names_of_files = []
    for path in _files(folders):
        with suppress(InputError):
            names_of_files.append(load(path).name)
    return names_of_files


def find(name: str, folders: tuple[Path, ...] = (FOLDER,)) -> Preset:
    """The preset of that file stem or display name, the first found in `folders`.

    Raises
    ------
    InputError
        If there is none, listing those that there are.
    """
    wanted, paths = bare(name), _files(folders)
    for path in paths:
        if bare(path.stem) == wanted:
            return load(path)
    for path in paths:
        with suppress(InputError):  # another preset's file may be broken
            if bare((preset := load(path)).name) == wanted:
                return preset
    known = ", ".join(path.stem for path in paths)
    raise InputError(f"There is no preset '{name}'. Choose from {known}.", "unknown_preset", name=name)
