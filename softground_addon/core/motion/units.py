"""Units of files, told by the size of the body in them."""

from __future__ import annotations

import numpy as np

LARGEST, SMALLEST = 15.0, 0.05
"""Bodies beyond these are mostly of a file in other units [m]: hardly anything on legs is larger, little is smaller."""

PERSON = 1.7
"""What most bodies are about as large as [m], by which the unit of a file is guessed."""

UNITS = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254, "MMD's units of 8 cm": 0.08}
"""Units of files that are read as if they were metres [m]; metres are also read as if they were one of these."""


def scale_to_metres(size: float) -> float:
    """Factor that brings a body whose file is in another unit to the size of a person, from its size [m]; else 1.

    Examples
    --------
    >>> [scale_to_metres(size) for size in (1.7, 20.0, 170.0, 0.017)]
    [1.0, 0.08, 0.01, 100.0]
    """
    if size == 0 or SMALLEST <= size <= LARGEST:
        return 1.0
    factors = [unit if size > LARGEST else 1 / unit for unit in UNITS.values()]
    return min(factors, key=lambda factor: abs(np.log(factor * size / PERSON)))


def wrong_unit(size: float) -> str:
    """What the file of a body of such a size [m] was made in, and read as; empty where `scale_to_metres` is 1."""
    factor = scale_to_metres(size)
    names = [name for name, unit in UNITS.items() if factor in (unit, 1 / unit)]
    return "" if not names else names[0] if size > LARGEST else f"metres, and was read as {names[0]}"
