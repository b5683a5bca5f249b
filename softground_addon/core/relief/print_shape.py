"""The shape of one print: distance of each place from its outline, and its depth without its wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.display_blur import blurred_inside, gaussian_kernel
from ..ground.sparse_grid import Window
from ..numerics import bilinear
from ..numerics.arrays import Array, Indices, Mask
from ..record.footprints import Footprint

REACH = 0.06
"""Distance from its outline up to which a print has relief [m]."""
MOST_CELLS = 64
"""Cells that the distance to an outline is known for at most: ground of smaller cells carries small feet."""
CORE = 0.008
"""Distance from the outline at which a print is as deep as its floor [m]."""
EVEN = 0.006
"""Standard deviation of the blur that evens out a floor [m]."""
TOUCHED = 0.05
"""Compression, in parts of nearly the deepest, from which a cell belongs to the print: walls slide further."""
NEARLY = 90
"""Percentile of the compressed cells' depths that counts as the deepest."""
NARROW = 1.0
"""Half the width of a print from which it has a shape [cells]."""
SHARP = 0.02
"""Half the width of a print from which lengths of the ground's grain are whole; in smaller ones they are less [m]."""

LEVEL = 0.995
"""Length of a sole seen from above, in parts of the greatest, from which it lies flat."""

SAME, BETWEEN = 1e-3, -2
"""Distance of places that count as one, over the spacing of a raster, and the number of those between its places."""

_FADE = 5
"""Index in `PrintShape.fields` of the nearness to the end of the moved ground."""
MOVED = 1e-5
"""Ground that moves less, or lies beside such cells, has no relief [m]."""
FADING = 0.012
"""Width over which relief ends where the print no longer moves the ground [m]."""


@dataclass(frozen=True)
class Raster:
    """Places in a raster over a print, where it moves the ground.

    Attributes
    ----------
    x, y : (N,) float arrays
        [m]
    number : (rows, columns) int array
        Number of each place of the window, -1 where the print moves nothing.
    """

    window: Window
    spacing: float
    x: Array
    y: Array
    number: Indices

    def numbers(self, x: Array, y: Array) -> Indices:
        """Numbers of the places at x, y (K,) [m]; -1 where the print moves nothing, `BETWEEN` for those between."""
        u, v = x / self.spacing - 0.5, y / self.spacing - 0.5
        between = np.maximum(np.abs(u - np.rint(u)), np.abs(v - np.rint(v))) > SAME
        return np.where(between, BETWEEN, self.nearest(x, y))

    def nearest(self, x: Array, y: Array) -> Indices:
        """Numbers of the places in whose squares x, y (K,) [m] lie; -1 where the print moves nothing."""
        column, row = (np.floor(axis / self.spacing).astype(np.intp) for axis in (x, y))
        column, row = column - self.window.column, row - self.window.row
        within = (column >= 0) & (column < self.window.columns) & (row >= 0) & (row < self.window.rows)
        return np.where(within, self.number[np.where(within, row, 0), np.where(within, column, 0)], -1)


