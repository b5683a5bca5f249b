"""Where under a sole each spot of the ground lay: detail of prints that is finer than the ground's cells."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np

from ..ground.heightfield import SparseGrid
from .footprints import Footprint


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
        Characters and names of the soles that leave a mark; by default all. The others wipe out what is under them.

    Returns
    -------
    SparseGrid
        Of three channels: how far along the sole's heading and to its left from the middle of its pressure [m], and
        1 where it touched. The first two go on around a print, so that they may be interpolated at its edge.
    """
    marks = SparseGrid(cell_size, channels=3)
    for footprint in footprints:
        window = footprint.window
        x, y = np.meshgrid(*window.centres(cell_size))
        dx, dy = x - footprint.position[0], y - footprint.position[1]
        cos, sin = np.cos(footprint.heading), np.sin(footprint.heading)
        values = marks.read(window)
        touched = np.zeros(window.cells, dtype=bool)
        touched[footprint.contact_cells] = True
        touched = touched.reshape(window.rows, window.columns)
        own = touched | (values[2] == 0)
        values[0] = np.where(own, dx * cos + dy * sin, values[0])
        values[1] = np.where(own, dy * cos - dx * sin, values[1])
        is_shod = shod is None or (footprint.character, footprint.sole) in shod
        values[2] = np.where(touched, float(is_shod), values[2])
        marks.write(window, values)
    return marks
