"""The manifest of a batch, in TOML or JSON: shots, their settings and the files of the results.

[defaults]                        # for every shot that does not say otherwise
preset = "snow"                   # a preset's name, or a .json file
save = "baked/{name}.blend"
report = "baked/{name}.json"
set = { "material.layer_depth" = 0.4 }

[[shots]]
file = "shots/010.blend"          # paths are relative to the manifest

[[shots]]
files = "shots/0[2-9]*.blend"     # a pattern: one shot for each file
preset = "mud"
frames = [1001, 1120]
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.files.files import identity, read_regular
from .manifest_values import flat, frames_in, grounds_in, is_number, name_in, path_in, preset_in, text_in

LARGEST = 2**24
"""Size of a manifest that is read [bytes]: a hundred thousand shots."""


MOST_LOOKED_AT = 100_000
"""Most files and folders that the pattern of one shot may go through: a disk has millions, and a loop no end."""

_FROM_DEFAULTS = (
    "scene", "preset", "grounds", "frames", "cell_size", "set", "edits", "response", "save", "in_place", "report"
)  # fmt: skip
RESPONSES = ("layer", "keys")
"""What a bake may write the response as."""
_OF_A_SHOT = ("name", "file", "files", *_FROM_DEFAULTS)


@dataclass(frozen=True)
class BatchShot:
    """One bake of a batch.

    Attributes
    ----------
    name : str
        Unique in its manifest, whatever the case of its letters.
    file : Path
        The .blend file, absolute.
    scene : str
        The scene in it to bake, or "" for the one that it opens with.
    preset : str
        Name of a preset, absolute path of a preset file, or "" for the shot's own.
    frames : (int, int) or None
        First and last frame; None for the shot's own.
    cell_size : float or None
        Size of the ground's cells [m]; None for the shot's own.
    settings : tuple of (str, str)
        Paths below `scene.softground` and their values, in order.
    edits : Path or None
        Changes of single steps, absolute; None for the shot's own.
    grounds : tuple of str
        Meshes to bake on, `NAME` or `NAME=PRESET`; none for the shot's own.
    response : str
        One of `RESPONSES`, or "" for the shot's own.
    save : Path or None
        File of the baked shot, absolute; None for none or in place.
    in_place : bool
        True if the baked shot replaces `file`.
    report : Path or None
        File of the report, absolute.
    """

    name: str
    file: Path
    scene: str = ""
    preset: str = ""
    frames: tuple[int, int] | None = None
    cell_size: float | None = None
    settings: tuple[tuple[str, str], ...] = ()
    edits: Path | None = None
    grounds: tuple[str, ...] = ()
    response: str = ""
    save: Path | None = None
    in_place: bool = False
    report: Path | None = None

    @property
    def outputs(self) -> tuple[Path, ...]:
        """The files that the bake writes."""
        shot = self.file if self.in_place else self.save
        return tuple(path for path in (shot, self.report) if path)

    @property
    def options(self) -> list[str]:
        """The bake as options of `softground bake`."""
        given = (
            *(("scene", self.scene), ("preset", self.preset), *(("ground", ground) for ground in self.grounds)),
            *(("frames", "{}-{}".format(*self.frames) if self.frames else ""), ("cell-size", self.cell_size)),
            *(("set", f"{path}={value}") for path, value in self.settings),
            *(("edits", self.edits), ("response", self.response), ("save", self.save)),
        )
        options = [f"--{name}={value}" for name, value in given if value not in ("", None)]
        in_place = ["--in-place"] if self.in_place else []
        return [*options, *in_place, *([f"--report={self.report}"] if self.report else [])]


def load(path: Path) -> tuple[BatchShot, ...]:
    """The shots of a manifest file, each of which exists.

    Raises
    ------
    InputError
        If the file cannot be read or contains nothing that can be baked; names every missing shot.
    """
    origin = f"Manifest '{path}'"
    try:
        text = read_regular(path, LARGEST).decode()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{origin} cannot be read: {error}") from None
    folder = Path(os.path.realpath(path)).parent
    shots = parse(text, folder, origin, is_json=path.suffix.lower() == ".json")
    check_places(shots, origin, protected={path: "the manifest"})
    missing = [str(shot.file) for shot in shots if not is_file(shot.file)]
    if missing:
        listed = ", ".join(f"'{name}'" for name in missing[:10]) + (" and more" if len(missing) > 10 else "")
        raise InputError(f"Manifest '{path}': {len(missing)} of {len(shots)} shots are not there: {listed}.")
    return shots


def parse(text: str, folder: Path, origin: str, *, is_json: bool = False) -> tuple[BatchShot, ...]:
    """The shots of a manifest's text.

    Parameters
    ----------
    text : str
        TOML, or JSON if `is_json`.
    folder : Path
        Base of relative paths, absolute.
    origin : str
        Name of the manifest in error messages.

    Raises
    ------
    InputError
        Naming `origin`, the shot, and its problem.
    """
    try:
        return _parsed(json.loads(text) if is_json else tomllib.loads(text), folder, origin)
    except (ValueError, OverflowError, RecursionError) as error:  # also of values that are too long or deep to print
        raise InputError(f"{origin} is not readable as {'JSON' if is_json else 'TOML'}: {error}.") from None


def _parsed(content: object, folder: Path, origin: str) -> tuple[BatchShot, ...]:
    if not isinstance(content, dict):
        raise InputError(f"{origin} must be a table with a list 'shots'.")
    _check_keys(content, ("defaults", "shots"), origin)
    defaults, entries = content.get("defaults", {}), content.get("shots")
    if not isinstance(defaults, dict):
        raise InputError(f"{origin}: 'defaults' must be a table.")
    _check_keys(defaults, _FROM_DEFAULTS, f"{origin}, defaults")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{origin} has no shots: give at least one [[shots]] with a 'file'.")
    shots: list[BatchShot] = []
    for number, entry in enumerate(entries, start=1):
        where = f"{origin}, shot {number}"
        if not isinstance(entry, dict):
            raise InputError(f"{where}: must be a table with a 'file'.")
        _check_keys(entry, _OF_A_SHOT, where)
        shots += _shots(entry, defaults, folder, where)
    _check_names(shots, origin)
    check_places(shots, origin)
    return tuple(shots)


def chosen(shots: tuple[BatchShot, ...], wanted: list[str]) -> tuple[BatchShot, ...]:
    """Wanted shots, by name or by number from 1, in the manifest's order; all if none is wanted.

    Raises
    ------
    InputError
        If one of them is none of the manifest's.
    """
    if not wanted:
        return shots
    numbers = {name: number for number, shot in enumerate(shots) for name in (str(number + 1), shot.name)}
    unknown = [name for name in wanted if name not in numbers]
    if unknown:
        known = ", ".join(shot.name for shot in shots[:20]) + (" ..." if len(shots) > 20 else "")
        raise InputError(f"There is no shot '{unknown[0]}'. There are {len(shots)}: {known}.")
    return tuple(shots[number] for number in sorted({numbers[name] for name in wanted}))


def is_file(path: Path) -> bool:
    """True if the file exists; False also for names that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _shots(entry: Mapping[str, Any], defaults: Mapping[str, Any], folder: Path, where: str) -> Iterator[BatchShot]:
    if ("file" in entry) == ("files" in entry):
        raise InputError(
            f"{where}: give either 'file', one .blend file, or 'files', a pattern such as \"shots/*.blend\"."
        )
    if "file" in entry:
        yield _shot(entry, defaults, folder / text_in(entry["file"], f"{where}: 'file'"), folder, where)
        return
    if "name" in entry:
        raise InputError(f"{where}: a pattern's shots are named after their files; leave 'name' out.")
    pattern = text_in(entry["files"], f"{where}: 'files'")
    matches = sorted(set(_fitting(folder, pattern, where)))
    if not matches:
        raise InputError(f"{where}: no file fits the pattern {pattern!r} in '{folder}'.")
    for path in matches:
        yield _shot(entry, defaults, path, folder, where)