@dataclass(frozen=True)
class PrintShape:
    """One print on the cells of a window.

    Attributes
    ----------
    cell_size : float
        Side of a cell [m].
    fields : (8, rows, columns) float array
        Distance to the outline, positive inside, up to `REACH`; depth of the floor, continued beyond the outline;
        displayed compression and rim; and the rim continued into the print, all [m]; a fade, from 0 at the end of the
        ground that the print moves to 1; and the direction inward, along x and y.
    depth : float
        Mean depth of the floor [m].
    fineness : float
        Scale of lengths, 1 or less for small prints.
    position : (2,) float array
        Middle of the pressure [m].
    heading : (2,) float array
        Direction of the toes.
    along, across : (float, float)
        Ends of the sole along it, heel and toes, and across, right and left, from the middle of the pressure [m]; those
        of the print where the sole is not known.
    """

    window: Window
    cell_size: float
    fields: Array
    depth: float
    fineness: float
    position: Array
    heading: Array
    along: tuple[float, float]
    across: tuple[float, float]

    def at(self, x: Array, y: Array, count: int = 8) -> Array:
        """The first fields, all by default, at world places (N,), bilinear between cells, (count, N)."""
        return self._between(self.fields[:count], x, y)

    def moves(self, x: Array, y: Array) -> Mask:
        """True for world places (N,) at which the print moves the ground."""
        return np.asarray(self._between(self.fields[_FADE, None], x, y)[0] > 0)

    def moved(self, spacing: float) -> Raster:
        """The centres of cells, or at about such a spacing of equal parts of them, where the print moves the ground."""
        parts = max(1, round(self.cell_size / spacing))
        window = self.window.refined(parts)
        x, y = (centres.ravel() for centres in np.meshgrid(*window.centres(self.cell_size / parts)))
        moves = self.moves(x, y)
        number = np.where(moves, np.cumsum(moves) - 1, -1).reshape(window.rows, window.columns)
        return Raster(window, self.cell_size / parts, x[moves], y[moves], number)

    def _between(self, fields: Array, x: Array, y: Array) -> Array:
        column = np.clip(x / self.cell_size - 0.5 - self.window.column, 0.0, self.window.columns - 1.001)
        row = np.clip(y / self.cell_size - 0.5 - self.window.row, 0.0, self.window.rows - 1.001)
        first, low = np.floor(column).astype(np.intp), np.floor(row).astype(np.intp)
        corner = low * self.window.columns + first
        flat = fields.reshape(len(fields), -1)
        above = corner + self.window.columns
        around = (flat.take(at, axis=1) for at in (corner, corner + 1, above, above + 1))
        return np.asarray(bilinear.between(around, np.asarray(column - first), np.asarray(row - low)))

    def under_sole(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Distances of places along the foot and to its left from the middle of the pressure [m]."""
        dx, dy = x - self.position[0], y - self.position[1]
        cos, sin = self.heading
        return dx * cos + dy * sin, dy * cos - dx * sin


def shape_of(footprint: Footprint, blur_sigma: float) -> PrintShape | None:
    """The shape of a footprint as it is displayed with some blur [m]; None where it pressed next to nothing."""
    size = footprint.cell_size
    kernel = gaussian_kernel(blur_sigma / size)
    margin = len(kernel) // 2 + 2
    window = footprint.window.expanded(margin)
    compression, rim = (np.pad(footprint.tile(changes), margin) for changes in (footprint.pressing, footprint.rim))
    inside = inside_of(compression)
    if not inside.any():
        return None
    far = min(int(np.ceil(REACH / size)), MOST_CELLS)
    outline = outline_of(inside, far) * size
    if outline.max() < NARROW * size:
        return None
    fineness = float(min(1.0, outline.max() / SHARP))
    core = outline > CORE * fineness
    core = core if core.any() else inside
    even = gaussian_kernel(min(EVEN * fineness / size, float(far)))
    floor = _blurred(compression.ravel()[nearest(core, far)[1]].reshape(inside.shape), even)
    inward = np.gradient(_blurred(outline, gaussian_kernel(1.5)), size)[::-1]
    heading = np.array([np.cos(footprint.heading), np.sin(footprint.heading)])
    return PrintShape(
        window,
        size,
        np.stack([outline, floor, *_displayed(compression, rim, inside, kernel, size, far), *inward]),
        float(compression[core].mean()),
        fineness,
        footprint.position[:2],
        heading,
        *_ends(footprint, window, inside, heading),
    )


def inside_of(compression: Array) -> Mask:
    """Cells that belong to a print, from the compression of its cells [m]."""
    pressed = compression[compression > 0]
    return np.asarray(compression > (TOUCHED * np.percentile(pressed, NEARLY) if len(pressed) else np.inf))


def outline_of(inside: Mask, far: int) -> Array:
    """Distance of cells to the outline of a print, positive inside, up to `far` [cells]."""
    to_print, to_ground = nearest(inside, far)[0], nearest(~inside, far)[0]
    return _blurred(np.where(inside, to_ground - 0.5, 0.5 - to_print), gaussian_kernel(1.0))


def _displayed(
    compression: Array, rim: Array, inside: Mask, kernel: Array, size: float, far: int
) -> tuple[Array, Array, Array, Array]:
    """The third to the sixth of `PrintShape.fields`."""
    displayed, risen = (_blurred(values, kernel) for values in (compression, rim))
    outside = _blurred((~inside).astype(np.float64), kernel)
    continued = np.where(outside > 0.2, risen / np.maximum(outside, 0.2), risen)
    to_end, _ = nearest((displayed <= MOVED) & (risen <= MOVED), far)
    return displayed, risen, continued, np.clip((to_end - 1.5) * size / FADING, 0.0, 1.0)


def _outline_on_ground(footprint: Footprint) -> Array | None:
    """Outline of a sole where it lay flattest, (2, N) [m]; None of a prop, and where it is not known."""
    pressed_by = footprint.pressed_by
    if pressed_by is None or pressed_by.pressing.sole.prop is not None:
        return None
    poses = pressed_by.steps(footprint.load_frames).poses[:, 0]
    flatness = np.hypot(poses[:, 0, 0], poses[:, 1, 0])
    flat = np.flatnonzero(flatness > LEVEL * flatness.max())
    lay = poses[flat[len(flat) // 2]]
    return np.asarray(lay[:2, :2] @ pressed_by.pressing.sole.outline.T + lay[:2, 3:])


def _ends(
    footprint: Footprint, window: Window, inside: Mask, heading: Array
) -> tuple[tuple[float, float], tuple[float, float]]:
    """See `PrintShape.along` and `across`."""
    position, size = footprint.position[:2], footprint.cell_size
    outline = _outline_on_ground(footprint)
    places = np.stack(np.meshgrid(*window.centres(size)))[:, inside] if outline is None else outline
    x, y = places - position[:, None]
    along, across = x * heading[0] + y * heading[1], y * heading[0] - x * heading[1]
    return (float(along.min()), float(along.max())), (float(across.min()), float(across.max()))


def nearest(chosen: Mask, far: int) -> tuple[Array, Indices]:
    """Distance to the nearest chosen cell's centre [cells], up to `far`, and the index of that cell.

    Exact by one direction after the other (Felzenszwalb and Huttenlocher 2012, doi:10.4086/toc.2012.v008a019), with
    the minimum over all columns within reach in place of the envelope of parabolas.

    Examples
    --------
    >>> distance, which = nearest(np.array([[True, False, False], [False, False, False]]), 9)
    >>> distance.round(3).tolist(), which[1].tolist()
    ([[0.0, 1.0, 2.0], [1.0, 1.414, 2.236]], [0, 0, 0])
    """
    rows, columns = chosen.shape
    row = np.arange(rows)[:, None]
    below = np.maximum.accumulate(np.where(chosen, row, -far - rows), axis=0)
    above = np.minimum.accumulate(np.where(chosen, row, 2 * rows + far)[::-1], axis=0)[::-1]
    source = np.where(row - below <= above - row, below, above)
    high = np.minimum(np.abs(source - row), far + 1).astype(np.int64) ** 2
    # Squares of distances with the cells behind them, so that one comparison takes the nearest of both.
    in_column = (high << 32) + np.clip(source, 0, rows - 1) * columns + np.arange(columns)
    best = in_column.copy()
    for shift in range(1, min(far, columns - 1) + 1):
        if shift * shift >= int(best.max()) >> 32:
            break
        for to, beside in ((slice(shift, None), slice(None, -shift)), (slice(None, -shift), slice(shift, None))):
            np.minimum(best[:, to], in_column[:, beside] + (shift * shift << 32), out=best[:, to])
    return np.minimum(np.sqrt(best >> 32), float(far)), best & 0xFFFFFFFF


def _blurred(values: Array, kernel: Array) -> Array:
    margin = len(kernel) // 2
    for axis, size in enumerate(values.shape):  # its edges go on
        values = values.take(np.arange(-margin, size + margin), axis=axis, mode="clip")
    return blurred_inside(values, kernel)
