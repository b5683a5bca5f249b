"""The record of a bake as bytes: a zip of plain arrays and one JSON text, with a checksum each. No pickles."""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, damaged_record
from ..numerics.slices import Slices, sliced
from . import archive as members
from . import edits as step_edits
from . import throws as step_throws
from .footprint_arrays import ARRAYS, from_arrays, to_parts
from .footprints import Footprint
from .moved_carve import moved_carve, placement

FORMAT = 1
"""Version of the bytes' layout. A new one needs a migration from the one before in `MIGRATIONS`."""

Layout = tuple[dict[str, Any], dict[str, NDArray[Any]]]
"""The JSON text and the arrays of a record."""

MIGRATIONS: dict[int, Callable[[dict[str, Any], dict[str, NDArray[Any]]], Layout]] = {}
"""Migrations to the next version, by the version that they start from."""

_TEXT = "record.json"
_DAMAGE = (
    *(
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        OSError,
        RuntimeError,
        OverflowError,
    ),  # of the archive: "encrypted" too
    *(KeyError, ValueError, TypeError),  # of the text; too deep a nesting is a RuntimeError
    *(SyntaxError, tokenize.TokenError, MemoryError),  # of an array's header: unreadable to numpy, or absurd sizes
)
"""Errors that reading a damaged record may raise."""

TAIL = 4096
"""Records that differ do so in their last bytes: the archive's directory is there, with a checksum of everything."""

LEVEL = 4
"""Level of zlib: two thirds of the time of the usual 6, for 3 % more bytes."""

MOST_OF_ZIP32 = 2**30
"""Size of an array from which its member may need wider sizes [bytes]."""


@dataclass(frozen=True)
class BakeRecord:
    """Record of a bake, from which the ground at any frame is made again without simulating.

    Attributes
    ----------
    footprints : sequence of Footprint
        As they were baked.
    about : mapping
        Facts about them: numbers and texts, for JSON.
    edits : mapping of step id to StepEdit
        Changes by the artist.
    pressed_again : mapping of int to Footprint or None
        Footprints in place of edited ones, and copies, by their numbers (see `edits`); None of one that vanished.
    throws : sequence of Throw
        Throws of the baked steps.
    thrown : mapping of int to mapping of str to float
        Volumes that the edited steps have thrown, by their numbers and by phase [m³]: they are missing from the rims of
        `edited`, `steps` and `laid_carves`, not from those of `footprints`, `pressed_again` and `carves`.
    carves : mapping of int to Footprint
        What bodies carved beside their prints in deep ground, by the numbers of the steps that it goes with.
    carved_with : mapping of step id to StepEdit
        Where the artist had put steps, and how large, when they were carved.
    on_floors : sequence of Footprint
        Steps on hard floors, which change no heights; see `composers.floor_prints`.
    """

    footprints: Sequence[Footprint]
    about: Mapping[str, Any]
    edits: Mapping[str, step_edits.StepEdit] = field(default_factory=dict)
    pressed_again: Mapping[int, Footprint | None] = field(default_factory=dict)
    throws: Sequence[step_throws.Throw] = ()
    thrown: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    carves: Mapping[int, Footprint] = field(default_factory=dict)
    carved_with: Mapping[str, step_edits.StepEdit] = field(default_factory=dict)
    on_floors: Sequence[Footprint] = ()
    _laid: dict[int, tuple[Any, Footprint]] = field(default_factory=dict, repr=False, compare=False)
    """Carves that were moved, each with what it follows from; shared by records that differ by edits."""

    @property
    def shaping(self) -> list[Footprint]:
        """All that the ground is made from: the edited footprints, and after them the carves of steps that are left."""
        return [*self.edited, *self.laid_carves.values()]

    @cached_property
    def laid_carves(self) -> dict[int, Footprint]:
        """The carves of steps that are left, by their numbers, where these are now; a copy takes that of its step."""
        before = step_edits.edits_by_number(self.footprints, self.carved_with)
        laid: dict[int, Footprint] = {}
        for step in self.steps:
            number = step.index % len(self.footprints)
            if step.footprint is None or (carve := self.carves.get(number)) is None:
                continue
            was, now = placement(before.get(number, step_edits.UNCHANGED)), placement(step.edit)
            known = self._laid.get(step.index)
            if known is None or known[0][0] is not carve or known[0][1:] != (was, now):
                known = (carve, was, now), moved_carve(carve, step.baked.position, was, now)
                self._laid[step.index] = known
            laid[step.index] = step_throws.booked(known[1], step.thrown.get(step_throws.WADE, 0.0))
        return laid

    @property
    def edited(self) -> list[Footprint]:
        """The footprints after the artist's edits, in their order."""
        prints = [step.footprint for step in self.steps if step.footprint is not None]
        return sorted(prints, key=lambda footprint: footprint.start_frame) if self.edits else prints

    def with_about(self, about: Mapping[str, Any]) -> BakeRecord:
        """The same record with other facts about its steps, of which nothing is computed again."""
        twin = copy(self)
        object.__setattr__(twin, "about", about)
        return twin

    @cached_property
    def steps(self) -> list[EditableStep]:
        """All steps, and after them the copies of some."""
        changes, count = step_edits.edits_by_number(self.footprints, self.edits), len(self.footprints)
        steps = []
        for number in (*range(count), *(n for n in changes if n >= count)):
            edit, copy = changes.get(number, step_edits.UNCHANGED), number // count
            baked = self.footprints[number % count]
            edited = None if edit.mute else self.pressed_again.get(number, None if copy else baked)
            lacking = self.thrown.get(number, {}) if edited else {}
            edited = step_throws.booked(edited, step_throws.of_print(lacking)) if edited else edited
            steps.append(EditableStep(step_edits.step_id(baked, copy), number, baked, edited, edit, copy > 0, lacking))
        return steps