def _fitting(folder: Path, pattern: str, where: str) -> Iterator[Path]:
    """The files that fit a pattern; InputError where it makes us look through `MOST_LOOKED_AT` of them."""
    remaining = MOST_LOOKED_AT

    def entries(inside: Path) -> Iterator[os.DirEntry[str]]:
        nonlocal remaining
        try:
            with os.scandir(inside) as listing:
                for number, entry in enumerate(listing):
                    remaining -= 1 + (number == 0)
                    if remaining < 0:
                        raise InputError(
                            f"{where}: {pattern!r} goes through more than {MOST_LOOKED_AT:,} files: name the folder "
                            "that the shots are in."
                        )
                    yield entry
        except (OSError, ValueError):  # no folder, or one that we may not read, holds no shots
            return

    def below(inside: Path, parts: tuple[str, ...]) -> Iterator[Path]:
        if not parts:
            yield inside
        elif parts[0] == "**":
            yield from below(inside, parts[1:])
            for entry in entries(inside):
                if entry.is_dir(follow_symlinks=False):
                    yield from below(Path(entry.path), parts)
        elif re.search(r"[*?\[]", parts[0]):
            for entry in entries(inside):
                if fnmatch(entry.name, parts[0]):
                    yield from below(Path(entry.path), parts[1:])
        elif os.path.lexists(inside / parts[0]):
            yield from below(inside / parts[0], parts[1:])

    path = Path(pattern)
    parts = path.relative_to(path.anchor).parts
    once = tuple(part for number, part in enumerate(parts) if part != "**" or parts[number - 1 : number] != ("**",))
    return below(folder / path.anchor, once)


