"""Values between the four corners of a square."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def between(corners: Iterable[Array], u: Array, v: Array) -> Array:
    """Values at u to the right and v up, 0 to 1, of arrays that broadcast against each other.

    Parameters
    ----------
    corners : four float arrays
        Below, below right, above and above right.
    u, v : float arrays

    Examples
    --------
    >>> float(between((0.0, 1.0, 2.0, 3.0), 0.5, 0.25))
    1.0
    """
    below, below_right, above, above_right = corners
    values: Array = (below * (1 - u) + below_right * u) * (1 - v)
    values += (above * (1 - u) + above_right * u) * v
    return values
