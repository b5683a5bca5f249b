"""Soles as maps of the height of each spot, from an image or from a mesh, and as text for the record."""

from __future__ import annotations

import base64
import binascii

import numpy as np
from numpy.typing import NDArray

from ..numerics import bilinear
from ..numerics.arrays import Array
from .print_shape import nearest

Map = NDArray[np.uint8]

ALONG, ACROSS = 192, 72
"""Spots of a map from heel to toes, and from the left side to the right: 1.4 mm apart on a foot of 27 cm."""

WIDEST_GROOVE = 0.06
"""Width of the widest grooves over the length of a sole; wider ones are its shape."""
DEEPEST = 98
"""Percentile of the grooves' heights that counts as the deepest."""
FLAT = 0.002
"""Depth of the grooves over the length of a sole, below which it has none: half a millimetre on a shoe."""


def from_picture(values: Array) -> Map:
    """A map from brightness (rows, columns), the first row at the bottom.

    The long side is from heel to toes: at the top, or at the right of a picture that is wider than high. White stands
    out and presses, black is a groove.

    Returns
    -------
    (ALONG, ACROSS) uint8 array
        Means over the picture, which is cut into as many parts.
    """
    return _in_parts(values if values.shape[0] >= values.shape[1] else values[::-1].T)


def _in_parts(upright: Array) -> Map:
    rows, columns = (_shares(count, size) for count, size in zip((ALONG, ACROSS), upright.shape, strict=True))
    mean = rows @ np.clip(np.nan_to_num(upright), 0.0, 1.0) @ columns.T
    return np.rint(255.0 * np.clip(mean, 0.0, 1.0)).astype(np.uint8)


def _shares(count: int, size: int) -> Array:
    """Share of each of `size` pixels in each of `count` parts of a row, (count, size)."""
    ends = np.linspace(0.0, size, count + 1)
    low, high = np.maximum(ends[:-1, None], np.arange(size)), np.minimum(ends[1:, None], np.arange(size) + 1)
    return np.asarray(np.maximum(high - low, 0.0) * (count / size))


def from_underside(heights: Array, length: float) -> Map | None:
    """A map from the underside of a sole; None where that is flat.

    Parameters
    ----------
    heights : (along, across) float array
        Of the underside over nodes from heel to toes and from left to right [m], infinite where there is none.
    length : float
        Of the sole [m].

    Returns
    -------
    (ALONG, ACROSS) uint8 array or None
        Grooves rise above the opening of the heights: they are narrower than `WIDEST_GROOVE` (top-hat transform, Serra
        1982, Image Analysis and Mathematical Morphology, ch. XII).
    """
    inside = np.isfinite(heights)
    far = max(1, round(0.5 * WIDEST_GROOVE * len(heights)))
    margin = 2 * far
    wide = np.pad(heights, margin, constant_values=np.inf)
    inside = np.isfinite(wide)
    if not inside.any():
        return None
    level = wide.ravel()[nearest(inside, margin)[1]].reshape(wide.shape)  # soles go on at their edges
    level = np.where(np.isfinite(level), level, level[inside].max())
    grooves = np.where(inside, level + _lowest(-_lowest(level, far), far), 0.0)
    depth = float(np.percentile(grooves[inside], DEEPEST))
    shown = grooves[margin:-margin, margin:-margin]
    return _in_parts(1.0 - shown / depth) if depth > FLAT * length else None


def _lowest(heights: Array, far: int) -> Array:
    """The lowest height within so many nodes, along both axes."""
    for axis in (0, 1):
        wide = np.pad(heights, [(far, far) if each == axis else (0, 0) for each in (0, 1)], constant_values=np.inf)
        heights = np.lib.stride_tricks.sliding_window_view(wide, 2 * far + 1, axis).min(axis=-1)
    return heights


def as_text(of_sole: Map) -> str:
    """A map as ASCII."""
    return base64.b64encode(of_sole.tobytes()).decode("ascii")


def from_text(text: str) -> Array:
    """The map that `as_text` gave, from 0 to 1, (ALONG, ACROSS).

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        values = np.frombuffer(base64.b64decode(text, validate=True), np.uint8)
    except binascii.Error as error:
        raise ValueError(str(error)) from None
    return values.reshape(ALONG, ACROSS) / 255.0


def height_at(of_sole: Array, along: Array, across: Array) -> Array:
    """Height by which a sole stands out (N,), from 0 to 1.

    Parameters
    ----------
    of_sole : (ALONG, ACROSS) float array
    along, across : (N,) float arrays
        From 0 at the heel to 1 at the toes, and from 0 on the left to 1 on the right.
    """
    row, column = (
        np.clip(place * count - 0.5, 0.0, count - 1.001) for place, count in ((along, ALONG), (across, ACROSS))
    )
    low, first = row.astype(np.intp), column.astype(np.intp)
    corners = (of_sole[low, first], of_sole[low, first + 1], of_sole[low + 1, first], of_sole[low + 1, first + 1])
    return np.asarray(bilinear.between(corners, np.asarray(column - first), np.asarray(row - low)))
