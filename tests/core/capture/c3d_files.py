"""C3D files made by the format's manual: any processor, whole numbers or reals, plates of any type."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

INTEL, DEC, SGI = 84, 85, 86
BLOCK = 512
Parameters = Mapping[str, Mapping[str, Any]]
"""Values by group and name: texts, arrays of whole numbers or reals, shaped as the manual shapes them."""


def c3d_file(
    points: Array,
    rate: float,
    *,
    labels: list[str] | None = None,
    analog: Array | None = None,
    samples: int = 1,
    plates: Mapping[str, Any] | None = None,
    processor: int = INTEL,
    scale: float = -1.0,
    first: int = 1,
    more: Parameters | None = None,
) -> bytes:
    """A file of points (F, M, 3) in mm and analog samples (F·samples, channels); NaN is a marker that was not seen."""
    frames, count = points.shape[:2]
    analog = np.zeros((frames * samples, 0)) if analog is None else analog
    channels = analog.shape[1]
    groups: dict[str, Mapping[str, Any]] = {
        "POINT": {
            "USED": np.array([count]), "SCALE": np.array([scale]), "RATE": np.array([rate]), "UNITS": ["mm"],
            "LABELS": labels or [f"m{index}" for index in range(count)], "DATA_START": np.array([0]),
        },
        "ANALOG": {
            "USED": np.array([channels]), "RATE": np.array([rate * samples]), "GEN_SCALE": np.array([1.0]),
            "SCALE": np.full(channels, 0.5 if scale > 0 else 1.0), "OFFSET": np.zeros(channels, int),
            "LABELS": [f"c{index}" for index in range(channels)], "UNITS": ["V"] * channels,
        },
        "FORCE_PLATFORM": plates or {"USED": np.array([0])},
        **(more or {}),
    }  # fmt: skip
    size = len(_section(groups, processor))
    start = 2 + -(-size // BLOCK)
    groups["POINT"] = {**groups["POINT"], "DATA_START": np.array([start])}
    section = _section(groups, processor)
    section = section[:2] + bytes([start - 2, processor]) + section[4:]
    order = ">" if processor == SGI else "<"
    header = struct.pack("BB", 2, 0x50) + struct.pack(
        f"{order}5H", count, channels * samples, first, min(first + frames - 1, 65535), 10
    )
    header += _reals(np.array([scale]), processor) + struct.pack(f"{order}2H", start, samples)
    header += _reals(np.array([rate]), processor)
    return (
        header.ljust(BLOCK, b"\0")
        + section.ljust((start - 2) * BLOCK, b"\0")
        + _data(points, analog.reshape(frames, samples * channels), scale, processor)
    )


def _data(points: Array, analog: Array, scale: float, processor: int) -> bytes:
    seen = np.isfinite(points).all(axis=-1, keepdims=True)
    whole = scale > 0
    words = np.concatenate(
        [np.where(seen, points / scale if whole else points, 0.0), np.where(seen, 0.0, -1.0)], axis=-1
    )
    table = np.concatenate([words.reshape(len(words), 4 * points.shape[1]), analog / (0.5 if whole else 1.0)], axis=1)
    return _integers(table, processor) if whole else _reals(table, processor)


def _integers(values: Array, processor: int) -> bytes:
    return np.round(values).astype(">i2" if processor == SGI else "<i2").tobytes()


def _reals(values: Array, processor: int) -> bytes:
    if processor != DEC:
        return values.astype(">f4" if processor == SGI else "<f4").tobytes()
    halves = (values * 4).astype("<f4").view("<u2").reshape(-1, 2)
    return np.ascontiguousarray(halves[:, ::-1]).tobytes()


def _section(groups: Parameters, processor: int) -> bytes:
    order = ">" if processor == SGI else "<"
    entries = []
    for number, (group, parameters) in enumerate(groups.items(), start=1):
        entries.append((group, -number, b"\0"))
        entries += [(name, number, _value(value, processor) + b"\0") for name, value in parameters.items()]
    section = b"\1\x50\0\0"
    for place, (name, number, rest) in enumerate(entries):
        further = 0 if place == len(entries) - 1 else 2 + len(rest)
        section += struct.pack("bb", len(name), number) + name.encode() + struct.pack(f"{order}H", further) + rest
    return section


def _value(value: Any, processor: int) -> bytes:
    if isinstance(value, list):
        width = max(map(len, value), default=0)
        return struct.pack("bBBB", -1, 2, width, len(value)) + "".join(text.ljust(width) for text in value).encode()
    flat = value.ravel(order="F")
    whole = np.issubdtype(value.dtype, np.integer)
    content = _integers(flat, processor) if whole else _reals(flat, processor)
    return struct.pack("bB", 2 if whole else 4, value.ndim) + bytes(value.shape) + content
