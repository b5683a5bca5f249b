"""What feet brush on their way from each print to the next, and what the legs above them part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..ground.sparse_grid import Window
from ..numerics.arrays import Array
from ..record.footprints import Footprint
from .sole_passes import BESIDE_BEND, COLUMNS, FRAME_RATE

Indices = NDArray[np.int64]

SWING_HEIGHT = 0.04
"""Height at which a foot passes the ground on its way to the next step [m]."""
PARTED = 0.1
"""How far beside the way of a foot the leg above it parts what is taller than that [m]."""
PASSING_SPEED = 3.0
"""Speed at which it comes over a place and leaves it again [m/s]."""
FASTEST, LONGEST = 4.0, 3.0
"""Speed and length of a swing, beyond which a foot is far above the ground [m/s, m]."""


def swings(steps: Sequence[Footprint], side: float) -> Iterator[tuple[Indices, dict[str, Array]]]:
    """What soles brush on their way from each print to their next one, as `sole_passes` has it."""
    latest: dict[tuple[str, str], Footprint] = {}
    for step in steps:
        before = latest.get((step.character, step.sole))
        latest[step.character, step.sole] = step
        if before is None or step.start_frame <= before.end_frame:
            continue
        way = step.position[:2] - before.position[:2]
        length, frames = float(np.hypot(*way)), step.start_frame - before.end_frame
        second = _frames_per_second(step)
        if not side < length < min(LONGEST, FASTEST * frames / second):
            continue
        ahead = way / length
        half_length, half_width = _half_sizes(before, ahead)
        ends = np.array((before.position[:2], step.position[:2]))
        reach = half_width + PARTED
        window = Window.around(ends.min(axis=0) - reach, ends.max(axis=0) + reach, side)
        place = np.stack([values.ravel() for values in np.meshgrid(*window.centres(side))], axis=1)
        along, across = (place - ends[0]) @ ahead, (place - ends[0]) @ (-ahead[1], ahead[0])
        passed = np.flatnonzero((along > 0.0) & (along < length) & (np.abs(across) < reach))
        gap = np.maximum(np.abs(across[passed]) - half_width, 0.0)[:, None]
        aside = np.sign(across[passed])[:, None] * (-ahead[1], ahead[0])
        share = np.linspace(0.0, 1.0, 65)
        travel = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)  # of minimum jerk
        when = [
            before.end_frame + frames * np.interp((along[passed] + part) / length, travel, share)
            for part in (-half_length, half_length)
        ]
        constants = {"down": PASSING_SPEED / second, "up": PASSING_SPEED / second, "above": SWING_HEIGHT}
        table = {name: np.full(len(passed), constants.get(name, 0.0)) for name in COLUMNS}
        table |= {"start": when[0], "end": when[1], "settled": when[1]}
        table["reach"] = np.where(gap > 0, BESIDE_BEND * (1.0 - gap / PARTED), 1.0)[:, 0]
        table["x"], table["y"] = np.where(gap > 0, aside, ahead).T
        row, column = np.divmod(passed, window.columns)
        yield np.stack([column + window.column, row + window.row], axis=1).astype(np.int64), table


def _half_sizes(step: Footprint, ahead: Array) -> tuple[float, float]:
    """Half of a print's length and width along and across a direction [m]."""
    x, y = (values.ravel()[step.contact_cells] for values in np.meshgrid(*step.window.centres(step.cell_size)))
    return 0.5 * float(np.ptp(x * ahead[0] + y * ahead[1])), 0.5 * float(np.ptp(y * ahead[0] - x * ahead[1]))


def _frames_per_second(step: Footprint) -> float:
    by = step.pressed_by
    return step.load_spacing / by.time_step if by else FRAME_RATE
