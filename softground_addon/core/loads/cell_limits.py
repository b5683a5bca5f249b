"""Whether a cell size suits a shot: not so fine that no memory holds it, nor so coarse that it swallows a foot."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..numerics.intervals import runs
from .estimate import CharacterLoads

BYTES_PER_CELL = 1000.0
"""What a cell under a print takes from simulation to playback [bytes], as measured on walks at 1 and 0.5 mm."""

CELLS_ALONG_SOLE = 10
"""Cells along a sole that show its outline."""

USABLE = 0.8
"""Share of the machine's memory that a bake may take."""


def pressed_area(loads: Sequence[CharacterLoads]) -> float:
    """Area that the soles of all characters cover on the ground, with each step counted [m²]."""
    area = 0.0
    for character in loads:
        for index, sole in enumerate(character.motion.soles):
            touching = character.contacts.touching[:, index]
            steps = len(runs(touching)[0])
            paths = sole.landmark_positions()[..., :2].mean(axis=1)
            travel = np.linalg.norm(np.diff(paths, axis=0), axis=1)[touching[1:]].sum()
            area += steps * sole.sole.area + float(travel) * float(np.ptp(sole.sole.outline[:, 1]))
    return area


def check_cell_size(loads: Sequence[CharacterLoads], cell_size: float, available: float | None = None) -> None:
    """Raise InputError if the bake would not fit into memory, or a sole into a cell; names a cell size that works.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    cell_size : float
        [m]
    available : float, optional
        Memory [bytes]; that of the machine by default, where the system tells it.
    """
    for character in loads:
        length = max(sole.sole.length for sole in character.motion.soles)
        if length < cell_size:
            raise InputError(
                f"The soles of '{character.motion.name}' are {length * 1e3:.3g} mm long, smaller than a cell of "
                f"{cell_size * 1e3:g} mm: set a cell size of at most {length / CELLS_ALONG_SOLE * 1e3:.2g} mm, or "
                "correct the scale of the character or of the scene's units."
            )
    available = machine_memory() if available is None else available
    needed = pressed_area(loads) / cell_size**2 * BYTES_PER_CELL
    if available is None or needed <= USABLE * available:
        return
    names = ", ".join(f"'{character.motion.name}'" for character in loads)
    fits = cell_size * np.sqrt(needed / (USABLE * available)) * 1.05
    raise InputError(
        f"Cells of {cell_size * 1e3:g} mm would take about {needed / 1e9:,.0f} GB of memory for the steps of {names}, "
        f"and this machine has {available / 1e9:,.0f} GB: set a cell size of at least {fits * 1e3:.2g} mm, or bake "
        "fewer frames."
    )


def machine_memory() -> float | None:
    """Memory of this machine [bytes]; None where the system does not tell."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return None
