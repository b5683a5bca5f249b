"""Limits of what can be baked: in memory, in the time that is allowed, with cells that show a foot."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..numerics.arrays import Array
from . import estimate
from .tracks import tracks

BYTES_PER_VERTEX = 900.0
"""What a vertex of the display mesh that moves takes [bytes], on figures of 2 cm to 7 m with cells of 0.4 to 20 mm."""

BYTES_PER_CELL_LAID_OUT = 85.0
"""What a cell around a sole takes at each step of the simulation that is laid out [bytes]; of these there are at most
..."""

CELLS_AT_ONCE, STEPS_AT_ONCE = 4e6, 128
"""... so many together, and steps, as `pressing.contact_layout` has it."""

SECONDS_PER_CELL_LAID_OUT = 7e-8
"""What a cell around a sole takes in each step of the simulation [s]: 40 to 110 ns, standing or walking, ..."""

SECONDS_PER_CELL = 1.5e-5
"""... what a cell that changes takes [s], ..."""

SECONDS_PER_VERTEX = 1.5e-5
"""... and what a vertex takes to write [s], and over the square of their distance ..."""

SECONDS_OF_FINE_VERTICES = 1.5e-11
"""... [s m²], as the display blur reaches over more of them."""

CARVED = 6.0
"""Cells that change where legs carve deep ground, over those of prints: the sample walk's in 20 to 50 cm of snow."""

BYTES_AT_LEAST, SECONDS_AT_LEAST = 10e6, 0.6
"""What a bake of any size takes: [bytes] and [s]."""

LARGEST_SPREAD = 4.0
"""Cells around a sole that slides are laid out in parts of so many times its own box."""

BYTES_PER_FRAME = 60e3
"""What a frame of a character takes from reading to playback [bytes], as measured on a walk of 100,000 frames."""

FRAMES_PER_SECOND = 100.0
"""Frames of a character that are baked in a second, about."""

CLOSE_UP_SPACING = 0.0025
"""Distance of the vertices of a trail that is seen from close by [m], about: grooves of a tread are 4 mm wide."""

CELLS_ALONG_SOLE = 10
"""Cells along a sole that show its outline."""

USABLE = 0.8
"""Share of the machine's memory that a bake may take."""


@dataclass(frozen=True)
class Fineness:
    """Fineness with which a ground is pressed and shown.

    Attributes
    ----------
    cell_size : float
        [m]
    rim_reach : float
        Of its material [m].
    relief : str
        As in `settings.BakeSettings`.
    most_vertices : int
        That a close-up may have.
    is_carved : bool
        True if legs carve deep ground.
    """

    cell_size: float
    rim_reach: float
    relief: str = "OFF"
    most_vertices: int = 0
    is_carved: bool = False

    @property
    def spacing(self) -> float:
        """Distance of the vertices along a trail [m]: that of the cells, in a close-up halved some times."""
        close_up = self.relief == "CLOSE_UP"
        halvings = max(0, round(math.log2(self.cell_size / CLOSE_UP_SPACING))) if close_up else 0
        return self.cell_size / 2.0**halvings


@dataclass(frozen=True)
class Coverage:
    """What soles cover on the ground, with each print counted: what a bake takes follows from it at any cell size.

    Attributes
    ----------
    area : float
        [m²]
    edge : float
        Length around it [m].
    boxes : (K, 2) float array
        Sides of the box in which each print is laid out [m].
    steps : (K,) int array
        Steps of the simulation in each.
    """

    area: float
    edge: float
    boxes: Array
    steps: NDArray[np.intp]

    def cells(self, cell_size: float, rim_reach: float) -> float:
        """Cells that change: those that soles cover, and around them those that the rim reaches."""
        reach = max(rim_reach, cell_size)
        return float(self.area + self.edge * reach + len(self.steps) * np.pi * reach**2) / cell_size**2

    def vertices(self, fine: Fineness) -> float:
        """Vertices that show them, however many there may be."""
        return self.cells(fine.spacing, fine.rim_reach)

    def laid_out(self, cell_size: float, rim_reach: float) -> Array:
        """Cells of the window of each print, (K,)."""
        sides: Array = self.boxes + 2 * max(rim_reach, cell_size)
        return sides.prod(axis=1) / cell_size**2

    def bake_costs(self, fine: Fineness) -> tuple[float, float]:
        """Memory [bytes] and time [s] that a bake takes, within a factor of two on a machine of 2026."""
        cells, laid_out = (count(fine.cell_size, fine.rim_reach) for count in (self.cells, self.laid_out))
        carved = CARVED if fine.is_carved else 1.0
        cells, vertices = carved * cells, carved * min(self.vertices(fine), max(cells, fine.most_vertices))
        at_once = np.minimum(laid_out * np.minimum(self.steps, STEPS_AT_ONCE), CELLS_AT_ONCE).max(initial=0.0)
        memory = max(at_once * BYTES_PER_CELL_LAID_OUT, vertices * BYTES_PER_VERTEX)
        simulating = laid_out @ self.steps * SECONDS_PER_CELL_LAID_OUT + cells * SECONDS_PER_CELL
        writing = vertices * (SECONDS_PER_VERTEX + SECONDS_OF_FINE_VERTICES / fine.spacing**2)
        return BYTES_AT_LEAST + float(memory), SECONDS_AT_LEAST + float(simulating + writing)