def _shot(entry: Mapping[str, Any], defaults: Mapping[str, Any], file: Path, folder: Path, where: str) -> BatchShot:
    name = name_in(entry.get("name", file.stem), where)
    file = path_in(str(file), folder, f"{where}: 'file'")
    where = f"{where} ({name})"
    given = {key: entry[key] for key in _FROM_DEFAULTS if key in entry}
    # a destination of the shot overrides both kinds of default
    destination = () if "save" not in given and "in_place" not in given else ("save", "in_place")
    values = {key: value for key, value in defaults.items() if key not in destination} | given
    overrides = dict(flat(defaults.get("set", {}), f"{where}: 'set'"))
    overrides |= dict(flat(entry.get("set", {}), f"{where}: 'set'"))
    in_place = values.get("in_place", False)
    if not isinstance(in_place, bool):
        raise InputError(f"{where}: 'in_place' must be true or false.")
    edits, save, report = (
        path_in(text_in(values[key], f"{where}: '{key}'").replace("{name}", name), folder, f"{where}: '{key}'")
        if key in values
        else None
        for key in ("edits", "save", "report")
    )
    if in_place and save:
        raise InputError(f"{where}: give either 'save' or 'in_place', not both.")
    if not (in_place or save or report):
        raise InputError(f"{where}: nothing would be kept: give 'save', 'in_place' or 'report'.")
    if save == file:
        raise InputError(f"{where}: 'save' is the shot itself: say in_place = true to replace it.")
    if (response := values.get("response", "")) not in ("", *RESPONSES):
        raise InputError(f"{where}: 'response' is {response!r}; it must be {' or '.join(map(repr, RESPONSES))}.")
    cell_size = values.get("cell_size")
    if cell_size is not None and not is_number(cell_size):
        raise InputError(f"{where}: 'cell_size' is {cell_size!r}; it must be a number of metres.")
    return BatchShot(
        name=name,
        file=file,
        scene=text_in(values["scene"], f"{where}: 'scene'") if "scene" in values else "",
        preset=preset_in(values.get("preset", ""), folder, where),
        frames=frames_in(values["frames"], where) if "frames" in values else None,
        cell_size=None if cell_size is None else float(cell_size),
        settings=tuple(overrides.items()),
        edits=edits,
        grounds=grounds_in(values.get("grounds", []), folder, where),
        response=response,
        save=save,
        in_place=in_place,
        report=report,
    )


def _check_keys(table: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    unknown = [key for key in table if key not in known]
    if unknown:
        raise InputError(f"{where}: unknown key {unknown[0]!r}. Known are: {', '.join(known)}.")


def check_places(
    shots: Iterable[BatchShot], origin: str, *, protected: Mapping[Path, str] | None = None, report: Path | None = None
) -> None:
    """Refuse results that would overwrite files of the batch, or each other.

    Parameters
    ----------
    shots : iterable of BatchShot
        All of the manifest.
    origin : str
        Name of the manifest in error messages.
    protected : mapping of Path to str
        Other files that no result may replace, and their descriptions.
    report : Path, optional
        File of the outcome of the batch.

    Raises
    ------
    InputError
        Naming both, and the file.
    """
    shots = tuple(shots)
    read = {identity(path): what for path, what in (protected or {}).items()}
    for shot in shots:
        for preset in (shot.preset, *(ground.rpartition("=")[2] for ground in shot.grounds)):
            if preset.lower().endswith(".json"):
                read[identity(Path(preset))] = f"a preset of '{shot.name}'"
        if shot.edits:
            read[identity(shot.edits)] = f"the edits of '{shot.name}'"
    sources: dict[str, list[str]] = {}
    for shot in shots:
        sources.setdefault(identity(shot.file), []).append(shot.name)
    results = [(shot.name, path, shot.in_place and path == shot.file) for shot in shots for path in shot.outputs]
    if report:
        results.append(("--report", report, False))
    written: dict[str, str] = {}
    for name, path, is_source in results:
        key = identity(path)
        if key in written:
            raise InputError(
                f"{origin}: '{written[key]}' and '{name}' both write '{path}': give each a name of its own, such as by "
                "{name} in the path."
            )
        if key in sources and sources[key] != ([name] if is_source else []):
            raise InputError(f"{origin}: '{name}' would write over the shot '{path}'.")
        if key in read:
            raise InputError(f"{origin}: '{name}' would write over {read[key]}, '{path}': choose another name.")
        written[key] = name


def _check_names(shots: Iterable[BatchShot], origin: str) -> None:
    names: set[str] = set()
    for shot in shots:
        if shot.name.casefold() in names:
            raise InputError(f"{origin}: two shots are named '{shot.name}': give each a 'name' of its own.")
        names.add(shot.name.casefold())
