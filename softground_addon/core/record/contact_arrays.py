"""Contacts of the footprints of a record, as texts and flat arrays and back, checked like the footprints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..motion.props import Prop
from ..motion.sole_motion import Sole, SolePatch
from ..numerics.arrays import Array
from .contact_steps import LENGTH, ContactSteps, PressingSole, coded, decoded, patch_of, width_of

_OF_STEPS = 9
"""Numbers of each footprint: sole, first step, approach, step's duration, origin (3), peak, values coded."""
KINDS: dict[str, type] = {
    "contact.numbers": np.float64,
    "contact.coded": np.int32,
    "soles.numbers": np.float64,
    "soles.coded": np.int32,
}
"""Names of the arrays and the kind of their values."""
MOST_PATCHES = 64
"""Most patches of a sole."""
LONGEST_STEP = 10.0
"""Longest step of a simulation [s]."""

Columns = dict[str, list[NDArray[Any]]]


def to_columns(contacts: Sequence[ContactSteps | None]) -> tuple[list[dict[str, str]], Columns]:
    """Contact of each footprint: the names of the soles, and the parts of each of the arrays of `KINDS`."""
    soles: dict[int, tuple[int, PressingSole]] = {}
    numbers: list[Array] = []
    for contact in contacts:
        values = np.full(_OF_STEPS, -1.0)
        if contact is not None:
            number, _ = soles.setdefault(id(contact.pressing), (len(soles), contact.pressing))
            values[:4] = number, contact.first, contact.approach, contact.time_step
            values[4:7], values[7], values[8] = contact.origin, contact.peak, contact.count
        numbers.append(values)
    pressing = [sole for _, sole in soles.values()]
    flat, maps = zip(*map(sole_to_arrays, pressing), strict=True) if pressing else ((), ())
    columns: Columns = {
        "contact.numbers": list(numbers),
        "contact.coded": [contact.coded for contact in contacts if contact is not None],
        "soles.numbers": list(flat),
        "soles.coded": list(maps),
    }
    return [{"name": each.sole.name, "side": each.sole.side} for each in pressing], columns


def from_columns(
    names: Sequence[Mapping[str, str]], arrays: Mapping[str, Any], count: int
) -> list[ContactSteps | None]:
    """Contact of each of `count` footprints, from the result of `to_columns`, each array put together.

    Raises
    ------
    ValueError
        Where the parts do not fit each other.
    """
    values = {key: _checked(arrays[key], key, kind) for key, kind in KINDS.items()}
    numbers, maps = _Reader(values["soles.numbers"]), _Reader(values["soles.coded"])
    soles = [_sole(name, numbers, maps) for name in names]
    if len(values["contact.numbers"]) != count * _OF_STEPS:
        raise ValueError("contacts and footprints do not match")
    steps = _Reader(values["contact.coded"])
    contacts = [_contact(row, soles, steps) for row in values["contact.numbers"].reshape(count, _OF_STEPS)]
    for reader in (numbers, maps, steps):
        reader.check_all_read()
    return contacts


def sole_from_arrays(name: str, numbers: Array, maps: NDArray[np.int32]) -> PressingSole:
    """One sole from the arrays of `sole_to_arrays`; ValueError where the parts do not fit each other."""
    readers = _Reader(numbers), _Reader(maps)
    pressing = _sole({"name": name, "side": ""}, *readers)
    for reader in readers:
        reader.check_all_read()
    return pressing


def _contact(row: Array, soles: Sequence[PressingSole], steps: _Reader) -> ContactSteps | None:
    if row[0] < 0:
        return None
    number, first, approach, rows = (_whole(row[k], 0, 2**31) for k in (0, 1, 2, 8))
    if number >= len(soles) or not 0 <= approach < rows or not 0 < row[3] <= LONGEST_STEP:
        raise ValueError("a contact has no sole or no steps")
    if not 0 < row[7] <= 1e15 or np.abs(row[4:7]).max() > 1e9:
        raise ValueError("a contact's numbers are no such numbers")
    pressing = soles[number]
    coded_steps = steps.take(rows * width_of(pressing))
    return ContactSteps(pressing, first, approach, float(row[3]), row[4:7].copy(), float(row[7]), coded_steps)


