"""Values of a manifest: text, names of files, paths, frames and settings, each checked as it is read."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from pathlib import Path

from ..core.errors import InputError

LONGEST_NAME = 150
"""Most bytes of a shot's name in UTF-8: file systems take 255, of which the names of partial files need some."""


_WINDOWS = os.name == "nt"


_NOT_IN_NAMES = "/\\"
"""Letters that no part of a file's name may have."""


_NOT_ON_WINDOWS = re.compile(
    r"""
    .* [\x00-\x1f<>:"|?*] .*          # a colon would even hide the file within another
    | .* [.\ ]                        # left out of the name: 'a.' would be the same file as 'a'
    | (con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9¹²³]) \ * (\..*)?  # devices, whatever follows the dot
    """,
    re.VERBOSE | re.IGNORECASE | re.DOTALL,
)
"""Names that Windows takes for another file's or a device's.

References
----------
Microsoft, "Naming Files, Paths, and Namespaces".
"""


DEEPEST = 10
"""Most tables within each other below `set`; settings lie three deep."""


FRAME_LIMIT = 1_048_574
"""Largest frame number that Blender takes, and minus the smallest."""


def frame_range(text: str) -> tuple[int, int]:
    """First and last frame from a text such as 1-250; ValueError for any other."""
    match = re.fullmatch(r"(-?\d+)-(-?\d+)", text.strip())
    if not match:
        raise ValueError(f"'{text}' is not a frame range such as 1-250")
    first, last = int(match[1]), int(match[2])
    if max(abs(first), abs(last)) > FRAME_LIMIT:
        raise ValueError(f"'{text}' is not a frame range: frames go from {-FRAME_LIMIT:,} to {FRAME_LIMIT:,}")
    return first, last


def name_in(value: object, where: str) -> str:
    name = text_in(value, f"{where}: 'name'")
    if name in (".", "..") or set(name) & set(_NOT_IN_NAMES) or len(name.encode()) > LONGEST_NAME:
        raise InputError(
            f"{where}: the name {name!r} cannot be part of a file's name: give a 'name' without any of {_NOT_IN_NAMES} "
            f"and of at most {LONGEST_NAME} bytes."
        )
    if _WINDOWS and _NOT_ON_WINDOWS.fullmatch(name):
        raise InputError(
            f"{where}: the name {name!r} cannot be part of a file's name on Windows: give a 'name' without any of "
            '<>:"|?*, that does not end with a dot or a space and is no device such as CON.'
        )
    return name


def text_in(value: object, where: str) -> str:
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise InputError(f"{where} is {value!r}; it must be text.")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise InputError(f"{where} is {value!r}, which is not Unicode text: rename the file.") from None
    return value


def path_in(value: object, folder: Path, where: str) -> Path:
    return Path(os.path.realpath(folder / text_in(value, where)))


def preset_in(value: object, folder: Path, where: str) -> str:
    if value == "":
        return ""
    name = text_in(value, f"{where}: 'preset'")
    return str(path_in(name, folder, where)) if name.lower().endswith(".json") else name


def grounds_in(value: object, folder: Path, where: str) -> tuple[str, ...]:
    """Grounds, `NAME` or `NAME=PRESET` each, with absolute paths of preset files."""
    if not isinstance(value, list):
        raise InputError(f"{where}: 'grounds' is {value!r}; it must be a list such as ['Yard=Mud', 'Crate'].")
    named = [text_in(text, f"{where}: 'grounds'").rpartition("=") for text in value]
    return tuple(
        f"{name}{equals}{preset_in(preset, folder, where) if equals else preset}" for name, equals, preset in named
    )


def frames_in(value: object, where: str) -> tuple[int, int]:
    if (
        not isinstance(value, list)
        or len(value) != 2
        or not all(isinstance(frame, int) and not isinstance(frame, bool) for frame in value)
        or not all(abs(frame) <= FRAME_LIMIT for frame in value)
        or value[0] >= value[1]
    ):
        raise InputError(f"{where}: 'frames' is {value!r}; it must be the first and the last frame, such as [1, 250].")
    return value[0], value[1]


def flat(table: object, where: str, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Nested tables as paths and values: {"material": {"layer_depth": 0.4}} is material.layer_depth = 0.4."""
    if not isinstance(table, dict):
        raise InputError(f'{where} must be a table such as {{ "material.layer_depth" = 0.4 }}.')
    for key, value in table.items():
        path = text_in(f"{prefix}{key}", where).strip()
        if isinstance(value, dict):
            if path.count(".") >= DEEPEST:
                raise InputError(f"{where}: '{path}' is a table within more than {DEEPEST} others.")
            yield from flat(value, where, f"{path}.")
        elif isinstance(value, bool):
            yield path, str(value).lower()
        elif isinstance(value, str):
            yield path, text_in(value, f"{where}: '{path}'").strip()
        elif is_number(value):
            yield path, repr(value)
        else:
            raise InputError(f"{where}: '{path}' is {value!r}; it must be a number, true or false, or a text.")


def is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
