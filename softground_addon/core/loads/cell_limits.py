"""Whether a shot can be baked: in memory, in the time that is allowed, with cells that show a foot."""

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

SECONDS_PER_CELL = 5e-5
"""What it takes to write [s], and over the square of the cell size ..."""

SECONDS_OF_FINE_CELLS = 1.5e-11
"""... [s m²]: 61, 65, 67 and 106 µs on a walk with cells of 4, 2, 1 and 0.5 mm, 50 to 90 on others, ..."""

SECONDS_PER_CELL_HELD = 5.5e-5
"""... and what it takes to simulate, for each second that a sole is on it [s/s]: 45 to 70 µs, standing or walking."""

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


def bake_time(loads: Sequence[CharacterLoads], cell_size: float) -> float:
    """What a bake with cells of that size [m] takes [s], within a factor of two on a machine of 2026."""
    held = 0.0
    for character in loads:
        areas = [sole.sole.area for sole in character.motion.soles]
        held += float(character.contacts.touching.sum(axis=0) @ areas) * character.motion.time_step
    writing = SECONDS_PER_CELL + SECONDS_OF_FINE_CELLS / cell_size**2
    return (pressed_area(loads) * writing + held * SECONDS_PER_CELL_HELD) / cell_size**2


def bake_memory(loads: Sequence[CharacterLoads], cell_size: float) -> float:
    """What it takes of memory [bytes]."""
    return pressed_area(loads) / cell_size**2 * BYTES_PER_CELL


def check_cell_size(
    loads: Sequence[CharacterLoads], cell_size: float, longest: float, available: float | None = None
) -> None:
    """Raise InputError if the bake would not fit into memory or time, or a sole into a cell; names a size that works.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    cell_size : float
        [m]
    longest : float
        What the bake may take [s].
    available : float, optional
        Memory [bytes]; that of the machine by default, where the system tells it.
    """
    for character in loads:
        length = max(sole.sole.length for sole in character.motion.soles)
        if length < cell_size:
            raise InputError(
                f"The soles of '{character.motion.name}' are {length * 100:.3g} cm long, smaller than a cell of "
                f"{cell_size * 100:g} cm: set a cell size of at most {length / CELLS_ALONG_SOLE * 100:.2g} cm, or "
                "correct the scale of the character or of the scene's units."
            )
    available = machine_memory() if available is None else available
    needed, time = bake_memory(loads, cell_size), bake_time(loads, cell_size)
    too_much = _too_much(needed, time, longest, available)
    if not too_much:
        return
    sizes = cell_size * 1.05 ** np.arange(300)
    fits = [
        size
        for size in sizes[sizes < _shortest_of_largest(loads)]
        if not _too_much(bake_memory(loads, size), bake_time(loads, size), longest, available)
    ]
    remedy = f"set a cell size of at least {1.05 * fits[0] * 100:.2g} cm, or " if fits else ""  # it is rounded
    names = ", ".join(f"'{character.motion.name}'" for character in loads)
    raise InputError(
        f"Cells of {cell_size * 100:g} cm would take about {_amount(needed, time)} for the steps of {names}, and "
        f"{too_much}: {remedy}bake fewer frames."
    )


def _shortest_of_largest(loads: Sequence[CharacterLoads]) -> float:
    """Length of the longest sole of the smallest character: cells are to be smaller [m]."""
    return min(max(sole.sole.length for sole in character.motion.soles) for character in loads)


def check_frames(first: int, last: int, characters: int, longest: float, available: float | None = None) -> None:
    """Raise InputError if so many frames of so many characters do not fit into memory or time; says what they take.

    Parameters
    ----------
    first, last : int
    characters : int
    longest : float
        What the bake may take [s].
    available : float, optional
        Memory [bytes]; that of the machine by default, where the system tells it.
    """
    available = machine_memory() if available is None else available
    count = last - first + 1
    needed, time = count * characters * BYTES_PER_FRAME, count * characters / FRAMES_PER_SECOND
    too_much = _too_much(needed, time, longest, available)
    if too_much:
        raise InputError(
            f"The {count:,} frames from {first} to {last} would take about {_amount(needed, time)}, and {too_much}: "
            "set the first and the last frame of the bake, and look for a key that lies far away from the others."
        )


def _too_much(needed: float, time: float, longest: float, available: float | None) -> str:
    """Which limit memory [bytes] or time [s] are beyond; empty where neither is."""
    if available is not None and needed > USABLE * available:
        return f"this machine has {available / 1e9:,.0f} GB"
    if time > longest:
        return f"{_duration(longest)} are allowed (Time Limit in Advanced > Mesh and Look, or --set longest_bake=N)"
    return ""


def _amount(needed: float, time: float) -> str:
    return f"{needed / 1e9:,.{int(needed < 1e10)}f} GB of memory and {_duration(time)}"


def _duration(time: float) -> str:
    return f"{np.ceil(time / 60):,.0f} minutes" if time < 7200 else f"{time / 3600:,.0f} hours"


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
