"""The record of footprints as a few flat arrays and back, with a check that the arrays fit together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import damaged_record
from ..ground.sparse_grid import Window
from ..ground.surfaces import SURFACES
from ..skin.skin_motion import MOST_SAMPLES
from . import contact_arrays
from .contact_steps import ContactSteps
from .footprints import Changes, Footprint

_TEXTS = ("character", "sole")
_NUMBERS = (
    "start_frame",
    "end_frame",
    "heading",
    "area_m2",
    "peak_force_n",
    "compressed_m3",
    "rim_m3",
    "unplaced_rim_m3",
    "cell_size",
    "frame_step",
)
_VECTORS = {"position": (3, np.float64), "window": (4, np.int32)}
_SERIES = {
    "load_frames": np.float64,
    "load_n": np.float64,
    "contact_cells": np.int32,
    "contact_start": np.float64,
    "contact_end": np.float64,
    **{
        f"{quantity}.{name}": np.float64 if name == "frames" else np.int32
        for quantity in ("compression", "rim")
        for name in ("frames", "first", "cells", "amounts")
    },
}
ARRAYS = ("numbers", *_VECTORS, *_SERIES, *(f"{key}.count" for key in _SERIES), *contact_arrays.KINDS)
"""Names of the arrays that a record is stored as."""

_RANGES = {
    "cell_size": (1e-5, 10.0),  # [m], wider than the setting's range
    "frame_step": (1e-3, 1e3),
    "start_frame": (-1e7, 1e7),  # beyond the 1,048,574 frames that Blender counts
    "end_frame": (-1e7, 1e7),
    "area_m2": (0.0, 1e9),
    "peak_force_n": (0.0, 1e15),
}
"""Range of a footprint's numbers: others, far from it, would only fill the memory."""


@dataclass(frozen=True)
class Parts:
    """An array of the record in parts, of which one at a time takes memory.

    Attributes
    ----------
    kind : type
        Of its values.
    size : int
        Number of its values.
    parts : iterable of (N,) arrays
        To be put together one after the other.
    """

    kind: type
    size: int
    parts: Iterable[NDArray[Any]]

    @classmethod
    def whole(cls, values: Sequence[object], kind: type) -> Parts:
        """Parts of values that exist already."""
        flat: NDArray[Any] = np.array(values, kind).ravel()
        return cls(kind, len(flat), [flat])


def to_parts(
    footprints: Sequence[Footprint],
) -> tuple[list[dict[str, str]], list[dict[str, str]], dict[str, Parts]]:
    """The record as texts and a few flat arrays of 64-bit floats and 32-bit integers, to be stored as native data.

    Returns
    -------
    names : list of dict
        Character and sole of each footprint.
    soles : list of dict
        Name and side of each sole that pressed them.
    arrays : dict of str to Parts
        `numbers`, `position` and `window` are of all footprints; so is each series, with the number of values of each
        footprint in `<series>.count`.
    """
    names = [
        {key: getattr(footprint, key) for key in _TEXTS} | ({"surface": footprint.surface} if footprint.surface else {})
        for footprint in footprints
    ]
    numbers = [[getattr(footprint, key) for key in _NUMBERS] for footprint in footprints]
    arrays = {"numbers": Parts.whole(numbers, np.float64)}
    for key, (_, kind) in _VECTORS.items():
        arrays[key] = Parts.whole([getattr(footprint, key) for footprint in footprints], kind)
    for key, kind in _SERIES.items():
        counts = [len(attrgetter(key)(footprint)) for footprint in footprints]
        arrays[key] = Parts(kind, sum(counts), map(attrgetter(key), footprints))
        arrays[f"{key}.count"] = Parts.whole(counts, np.int32)
    soles, columns = contact_arrays.to_columns([footprint.pressed_by for footprint in footprints])
    for key, parts in columns.items():
        arrays[key] = Parts(contact_arrays.KINDS[key], sum(map(len, parts)), parts)
    return names, soles, arrays


def from_arrays(
    names: Sequence[Mapping[str, str]], soles: Sequence[Mapping[str, str]], arrays: Mapping[str, Any]
) -> list[Footprint]:
    """The record from the result of `to_parts`, each array put together.

    Raises
    ------
    InputError
        If the record was cut short or edited so that its parts do not fit each other.
    """
    try:
        columns = _columns(len(names), arrays)
        contacts = contact_arrays.from_columns(soles, arrays, len(names))
        footprints = [
            _footprint(name, {k: v[i] for k, v in columns.items()}, contacts[i]) for i, name in enumerate(names)
        ]
        for footprint in footprints:
            _check(footprint)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise damaged_record(error) from None
    return footprints


