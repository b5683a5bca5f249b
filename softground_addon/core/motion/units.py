"""Units of files, told by the size of the body in them."""

from __future__ import annotations

import numpy as np

LARGEST, SMALLEST = 15.0, 0.05
"""Bodies beyond these are mostly of a file in other units [m]: hardly anything on legs is larger, little is smaller."""

TALLEST, SHORTEST = 3.0, 0.75
"""The same for skeletons of people without a skin, which are mostly captured motion [m]."""

PERSON = 1.7
"""What most bodies are about as large as [m], by which the unit of a file is guessed."""

UNITS = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254, "MMD's units of 8 cm": 0.08}
"""Units of files that are read as if they were metres [m]; metres are also read as if they were one of these."""

INCHES_AS_CENTIMETRES = 2.54

NEAR_PERSON = 1.3
"""Ratio to the size of a person within which the unit of a skeleton's file is believed; others are scaled to one."""


def scale_to_metres(size: float, *, captured: bool = False) -> float:
    """Factor that brings a body whose file is in another unit to the size of a person, from its size [m]; else 1.

    `captured` motion is that of a skeleton of a person without a skin.

    Examples
    --------
    >>> [scale_to_metres(size) for size in (1.7, 20.0, 170.0, 0.017)]
    [1.0, 0.08, 0.01, 100.0]
    >>> [scale_to_metres(size, captured=True) for size in (1.1, 0.42, 0.66, 0.017)]
    [1.0, 4.0, 2.54, 100.0]
    """
    if size == 0 or (SHORTEST if captured else SMALLEST) <= size <= (TALLEST if captured else LARGEST):
        return 1.0
    known = [unit if size > PERSON else 1 / unit for unit in UNITS.values()]
    if captured and SMALLEST <= size <= LARGEST:
        known += [INCHES_AS_CENTIMETRES]
    factor = min(known, key=lambda factor: abs(np.log(factor * size / PERSON)))
    if captured and not 1 / NEAR_PERSON < factor * size / PERSON < NEAR_PERSON:
        return float(f"{PERSON / size:.2g}")
    return factor


def wrong_unit(size: float, *, captured: bool = False) -> str:
    """What the file of a body of such a size [m] was made in, and read as; empty where `scale_to_metres` is 1."""
    factor = scale_to_metres(size, captured=captured)
    if factor == INCHES_AS_CENTIMETRES:
        return "inches, and was read as centimetres"
    if factor != 1.0 and not {factor, 1 / factor} & {*UNITS.values()}:
        return "another unit"
    names = [name for name, unit in UNITS.items() if factor in (unit, 1 / unit)]
    return "" if not names else names[0] if size > PERSON else f"metres, and was read as {names[0]}"