def sole_to_arrays(pressing: PressingSole) -> tuple[Array, NDArray[np.int32]]:
    """The numbers of a sole [m], and its coded lengths in units of `LENGTH`."""
    sole, prop = pressing.sole, pressing.sole.prop
    numbers: list[Any] = [len(pressing.flat), pressing.flat, len(sole.landmarks), sole.landmarks, sole.landmark_patch]
    numbers += [len(sole.outline), sole.outline, len(sole.patches)]
    maps: list[NDArray[Any]] = []
    for patch in sole.patches:
        numbers += [patch.heights.shape, patch.origin, patch.spacing]
        maps += [coded(patch.heights / LENGTH), coded(patch.signed_distance / LENGTH)]
    numbers += [0, 0, 0.0] if prop is None else [len(prop.vertices), len(prop.triangles), prop.give]
    if prop is not None:
        maps += [coded(prop.vertices / LENGTH), np.asarray(prop.triangles, np.int32)]
    return np.concatenate([np.ravel(value) for value in numbers]).astype(np.float64), np.concatenate(
        [np.ravel(part) for part in (*maps, np.empty(0, np.int32))]
    ).astype(np.int32)


def _sole(name: Mapping[str, str], numbers: _Reader, maps: _Reader) -> PressingSole:
    parts = _whole(numbers.single(), 1, MOST_PATCHES)
    flat = numbers.take(16 * parts).reshape(parts, 4, 4)
    landmarks = _whole(numbers.single(), 0, 10_000)
    marks = numbers.take(3 * landmarks).reshape(-1, 3)
    of_patch = np.array([_whole(value, 0, parts - 1) for value in numbers.take(landmarks)], np.intp)
    outline = numbers.take(2 * _whole(numbers.single(), 0, 100_000)).reshape(-1, 2)
    patches = tuple(_patches(numbers, maps))
    vertices, triangles, give = _whole(numbers.single(), 0, 2**24), _whole(numbers.single(), 0, 2**24), numbers.single()
    prop = None
    if vertices:
        places = decoded(maps.take(3 * vertices).reshape(-1, 3)) * LENGTH
        corners = maps.take(3 * triangles).reshape(-1, 3)
        if not len(corners) or not 0 <= corners.min() <= corners.max() < vertices:
            raise ValueError("a contact shape's faces do not fit its vertices")
        prop = Prop(places, corners, float(give))
    if len(outline) < 3 or not len(marks) or (prop is None and len(patches) != parts) or (prop and parts != 1):
        raise ValueError("a sole has no outline, no landmarks or no patches")
    return PressingSole(Sole(str(name["name"]), str(name["side"]), patches, marks, of_patch, outline, prop), flat)


def _patches(numbers: _Reader, maps: _Reader) -> Iterator[SolePatch]:
    for _ in range(_whole(numbers.single(), 0, MOST_PATCHES)):
        rows, columns = (_whole(value, 2, 2**16) for value in numbers.take(2))
        origin, spacing = numbers.take(2), float(numbers.single())
        if not 1e-9 < spacing < 1e6:
            raise ValueError("a sole's map has no spacing")
        yield patch_of(maps.take(2 * rows * columns).reshape(2, rows, columns), origin, spacing)


class _Reader:
    """Reads an array from its beginning; ValueError where it is too short, or not read to its end."""

    def __init__(self, values: NDArray[Any]) -> None:
        self._values, self._at = values, 0

    def take(self, count: int) -> NDArray[Any]:
        """The next values."""
        taken = self._values[self._at : self._at + count]
        if len(taken) != count:
            raise ValueError("a sole or contact is cut short")
        self._at += count
        return taken.copy()

    def single(self) -> float:
        """The next value."""
        return float(self.take(1)[0])

    def check_all_read(self) -> None:
        """Raise ValueError where there is more."""
        if self._at != len(self._values):
            raise ValueError("there is more than its soles and contacts say")


def _checked(values: Any, key: str, kind: type) -> NDArray[Any]:
    flat: NDArray[Any] = np.ravel(values)
    if flat.dtype != kind or not np.isfinite(flat).all() or np.abs(flat.astype(np.float64)).max(initial=0.0) > 1e15:
        raise ValueError(f"{key} holds what is no number of its kind")
    return flat


def _whole(value: float, least: int, most: int) -> int:
    if not least <= value <= most or value != int(value):
        raise ValueError(f"{value!r} counts nothing")
    return int(value)
