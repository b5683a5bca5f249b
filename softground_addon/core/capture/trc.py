"""TRC files: markers as tab-separated text, as OpenSim and markerless capture write them."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from .captured import Capture, metres

_HEADER_LINES = 5
_MOST_MARKERS = 100_000


def read(content: bytes) -> Capture:
    """Markers of a TRC file.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    InputError
        If it is no TRC file, or is cut short.
    """
    lines = content.decode("utf-8", errors="replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if len(lines) <= _HEADER_LINES or "PathFileType" not in lines[0]:
        raise InputError('this is no TRC file: its first line lacks "PathFileType"')
    about = dict(zip(lines[1].split(), lines[2].split(), strict=False))
    labels = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    if not 0 < len(labels) < _MOST_MARKERS:
        raise InputError("the TRC file names no markers in its fourth line: export it again")
    rows = [line for line in lines[_HEADER_LINES:] if line.strip()]
    table = np.array([_numbers(row, 2 + 3 * len(labels)) for row in rows]).reshape(-1, 2 + 3 * len(labels))
    promised = about.get("NumFrames", "")
    if promised.isdigit() and len(table) < int(promised):
        raise InputError(
            f"the TRC file is cut short: it holds {len(table)} of {promised} frames; copy or export it again"
        )
    try:
        rate = float(about["DataRate"])
    except (KeyError, ValueError):
        raise InputError("the TRC file has no data rate in its third line: export it again") from None
    points = table[:, 2:].reshape(len(table), len(labels), 3) * metres(about.get("Units", "mm"))
    first = table[0, 0] if len(table) and np.isfinite(table[0, 0]) else 1
    return Capture(tuple(labels), points, rate, int(np.clip(first, 0, 2**31 - 1)))


def _numbers(row: str, count: int) -> list[float]:
    """The numbers of a line; what is empty or no number is a marker that was not seen."""
    cells = row.split("\t") if "\t" in row else row.split()
    values = [_number(cell) for cell in cells[:count]]
    return values + [np.nan] * (count - len(values))


def _number(cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        return np.nan
    return value if np.isfinite(value) else np.nan
