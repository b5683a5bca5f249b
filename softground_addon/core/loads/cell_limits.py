"""Whether a shot can be baked: neither cells nor frames that no memory holds, nor cells that swallow a foot."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..numerics.intervals import runs
from .estimate import CharacterLoads

BYTES_PER_CELL = 1000.0
"""What a cell under a print takes from simulation to playback [bytes], as measured on walks at 1 and 0.5 mm."""

SECONDS_PER_CELL = 3e-5
"""What it takes to simulate [s], about: as measured on walks at 1 and 0.5 mm."""

BYTES_PER_FRAME = 60e3
"""What a frame of a character takes from reading to playback [bytes], as measured on a walk of 100,000 frames."""

FRAMES_PER_SECOND = 100.0
"""Frames of a character that are baked in a second, about."""

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
    minutes = needed / BYTES_PER_CELL * SECONDS_PER_CELL / 60
    raise InputError(
        f"Cells of {cell_size * 1e3:g} mm would take about {needed / 1e9:,.0f} GB of memory and {minutes:,.0f} minutes "
        f"for the steps of {names}, and this machine has {available / 1e9:,.0f} GB: set a cell size of at least "
        f"{fits * 1e3:.2g} mm, or bake fewer frames."
    )


def check_frames(first: int, last: int, characters: int, available: float | None = None) -> None:
    """Raise InputError if so many frames of so many characters would not fit into memory; says what they would take.

    Parameters
    ----------
    first, last : int
    characters : int
    available : float, optional
        Memory [bytes]; that of the machine by default, where the system tells it.
    """
    available = machine_memory() if available is None else available
    count = last - first + 1
    needed = count * characters * BYTES_PER_FRAME
    if available is None or needed <= USABLE * available:
        return
    hours = count * characters / FRAMES_PER_SECOND / 3600
    raise InputError(
        f"The {count:,} frames from {first} to {last} would take about {needed / 1e9:,.0f} GB of memory and "
        f"{hours:,.0f} hours, and this machine has {available / 1e9:,.0f} GB: set the first and the last frame of the "
        "bake, and look for a key that lies far away from the others."
    )


def machine_memory() -> float | None:
    """Memory that this process may take [bytes]: of the machine, or less in a container; None where nobody tells."""
    limits = list(_container_limits())
    with suppress(AttributeError, ValueError, OSError):
        limits.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    return min(limits, default=None)


def _container_limits(system: Path = Path("/")) -> Iterator[float]:
    """Limits of Linux's control groups, of version 1 or 2, around this process [bytes]; none where there are none."""
    try:
        groups = (system / "proc/self/cgroup").read_text().splitlines()
    except (OSError, UnicodeDecodeError):
        return
    for group in groups:
        _, controllers, path = group.split(":", 2)
        if controllers == "":
            root, name = system / "sys/fs/cgroup", "memory.max"
        elif "memory" in controllers.split(","):
            root, name = system / "sys/fs/cgroup/memory", "memory.limit_in_bytes"
        else:
            continue
        inner = root / path.lstrip("/")  # a container may see its own group as the root
        for folder in {root, inner, *(one for one in inner.parents if root in one.parents)}:
            try:
                yield float((folder / name).read_text())
            except (OSError, ValueError):  # "max"
                continue