def coverage_of(loads: Sequence[estimate.CharacterLoads]) -> Coverage:
    """Coverage of the soles of all characters."""
    area = edge = 0.0
    boxes, steps = [], []
    for character in loads:
        for index, moved in enumerate(character.motion.soles):
            sole, middles = moved.sole, moved.landmark_positions()[..., :2].mean(axis=1)
            half = np.ptp(sole.outline, axis=0) / 2
            around = float(np.linalg.norm(sole.outline - np.roll(sole.outline, 1, axis=0), axis=1).sum())
            around = min(around, 2 * (sole.length + sole.breadth))  # however jagged the outline is
            for print_of in tracks(character, index):
                travel = float(np.linalg.norm(np.ptp(middles[print_of], axis=0)))
                area += sole.area + travel * sole.breadth
                edge += around + 2 * travel
                reached = np.abs(moved.transforms[print_of, 0, :2, :2]) @ half
                alone, path = 2 * reached.max(axis=0), middles[print_of]
                along = np.ptp(np.concatenate([path - reached, path + reached]), axis=0)
                boxes.append(np.minimum(along, alone * LARGEST_SPREAD**0.5))
                steps.append(len(path))
    return Coverage(area, edge, np.reshape(boxes, (-1, 2)), np.array(steps, np.intp))


def check_cell_size(
    loads: Sequence[estimate.CharacterLoads],
    fine: Fineness,
    longest: float,
    available: float | None = None,
) -> None:
    """Raise InputError if the bake would not fit into memory or time, or a sole into a cell; names a size that works.

    Parameters
    ----------
    longest : float
        What the bake may take [s].
    available : float, optional
        Memory [bytes]; that of the machine by default, where the system tells it.
    """
    cell_size = fine.cell_size
    for character in loads:
        length = max(sole.sole.length for sole in character.motion.soles)
        if length < cell_size:
            raise InputError(
                f"The soles of '{character.motion.name}' are {length * 100:.3g} cm long, smaller than a cell of "
                f"{cell_size * 100:g} cm: set a cell size of at most {length / CELLS_ALONG_SOLE * 100:.2g} cm, or "
                "correct the scale of the character or of the scene's units.",
                "cell_larger_than_sole",
                character=character.motion.name,
                sole=length,
                cell_size=cell_size,
            )
    available = machine_memory() if available is None else available
    coverage = coverage_of(loads)

    def taken(size: float) -> tuple[float, float]:
        return coverage.bake_costs(replace(fine, cell_size=size))

    too_much = _too_much(*taken(cell_size), longest, available)
    if not too_much:
        return
    sizes = cell_size * 1.05 ** np.arange(300)
    fits = [
        size for size in sizes[sizes < _shortest_of_largest(loads)] if not _too_much(*taken(size), longest, available)
    ]
    larger = f"set a cell size of at least {1.05 * fits[0] * 100:.2g} cm, or " if fits else ""  # it is rounded
    names = ", ".join(f"'{character.motion.name}'" for character in loads)
    message = f"Cells of {cell_size * 100:g} cm would take about {_amount(*taken(cell_size))} for the steps of {names}"
    raise _refused(message, too_much, f"{larger}bake fewer frames.", *taken(cell_size))


def _shortest_of_largest(loads: Sequence[estimate.CharacterLoads]) -> float:
    """Length of the longest sole of the smallest character: cells are to be smaller [m]."""
    return min(max(sole.sole.length for sole in character.motion.soles) for character in loads)


def check_frames(first: int, last: int, characters: int, longest: float, available: float | None = None) -> None:
    """Raise InputError if so many frames of so many characters do not fit into memory or time; says what they take.

    Parameters
    ----------
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
        message = f"The {count:,} frames from {first} to {last} would take about {_amount(needed, time)}"
        remedy = "set the first and the last frame of the bake, and look for a key that lies far away from the others."
        raise _refused(message, too_much, remedy, needed, time)


def _refused(message: str, too_much: str, remedy: str, needed: float, time: float) -> InputError:
    """Error about what takes too much memory [bytes] or time [s]."""
    said, is_long = f"{message}, and {too_much}", too_much.endswith("allowed")
    return InputError(said, "too_long" if is_long else "too_much_memory", remedy=remedy, memory=needed, time=time)


def _too_much(needed: float, time: float, longest: float, available: float | None) -> str:
    """Limit that memory [bytes] or time [s] are beyond; empty where neither is."""
    if available is not None and needed > USABLE * available:
        return f"this machine has {available / 1e9:,.0f} GB"
    if time > longest:
        return f"{duration(longest)} are allowed"
    return ""


def _amount(needed: float, time: float) -> str:
    return f"{needed / 1e9:,.{int(needed < 1e10)}f} GB of memory and {duration(time)}"


def duration(time: float) -> str:
    """A time [s] as it is said."""
    if time < 60:
        return f"{np.ceil(time):.0f} seconds"
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
        for folder in {root, inner, *(parent for parent in inner.parents if root in parent.parents)}:
            try:
                yield float((folder / name).read_text())
            except (OSError, ValueError):  # "max"
                continue
