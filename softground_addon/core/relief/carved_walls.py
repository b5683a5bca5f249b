"""Walls of prints where bodies carve: relief moves no wall that a leg has cut away.

The relief of a print bends its walls sideways. Where a leg has carved beside the print, there is no wall any more, and
what is bent there would stand up as a needle, as high as the print is deep.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..ground.display_blur import blurred_window
from ..ground.places import Places
from ..numerics.arrays import Array
from ..numerics.bilinear import sample_map
from ..numerics.neighbourhood import lowest_within
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint, recompose

REACH = 0.012
"""Distance within which relief bends a wall sideways [m]."""
ROUGHNESS = 0.012
"""Change of height that needs no wall [m]."""


@sliced
def room(footprints: Sequence[Footprint], places: Places, blur_sigma: float) -> Slices[tuple[Array, Array]]:
    """Lowest and highest change of height by relief at places, (K,) and (K,) [m].

    Infinite where no body carves, and where the carved ground has no wall. Near one, ground with relief lies
    between the lowest and the highest that is displayed within `REACH`, to `ROUGHNESS`.

    Parameters
    ----------
    blur_sigma : float
        Standard deviation of the display blur [m].
    """
    low, high = np.full(len(places.x), -np.inf), np.full(len(places.x), np.inf)
    carves = [footprint for footprint in footprints if not len(footprint.contact_cells)]
    if not carves:
        return low, high
    ground, size = recompose(footprints), carves[0].cell_size
    reach = int(np.ceil(REACH / size))
    for carve in carves:
        yield
        window = carve.window.expanded(2 * reach)
        point = places.within(carve.window.expanded(reach), size)
        if not len(point):
            continue
        compression, rim = blurred_window(ground, window, blur_sigma)
        heights, (x, y) = rim - compression, (places.x[point], places.y[point])
        cell, first = window.cells_under(x, y, size), window.corners(size)[0] + size / 2
        here = sample_map(heights, np.stack([x, y], axis=-1), first, size)
        lowest, highest = lowest_within(heights, reach)[cell], -lowest_within(-heights, reach)[cell]
        walls = highest - lowest > ROUGHNESS
        low[point[walls]] = (lowest - here - ROUGHNESS)[walls]
        high[point[walls]] = (highest - here + ROUGHNESS)[walls]
    return low, high