@dataclass(frozen=True)
class EditableStep:
    """A step of a bake, or a copy of one.

    Attributes
    ----------
    name : str
        Its id.
    index : int
        See `edits`.
    baked : Footprint
        As it was baked; of a copy, its original.
    footprint : Footprint or None
        After the edits, without the thrown volume; None if it leaves no print.
    thrown : mapping of str to float
        Thrown volumes by phase [m³].
    """

    name: str
    index: int
    baked: Footprint
    footprint: Footprint | None
    edit: step_edits.StepEdit
    is_copy: bool
    thrown: Mapping[str, float]


@sliced
def dump(record: BakeRecord) -> Slices[bytes]:
    """The record as bytes: equal records give equal bytes."""
    again = sorted(record.pressed_again.items())
    prints = [footprint for _, footprint in again if footprint is not None]
    carves = sorted(record.carves.items())
    names, soles, arrays = to_parts([*record.footprints, *prints, *(carve for _, carve in carves), *record.on_floors])
    content = {
        "format": FORMAT,
        "footprints": names,
        "about": dict(record.about),
        "edits": step_edits.to_json(record.edits),
        "soles": soles,
        "pressed_again": [[number, footprint is not None] for number, footprint in again],
        "throws": [step_throws.to_json(throw) for throw in record.throws],
        "thrown": [[number, dict(volumes)] for number, volumes in sorted(record.thrown.items())],
        **({"carves": [number for number, _ in carves]} if carves else {}),
        **({"on_floors": len(record.on_floors)} if record.on_floors else {}),
        **({"carved_with": step_edits.to_json(record.carved_with)} if record.carved_with else {}),
    }
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        with archive.open(_TEXT, "w") as member:  # by name, a member has a fixed date: equal bakes give equal bytes
            member.write(json.dumps(content, ensure_ascii=False).encode())
        for key, array in arrays.items():
            kind: np.dtype[Any] = np.dtype(array.kind)
            with archive.open(f"{key}.npy", "w", force_zip64=array.size * kind.itemsize > MOST_OF_ZIP32) as member:
                header = {"descr": kind.str, "fortran_order": False, "shape": (array.size,)}
                np.lib.format.write_array_header_1_0(member, header)
                for part in array.parts:
                    member.write(part.astype(kind, copy=False).tobytes())
                    yield
    return buffer.getvalue()


