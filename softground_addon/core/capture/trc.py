"""TRC files: markers as tab-separated text, as OpenSim and markerless capture write them."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from .captured import Capture, check_length, metres

_HEADER_LINES = 5
_SPARSE = 10_000_000
"""Values up to which a table may have more of them than the file has bytes: lines may end before markers not seen."""


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
        raise InputError('this is no TRC file: its first line lacks "PathFileType"', "wrong_format")
    about = dict(zip(lines[1].split(), lines[2].split(), strict=False))
    labels = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    if not labels:
        raise InputError("the TRC file names no markers in its fourth line: export it again", "no_markers")
    rows = [line for line in lines[_HEADER_LINES:] if line.strip()]
    promised, rate = (_number(about.get(what, "")) for what in ("NumFrames", "DataRate"))
    if len(rows) < promised:
        raise InputError(f"the TRC file is cut short: {len(rows)} of {promised:.0f} frames; copy it again", "cut_short")
    check_length(len(rows), rate)
    width = 2 + 3 * len(labels)
    if len(rows) * width > max(len(content), _SPARSE):
        raise InputError(f"the TRC file holds far fewer than {len(labels):,} markers: export it again", "damaged_file")
    table = np.full((len(rows), width), np.nan)
    for values, row in zip(table, rows, strict=True):
        cells = (row.split("\t") if "\t" in row else row.split())[:width]
        values[: len(cells)] = [_number(cell) for cell in cells]
    points = table[:, 2:].reshape(len(table), len(labels), 3) * metres(about.get("Units", "mm"))
    first = table[0, 0] if len(table) and np.isfinite(table[0, 0]) else 1
    return Capture(tuple(labels), points, rate, int(np.clip(first, 0, 2**31 - 1)))


def _number(cell: str) -> float:
    """The number of a cell, NaN where it is empty or none: a marker that was not seen."""
    try:
        value = float(cell)
    except ValueError:
        return np.nan
    return value if np.isfinite(value) else np.nan
