"""Throws of contacts, stored with their footprints: soles land, push off and leave, whatever becomes of the prints.

Debris is made again from them and the edited prints, without the animation; thrown volumes are missing from the rims.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, TypeVar

import numpy as np

from ..numerics.arrays import Array
from ..numerics.packed import Packed
from .edits import StepEdit
from .footprints import QUANTUM, Footprint

_Part = TypeVar("_Part")

WEIGHT, AIM, FOLLOWED = 0, slice(1, 4), 4
"""Columns of `Throw.samples`: see there."""
_NUMBERS = ("first", "spacing", "speed", "landed_by")
_LARGEST = 1e9
"""Largest stored number: a larger one is damage."""
_MOST_POINTS = 10_000
"""Most points of a sole, as in `contact_arrays`."""


class ThrowKind(IntEnum):
    """Source of thrown matter; a slide is a push."""

    LANDING = 0
    PUSH = 1
    SHED = 2
    PLOUGH = 3


WADE = "wade"
"""Phase of what is thrown by bodies that carve: it is missing from what they left loose."""


@dataclass(frozen=True)
class Throw:
    """Throw of one contact as it lands, pushes off or leaves.

    Attributes
    ----------
    number : int
        Of the footprint as it was baked.
    phase : str
        See `core.events.phases`.
    is_foot : bool
        True if it has a heel and a ball to roll over.
    first, spacing : float
        Scene frame of the first sample, and scene frames from one to the next.
    speed : float
        Of a landing, into the ground [m/s].
    landed_by : float
        Scene frame until which the landing compacts the ground.
    samples : (K, 4 + 6·L) float array
        At K times: the share that is thrown, of all that a print of its size throws, or the volume that is ploughed
        [m³]; the unit vector that it is thrown
        along, 0 where it goes with the sole; L points of the sole [m], and their velocities [m/s].
    """

    number: int
    phase: str
    kind: ThrowKind
    is_foot: bool
    first: float
    spacing: float
    speed: float
    landed_by: float
    samples: Packed[np.float32] = Packed()

    def followed(self) -> tuple[Array, Array]:
        """Points of the sole and their velocities, (K, L, 3) [m] and [m/s]."""
        samples = self.samples[:, FOLLOWED:].astype(np.float64)
        points, velocities = samples.reshape(len(samples), 2, -1, 3).transpose(1, 0, 2, 3)
        return points, velocities

    def placed(self, baked: Footprint, edited: Footprint, edit: StepEdit) -> Throw:
        """The same of a step that the artist has moved, turned, scaled or shifted in time.

        Parameters
        ----------
        baked, edited : Footprint
            The step as it was baked and as it was edited.
        """
        shift = round(edit.shift_frames / baked.frame_step) * baked.frame_step
        turn, moved = edited.heading - baked.heading, edited.position - baked.position
        if not (shift or turn or moved.any()) and edit.scale == 1.0:
            return self
        cos, sin = np.cos(turn), np.sin(turn)
        turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        points, velocities = self.followed()
        samples = self.samples.astype(np.float64)
        samples[:, AIM] = samples[:, AIM] @ turned.T
        points = edited.position + edit.scale * (points - baked.position) @ turned.T
        velocities = edit.scale * velocities @ turned.T
        samples[:, FOLLOWED:] = np.stack([points, velocities], axis=1).reshape(len(samples), -1)
        return replace(
            self,
            first=self.first + shift,
            landed_by=self.landed_by + shift,
            speed=self.speed * edit.scale,
            samples=samples.astype(np.float32),
        )


def to_json(throw: Throw) -> dict[str, Any]:
    """A throw for JSON."""
    samples = throw.samples
    content = base64.b64encode(zlib.compress(samples.astype("<f4").tobytes())).decode()
    about = {name: getattr(throw, name) for name in ("number", "phase", "kind", "is_foot", *_NUMBERS)}
    return about | {"shape": list(samples.shape), "samples": content}


def from_json(contents: Sequence[Mapping[str, Any]], count: int, largest: int) -> list[Throw]:
    """The throws from the result of `to_json` for each.

    Parameters
    ----------
    count : int
        Of footprints that were baked.
    largest : int
        Most that their samples may take together [bytes]: no more than that is unpacked.

    Raises
    ------
    ValueError, KeyError, TypeError, zlib.error
        If it was forged or damaged.
    """
    shapes = [content["shape"] for content in contents]
    if any(type(size) is not int or size < 0 for shape in shapes for size in shape):
        raise ValueError("debris has samples of no size")
    if sum(4 * rows * columns for rows, columns in shapes) > largest:
        raise ValueError("debris is larger than the file")
    return [_throw(content, count) for content in contents]


def _throw(content: Mapping[str, Any], count: int) -> Throw:
    rows, columns = content["shape"]
    number, phase, kind, is_foot = (content[name] for name in ("number", "phase", "kind", "is_foot"))
    kinds = (type(number), type(phase), type(kind), type(is_foot))
    if kinds != (int, str, int, bool) or not 0 <= number < count:
        raise ValueError("it throws what no step of it does")
    if not rows or not 0 < columns - FOLLOWED <= 6 * _MOST_POINTS or (columns - FOLLOWED) % 6:
        raise ValueError("debris along no path")
    unpacking, size = zlib.decompressobj(), 4 * rows * columns
    packed = base64.b64decode(content["samples"], validate=True)
    samples = np.frombuffer(unpacking.decompress(packed, size + 1), "<f4").reshape(rows, columns)
    numbers = {name: float(content[name]) for name in _NUMBERS}
    if not (np.abs([*numbers.values(), *samples.ravel()]) <= _LARGEST).all() or not (samples[:, WEIGHT] >= 0).all():
        raise ValueError("it throws what is no number")
    return Throw(number, phase, ThrowKind(kind), is_foot, **numbers, samples=samples.astype(np.float32))


def of_print(thrown: Mapping[str, float]) -> float:
    """Volume that the rim of a print lacks, of volumes thrown by phase [m³]; its carve lacks what was ploughed."""
    return sum(volume for phase, volume in thrown.items() if phase != WADE)


def booked(footprint: Footprint, volume: float) -> Footprint:
    """A footprint whose rim lacks the thrown volume [m³]."""
    volume = min(volume, footprint.rim_m3)
    if not volume > 0 or not footprint.rim_m3 > 0:
        return footprint
    amounts, lies = np.asarray(footprint.rim.amounts), footprint.rim_m3
    if not len(footprint.contact_cells):  # thin layers of a carve are recorded with the next
        lies = max(float(amounts.sum(dtype=np.float64)) * QUANTUM * footprint.cell_size**2, volume)
    remaining = 1.0 - volume / lies
    order = np.argsort(np.asarray(footprint.rim.cells), kind="stable")
    # Rounded along each cell's sums, so that no cell loses more than a quantum whatever it went through.
    total = np.cumsum(amounts[order].astype(np.int64))
    rounded = np.diff(np.rint(total * remaining), prepend=0.0)
    scaled = np.empty(len(amounts), np.int32)
    scaled[order] = rounded.astype(np.int32)
    return _changed(footprint, rim=_changed(footprint.rim, amounts=scaled), rim_m3=footprint.rim_m3 - volume)


def _changed(part: _Part, **values: Any) -> _Part:
    """Replace fields as `dataclasses.replace`, which would pack unchanged ones anew."""
    twin = copy(part)
    vars(twin).pop("total", None)  # of the amounts as they were
    for name, value in values.items():
        object.__setattr__(twin, name, value)
    return twin