def load(content: bytes) -> BakeRecord:
    """The record from the bytes of `dump` of this or an earlier version.

    Raises
    ------
    InputError
        If the bytes are cut short, damaged, or of a later version.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            text = _text(archive, len(content))
            version = text["format"]
            arrays = {name: members.array(members.read(archive, f"{name}.npy")) for name in ARRAYS}
        for older in range(version, FORMAT):
            text, arrays = MIGRATIONS[older](text, arrays)
        names, about, edits = text["footprints"], dict(text["about"]), text["edits"]
        soles, again = text["soles"], [(number, has_print) for number, has_print in text["pressed_again"]]
        carved = list(text.get("carves", []))
        of_soft = len(names) - text.get("on_floors", 0)
        if type(of_soft) is not int or not 0 <= of_soft <= len(names):
            raise ValueError("more steps on floors than it has")
        baked = _count_baked(of_soft - len(carved), again)
        _check_numbers(carved, baked)
        how_thrown = step_throws.from_json(text["throws"], baked, members.most_of(len(content)))
        thrown = _thrown(text["thrown"], baked)
    except _DAMAGE as error:
        raise damaged_record(error) from None
    changes = step_edits.from_json(edits, _EDITS)
    carved_with = step_edits.from_json(text["carved_with"], _EDITS) if "carved_with" in text else {}
    footprints = from_arrays(names, soles, arrays)
    prints = iter(footprints[baked:of_soft])
    pressed_again = {number: next(prints) if has_print else None for number, has_print in again}
    carves = dict(zip(carved, prints, strict=True))
    made = (footprints[:baked], about, changes, pressed_again, how_thrown, thrown, carves, carved_with)
    return BakeRecord(*made, footprints[of_soft:])


def load_edits(content: bytes) -> tuple[dict[str, Any], dict[str, step_edits.StepEdit]]:
    """Facts about the footprints in such bytes, and the artist's edits of them; errors as of `load`.

    The footprints themselves are not unpacked.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            text = _text(archive, len(content))
        about, edits = dict(text["about"]), text["edits"]
        if text["format"] != FORMAT:
            record = load(content)
            return dict(record.about), dict(record.edits)
    except _DAMAGE as error:
        raise damaged_record(error) from None
    return about, step_edits.from_json(edits, _EDITS)


_EDITS = "The stored record's edits of steps"


def _text(archive: zipfile.ZipFile, size: int) -> dict[str, Any]:
    """The JSON text of a record of that size [bytes]; InputError if it is of a later version."""
    members.check_directory(archive, size)
    stored = members.read(archive, _TEXT, members.LARGEST_TEXT)
    text: dict[str, Any] = json.loads(stored)
    if b"\\u" in stored:  # half a character, which nothing can be written with
        json.dumps(text, ensure_ascii=False).encode()
    version = text["format"]
    if version != FORMAT and version not in MIGRATIONS:
        raise InputError(
            f"The stored record of the footprints is of version {version}; this SoftGround reads versions up "
            f"to {FORMAT}: bake again, or update SoftGround.",
            "newer_record",
        )
    if set(archive.namelist()) - {_TEXT, *(f"{name}.npy" for name in ARRAYS)}:
        raise ValueError("it has parts that no record has")
    return text


def _thrown(rows: list[Any], baked: int) -> dict[int, dict[str, float]]:
    """Thrown volumes by step and phase; ValueError where that cannot be."""
    thrown = {
        number: {str(phase): float(volume) for phase, volume in dict(volumes).items()} for number, volumes in rows
    }
    _check_numbers(thrown, baked)
    if not all(0 <= volume < np.inf for volumes in thrown.values() for volume in volumes.values()):
        raise ValueError("debris of no volume")
    return thrown


def _count_baked(count: int, again: list[tuple[Any, Any]]) -> int:
    """Number of `count` footprints that were baked, the others being pressed again; ValueError where that cannot be."""
    baked = count - sum(has_print is True for _, has_print in again)
    numbers = [number for number, _ in again]
    _check_numbers(numbers, baked)
    if sorted(set(numbers)) != numbers:
        raise ValueError("steps were pressed again twice")
    if any(type(has_print) is not bool for _, has_print in again):
        raise ValueError("it does not say which steps are left")
    return baked


def _check_numbers(numbers: Iterable[Any], baked: int) -> None:
    """Raise ValueError where some are no numbers of its steps, of which so many were baked, or of their copies."""
    if any(type(number) is not int or not 0 <= number < baked * (1 + step_edits.MOST_COPIES) for number in numbers):
        raise ValueError("it names steps that it does not have")
