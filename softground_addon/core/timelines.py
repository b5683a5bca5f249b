"""All that happens to each place of the ground in one table: its rows are in the order of time.

Ramps and visits of a place overlap, and how many there are depends on how often it is stepped on. Put together they
are a polyline per place: what it is like at a time lies between two rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .histories import Histories
from .ramps import QUANTUM, Ramps

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

NO_VISIT = 1e9
"""Frame of visits that never come."""


@dataclass(frozen=True)
class Timelines:
    """The ground over time at some places, as rows of a table; between two rows all is linear.

    Before the first row of a place nothing has happened to it, after its last nothing does.

    Attributes
    ----------
    point : (P,) int array
        The places, ascending.
    first : (P + 1,) int array
        Where the rows of each begin, and of the last end.
    frame : (R,) float array
        Ascending within each place.
    height, compression : (R,) float arrays
        Change of the displayed height, and displayed compression [m].
    visit_start, visit_end, pressure : (R,) float arrays
        Frames between which the latest contact that has begun at the row lasts, and its pressure [Pa];
        `NO_VISIT` where there was none.
    """

    point: Indices
    first: Indices
    frame: Array
    height: Array
    compression: Array
    visit_start: Array
    visit_end: Array
    pressure: Array


def timelines(over_time: Histories) -> Timelines:
    """The histories as one table.

    Values are rounded to `ramps.QUANTUM`, which those at rest are multiples of.

    Examples
    --------
    Two overlapping ramps of one place make four rows:

    >>> from softground_addon.core.histories import Visits
    >>> ramps = Ramps(np.array([7, 7]), np.array([2.0, 3.0]), np.array([4.0, 5.0]), np.array([-0.5, -0.25]))
    >>> still = Ramps.joined([])
    >>> nobody = Visits(np.zeros(0, dtype=np.intp), *np.zeros((3, 0)))
    >>> table = timelines(Histories(ramps, still, nobody, 0.0))
    >>> table.point, table.frame, table.height
    (array([7]), array([2., 3., 4., 5.]), array([ 0.   , -0.25 , -0.625, -0.75 ]))
    """
    heights, compression, visits = over_time.heights, over_time.compression, over_time.visits
    point = np.concatenate([heights.point, heights.point, compression.point, compression.point, *[visits.point] * 2])
    frame = np.concatenate([heights.start, heights.end, compression.start, compression.end, visits.start, visits.end])
    order = np.lexsort((frame, point))
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(point[order]) != 0) | (np.diff(frame[order]) != 0)
    row = np.empty(len(order), dtype=np.intp)
    row[order] = np.cumsum(new) - 1
    point, frame = point[order][new], frame[order][new]
    sizes = [len(heights.point)] * 2 + [len(compression.point)] * 2 + [len(visits.point)]
    parts = np.split(row, np.cumsum(sizes))
    places, first = np.unique(point, return_index=True)
    first = np.append(first, len(point))
    start, end, pressure = _latest(visits.start, visits.end, visits.pressure, parts[4], first)
    return Timelines(
        places,
        first,
        frame,
        _polyline(heights, parts[0], parts[1], frame, first),
        _polyline(compression, parts[2], parts[3], frame, first),
        start,
        end,
        pressure,
    )


def _polyline(ramps: Ramps, start: Indices, end: Indices, frame: Array, first: Indices) -> Array:
    """Sum of the ramps at each row; they begin and end at given rows."""
    slope = ramps.change / (ramps.end - ramps.start)
    rows = len(frame)
    bend = np.bincount(start, slope, minlength=rows) - np.bincount(end, slope, minlength=rows)
    run = np.diff(frame, append=0.0)
    run[first[1:] - 1] = 0.0
    value = np.concatenate([[0.0], np.cumsum(np.cumsum(bend) * run)])[:-1]
    value -= np.repeat(value[first[:-1]], np.diff(first))
    rounded: Array = np.round(value / QUANTUM) * QUANTUM
    return rounded


def _latest(start: Array, end: Array, pressure: Array, row: Indices, first: Indices) -> tuple[Array, Array, Array]:
    """Start, end and pressure of the visit that has begun last at each row; visits begin at given rows, in order."""
    rows = int(first[-1])
    number = np.full(rows, -1)
    number[row] = np.arange(len(row))
    number = np.maximum.accumulate(number)
    place = np.repeat(np.arange(len(first) - 1), np.diff(first))
    known = number >= 0
    known[known] = place[row[number[known]]] == place[known]
    # Soles may leave in another order than they came: an end is the latest so far at its place.
    ends = np.unique(end)
    rank = np.searchsorted(ends, end) + place[row] * len(ends)
    latest = ends[np.maximum.accumulate(rank) - place[row] * len(ends)]
    result = np.full((3, rows), NO_VISIT)
    result[2] = 0.0
    result[:, known] = np.stack([start, latest, pressure])[:, number[known]]
    return result[0], result[1], result[2]
