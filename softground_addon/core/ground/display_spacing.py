"""How finely pressed ground is shown."""

from __future__ import annotations

import math

CLOSE_UP_SPACING = 0.0025
"""Distance of the vertices of a trail that is seen from close by [m], about: grooves of a tread are 4 mm wide."""


def spacing_of(cell_size: float, relief: str) -> float:
    """Distance of the vertices along a trail that show some relief [m]: that of the cells, or halved some times."""
    halvings = max(0, round(math.log2(cell_size / CLOSE_UP_SPACING))) if relief == "CLOSE_UP" else 0
    return cell_size / 2.0**halvings
