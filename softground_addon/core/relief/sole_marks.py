"""Place of each spot of the ground under a sole: detail of prints that is finer than the ground's cells."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..ground.sparse_grid import SparseGrid
from ..record.footprints import Footprint

LEVEL, STEEP = 0.4, 0.8
"""Slopes of a print, beside that of the ground: a sole leaves all of its mark up to the first, and none from the second
on, where it slid down a wall."""


def sole_marks(
    footprints: Iterable[Footprint], cell_size: float, shod: Collection[tuple[str, str]] | None = None
) -> SparseGrid:
    """Place under the sole that touched each cell last.

    Parameters
    ----------
    footprints : iterable of Footprint
        In the order of their first contact: later ones go over earlier ones.
    cell_size : float
        Side of a cell [m].
    shod : collection of (str, str), optional
        Characters and names of the soles that leave a mark; by default all. The others wipe out the marks under them.

    Returns
    -------
    SparseGrid
        Of three channels: distance along the sole's heading and to its left from the middle of its pressure [m], and 1
        where it touched, 0 up walls. The first two go on around a print, so that they may be interpolated at its edge.
    """
    marks = SparseGrid(cell_size, channels=3)
    depths = SparseGrid(cell_size, channels=1)
    for footprint in footprints:
        window = footprint.window
        x, y = np.meshgrid(*window.centres(cell_size))
        dx, dy = x - footprint.position[0], y - footprint.position[1]
        cos, sin = np.cos(footprint.heading), np.sin(footprint.heading)
        values = marks.read(window)
        touched = np.zeros(window.cells, dtype=bool)
        touched[footprint.contact_cells] = True
        touched = touched.reshape(window.rows, window.columns)
        marked = touched | (values[2] == 0)
        values[0] = np.where(marked, dx * cos + dy * sin, values[0])
        values[1] = np.where(marked, dy * cos - dx * sin, values[1])
        is_shod = shod is None or (footprint.character, footprint.sole) in shod
        depth = depths.read(window) + footprint.tile(footprint.compression)
        depths.write(window, depth)
        slopes = np.hypot(*np.gradient(np.pad(depth[0], 1, mode="edge"), cell_size))
        steepest = sliding_window_view(slopes, (3, 3)).max(axis=(2, 3))  # relief moves walls by about a cell
        level = np.clip((STEEP - steepest) / (STEEP - LEVEL), 0.0, 1.0)
        values[2] = np.where(touched, is_shod * level, values[2])
        marks.write(window, values)
    return marks
