"""C3D files: the binary format of motion laboratories, with markers and the raw channels of force plates.

References
----------
The C3D file format, a technical user manual (c3d.org): header, parameters, frames of points and analog
samples, in the number formats of three families of processors.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..numerics.arrays import Array
from .c3d_parameters import Parameters
from .captured import Capture, check_length, metres
from .plates import plates_of

_BLOCK = 512
_KEY = 0x50
_INTEL, _DEC, _SGI = 84, 85, 86


@dataclass(frozen=True)
class _Numbers:
    """Number format of a family of processors."""

    processor: int

    @property
    def order(self) -> str:
        return ">" if self.processor == _SGI else "<"

    def integers(self, content: bytes, *, signed: bool = True) -> Array:
        return np.frombuffer(content, f"{self.order}{'i' if signed else 'u'}2").astype(float)

    def reals(self, content: bytes) -> Array:
        if self.processor != _DEC:
            with np.errstate(invalid="ignore"):  # damaged numbers are recognised later
                return np.frombuffer(content, f"{self.order}f4").astype(float)
        # VAX F-float: the halves of an IEEE number in turn, its exponent greater by two.
        halves = np.frombuffer(content, "<u2").reshape(-1, 2)
        return np.ascontiguousarray(halves[:, ::-1]).view("<f4")[:, 0].astype(float) / 4


def read(content: bytes) -> Capture:
    """Markers and plates of a C3D file.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    InputError
        If it is no C3D file, is cut short, or contradicts itself.
    """
    with _told_as_damage():
        return _read(content)


def parameters(content: bytes) -> Parameters:
    """The parameters of a C3D file; raises as `read` does."""
    with _told_as_damage():
        return _parameters(content)[0]


@contextmanager
def _told_as_damage() -> Iterator[None]:
    try:
        yield
    except (struct.error, ValueError, IndexError, OverflowError) as error:
        raise InputError(f"the C3D file is damaged ({error}): export it again", "damaged_file") from error


def _read(content: bytes) -> Capture:
    parameters, numbers = _parameters(content)
    layout = _Layout.of(content, parameters, numbers)
    points, analog = _frames(content, layout, numbers)
    unit = metres(parameters.text("POINT", "UNITS", "mm") or "mm")
    labels = parameters.texts("POINT", "LABELS")[: layout.points]
    labels += [f"marker {number + 1}" for number in range(len(labels), layout.points)]
    scaled = _scaled_analog(analog, parameters, layout)
    return Capture(
        labels=tuple(labels),
        points=points * unit,
        rate=layout.rate,
        first_frame=layout.first,
        plates=plates_of(scaled, layout.rate * layout.samples, parameters, unit),
    )


def _parameters(content: bytes) -> tuple[Parameters, _Numbers]:
    """The parameter section, and the number format of the file."""
    if len(content) < 2 * _BLOCK or content[1] != _KEY:
        raise InputError("this is not a C3D file: it lacks the mark of one in its second byte", "wrong_format")
    start = (content[0] - 1) * _BLOCK
    if start < 0 or start + 4 > len(content):
        raise InputError("the C3D file is cut short before its parameters: copy or export it again", "cut_short")
    numbers = _Numbers(content[start + 3])
    if numbers.processor not in (_INTEL, _DEC, _SGI):
        raise ValueError(f"of an unknown processor, {numbers.processor}")
    end = min(len(content), start + max(content[start + 2], 1) * _BLOCK)
    parameters, groups = Parameters(), dict[int, str]()
    waiting: list[tuple[int, str, Any]] = []  # parameters may come before the group that they belong to
    place = start + 4
    while place + 4 <= end:
        length, group = abs(struct.unpack_from("b", content, place)[0]), struct.unpack_from("b", content, place + 1)[0]
        if length == 0 or group == 0:
            break
        name = content[place + 2 : place + 2 + length].decode("latin-1").strip().upper()
        pointer = place + 2 + length
        (further,) = struct.unpack_from(f"{numbers.order}H", content, pointer)
        if group < 0:
            groups[-group] = name
        else:
            waiting.append((group, name, _value(content, pointer + 2, numbers)))
        if further < 2:
            break
        place = pointer + further
    for group, name, value in waiting:
        parameters.values[groups.get(group, ""), name] = value
    return parameters, numbers


def _value(content: bytes, place: int, numbers: _Numbers) -> Any:
    """One parameter: texts, or an array in the order of its dimensions."""
    kind, count = struct.unpack_from("bB", content, place)
    shape = tuple(content[place + 2 : place + 2 + count])
    size = int(np.prod(shape, dtype=np.int64)) if shape else 1
    first = place + 2 + count
    part = content[first : first + size * abs(kind)]
    if kind not in (-1, 1, 2, 4) or len(part) < size * abs(kind):
        raise InputError("the C3D file is damaged in its parameters: export it again", "damaged_file")
    if kind == -1:
        width = shape[0] if shape else 1
        return [part[at : at + width].decode("latin-1").strip() for at in range(0, size, width)] if width else []
    if kind == 1:
        values = np.frombuffer(part, np.int8).astype(float)
    else:
        values = numbers.integers(part) if kind == 2 else numbers.reals(part)
    return values.reshape(shape, order="F") if shape else values


@dataclass(frozen=True)
class _Layout:
    """Position and content of the frames."""

    points: int
    channels: int
    samples: int
    """Analog samples of each channel in a frame."""
    first: int
    frames: int
    scale: float
    """Scale of whole numbers [the file's unit]; negative where the file holds reals."""
    start: int
    rate: float

    @staticmethod
    def of(content: bytes, parameters: Parameters, numbers: _Numbers) -> _Layout:
        words = numbers.integers(content[:24], signed=False).astype(int)
        scale, rate = numbers.reals(content[12:16])[0], numbers.reals(content[20:24])[0]
        points = int(parameters.number("POINT", "USED", words[1])) & 0xFFFF
        samples = max(int(words[9]), 1)
        channels = int(words[2]) // samples
        first, last = _frame_range(parameters, int(words[3]), int(words[4]))
        start = (int(parameters.number("POINT", "DATA_START", words[8])) & 0xFFFF) - 1
        return _Layout(
            points,
            channels,
            samples,
            first,
            last - first + 1,
            float(parameters.number("POINT", "SCALE", scale)),
            start * _BLOCK,
            float(parameters.number("POINT", "RATE", rate)),
        )


def _frame_range(parameters: Parameters, first: int, last: int) -> tuple[int, int]:
    """First and last frame; beyond 65,535 they are in parameters of two words."""
    start, end = (parameters.array("TRIAL", f"ACTUAL_{edge}_FIELD").ravel() for edge in ("START", "END"))
    if len(start) == 2 and len(end) == 2:
        low, high = (int(words[0]) % 65536 + 65536 * (int(words[1]) % 65536) for words in (start, end))
        return (low, high) if high >= low else (first, last)
    return first, last


def _frames(content: bytes, layout: _Layout, numbers: _Numbers) -> tuple[Array, Array]:
    """Points (F, M, 3) [the file's unit] and raw analog samples (F·samples, channels)."""
    real = layout.scale < 0
    width = 4 if real else 2
    values = 4 * layout.points + layout.channels * layout.samples
    size = layout.frames * values * width
    section = content[layout.start : layout.start + size]
    if layout.frames < 1 or layout.start < _BLOCK or values < 1 or len(section) < size:
        raise InputError(
            f"the C3D file is cut short: {layout.frames} frames of {values * width} bytes should follow, "
            f"{max(len(section), 0)} bytes do; copy or export it again",
            "cut_short",
        )
    check_length(layout.frames, layout.rate)
    table = (numbers.reals(section) if real else numbers.integers(section)).reshape(layout.frames, values)
    points = table[:, : 4 * layout.points].reshape(layout.frames, layout.points, 4)
    seen = (points[..., 3:] >= 0) & np.isfinite(points).all(axis=-1, keepdims=True)
    where = np.where(seen, points[..., :3] * (1.0 if real else layout.scale), np.nan)
    return where, table[:, 4 * layout.points :].reshape(layout.frames * layout.samples, layout.channels)


def _scaled_analog(raw: Array, parameters: Parameters, layout: _Layout) -> Array:
    """Analog samples in the units of their channels, (S, channels)."""
    if not layout.channels:
        return raw
    if parameters.text("ANALOG", "FORMAT").upper() == "UNSIGNED" and layout.scale > 0:
        raw = raw % 65536

    def each(name: str, missing: float) -> Array:
        values = parameters.array("ANALOG", name).ravel()[: layout.channels]
        return np.append(values, np.full(layout.channels - len(values), missing))

    offsets = each("OFFSET", 0.0)
    if parameters.text("ANALOG", "FORMAT").upper() == "UNSIGNED":
        offsets %= 65536
    return (raw - offsets) * each("SCALE", 1.0) * parameters.number("ANALOG", "GEN_SCALE", 1.0)
