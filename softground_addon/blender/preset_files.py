"""Files of presets: those of the add-on and the user's own, each read again only where it was written since."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.errors import InputError
from ..core.ground import presets
from .state import state

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
    readable, broken = [], []
    for path in sorted(folder.glob("*.json")):
        try:
            readable.append((path, loaded(path)))
        except InputError as error:
            broken.append(str(error))
    return sorted(readable, key=lambda entry: entry[1].name.casefold()), broken


def named(name: str) -> presets.Preset:
    """The preset of that file name; errors as of `presets.find`."""
    for folder in (presets.FOLDER, user_folder()):
        path = folder / f"{name}.json"
        if path.parent == folder and path.is_file():
            return loaded(path)
    return presets.find(name, (presets.FOLDER, user_folder()))