def _columns(count: int, arrays: Mapping[str, Any]) -> dict[str, list[NDArray[Any]]]:
    """Values of each footprint by key."""
    columns = {"numbers": list(_sized(arrays, "numbers", count * len(_NUMBERS), np.float64).reshape(-1, len(_NUMBERS)))}
    for key, (size, kind) in _VECTORS.items():
        columns[key] = list(_sized(arrays, key, count * size, kind).reshape(-1, size))
    for key, kind in _SERIES.items():
        counts = _sized(arrays, f"{key}.count", count, np.int32)
        if (counts < 0).any():
            raise ValueError(f"negative count of {key}")
        columns[key] = np.split(_sized(arrays, key, int(counts.sum(dtype=np.int64)), kind), np.cumsum(counts)[:-1])
    return columns


def _sized(arrays: Mapping[str, Any], key: str, size: int, kind: type) -> NDArray[Any]:
    if key not in arrays:
        raise ValueError(f"it lacks {key}")
    values = np.ravel(arrays[key])
    if len(values) != size:
        raise ValueError(f"{key} has {len(values)} values where {size} are announced")
    if values.dtype != kind or not np.isfinite(values).all():
        raise ValueError(f"{key} holds what is no number of its kind")
    return values.astype(kind)


def _footprint(
    name: Mapping[str, str], values: Mapping[str, NDArray[Any]], pressed_by: ContactSteps | None
) -> Footprint:
    content: dict[str, Any] = {key: str(name[key]) for key in _TEXTS}
    content |= zip(_NUMBERS, values["numbers"].tolist(), strict=True)
    content |= {key: values[key] for key in _SERIES if "." not in key}
    for quantity in ("compression", "rim"):
        content[quantity] = Changes(**{field.name: values[f"{quantity}.{field.name}"] for field in fields(Changes)})
    content |= {"window": Window(*values["window"].tolist()), "position": values["position"]}
    if (surface := name.get("surface", "")) and surface not in SURFACES:
        raise ValueError(f"there is no surface {surface!r}")
    return Footprint(pressed_by=pressed_by, surface=surface, **content)


SPARSEST = 1000
SPARE_CELLS = 2**20
"""Most cells of a window for each change in it, and on top of that: windows beyond would only fill the memory."""
LONGEST_PAUSE = 10
"""Most recorded frames that a footprint's changes span, for each that has a change or a load, on top of a carve's."""


def _check(footprint: Footprint) -> None:
    """Raise ValueError where the parts of a footprint contradict each other."""
    _check_ranges(footprint)
    cells = footprint.window.cells
    if footprint.window.columns < 1 or footprint.window.rows < 1:
        raise ValueError("a footprint has no cells")
    recorded = sum(map(len, (footprint.contact_cells, footprint.compression.cells, footprint.rim.cells)))
    if cells > SPARSEST * recorded + SPARE_CELLS:
        raise ValueError("a footprint's window is far larger than what it changed")
    if len(footprint.load_n) != len(footprint.load_frames):
        raise ValueError("loads and frames do not match")
    if not len(footprint.contact_cells) == len(footprint.contact_start) == len(footprint.contact_end):
        raise ValueError("contacts and frames do not match")
    if (made_by := footprint.pressed_by) and made_by.approach + len(footprint.load_frames) != made_by.count:
        raise ValueError("a contact's steps and its loads do not match")
    if made_by and (np.diff(footprint.load_frames) <= 0).any():
        raise ValueError("a contact's frames are out of order")
    for changes in (footprint.compression, footprint.rim):
        if len(changes.first) != len(changes.frames) + 1 or len(changes.cells) != len(changes.amounts):
            raise ValueError("changes and frames do not match")
        if changes.first[0] != 0 or changes.first[-1] != len(changes.cells) or (np.diff(changes.first) < 0).any():
            raise ValueError("changes do not follow each other")
        if (np.diff(changes.frames) < 0).any():
            raise ValueError("frames are out of order")
        if len(changes.cells) and not 0 <= changes.cells.min() <= changes.cells.max() < cells:
            raise ValueError("a change lies outside its window")
    contacts = footprint.contact_cells
    if len(contacts) and not 0 <= contacts.min() <= contacts.max() < cells:
        raise ValueError("a contact lies outside its window")


def _check_ranges(footprint: Footprint) -> None:
    """Raise ValueError where a footprint's numbers, or its frames, are far out of range."""
    for name, (least, most) in _RANGES.items():
        if not least <= getattr(footprint, name) <= most:
            raise ValueError(f"{name} is {getattr(footprint, name):g}")
    frames = np.concatenate([footprint.compression.frames, footprint.rim.frames])
    longest = LONGEST_PAUSE * (len(frames) + len(footprint.load_frames)) * footprint.frame_step
    if len(frames) and np.ptp(frames) > MOST_SAMPLES + longest:
        raise ValueError("frames are too far apart")
