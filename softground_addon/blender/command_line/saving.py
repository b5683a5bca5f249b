"""Places that a command writes to, checked before any work, and copies of the file saved there."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import bpy

from ...core.errors import InputError
from ...core.files import files


def files_read(options: argparse.Namespace) -> list[Path]:
    """The opened file, the files that it links, and the preset files."""
    linked = [(item.filepath, item.library) for item in (*bpy.data.libraries, *bpy.data.cache_files)]
    paths = [bpy.path.abspath(path, library=library) for path, library in linked]
    presets = [options.preset or "", *(text.rpartition("=")[2] for text in options.grounds)]
    paths += [preset for preset in presets if preset.lower().endswith(".json")]
    if options.edits:
        paths.append(str(options.edits))
    return [Path(os.path.realpath(path)) for path in (bpy.data.filepath, *paths) if path]


def save_target(options: argparse.Namespace) -> Path | None:
    """File that the shot is saved to."""
    if options.in_place:
        if not bpy.data.filepath:
            raise InputError("--in-place needs a shot that was opened from a file: give --save FILE.blend instead.")
        return Path(os.path.realpath(bpy.data.filepath))
    return options.save.resolve() if options.save else None


def check_places(options: argparse.Namespace, target: Path | None) -> None:
    """Raise InputError unless all results can be written, each to a place of its own, and over no file that is read."""
    places = [Path(os.path.realpath(path)) for path in (target, options.report, options.receipt) if path]
    named, read = map(files.identity, places), set(map(files.identity, files_read(options)))
    opened = files.identity(Path(bpy.data.filepath)) if bpy.data.filepath else None
    taken: set[str] = set()
    for path, name in zip(places, named, strict=True):
        files.check_place(path)
        if name in taken:
            raise InputError(f"Two results would be written to '{path}': give each a name of its own.")
        if name in read and not (path == target and name == opened):
            raise InputError(f"'{path}' is read by this bake and would be overwritten: write to another file.")
        taken.add(name)


def save_copy(path: Path) -> None:
    """Save the open file under `path`, compressed if the opened file was.

    Raises
    ------
    InputError
        If it could not be written.
    OSError
        If the disk is full.
    """
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=is_compressed(bpy.data.filepath))
    except RuntimeError as error:
        files.check_not_full(path)  # Blender may say "No such file" then
        raise InputError(f"The baked shot could not be saved: {str(error).strip()}") from None


def is_compressed(path: str) -> bool:
    if not path or not Path(path).is_file():
        return False
    with Path(path).open("rb") as blend:
        return blend.read(7) != b"BLENDER"
