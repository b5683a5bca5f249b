"""All that happens to each place of the ground in one table: its rows are in the order of time.

Ramps and contacts of a place overlap, and their number depends on how often it is stepped on. Put together they
are a curve per place: its state at a time lies between two rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Indices
from ..numerics.intervals import in_order
from .ramps import QUANTUM, Ramps
from .vertex_histories import VertexHistories

NO_CONTACT = 1e9
"""Frame of contacts that never come."""


@dataclass(frozen=True)
class KeyframeTables:
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
    movement : (R, 2) float array
        Change of the displayed height, and displayed compression [m].
    contact_start, contact_end, pressure : (R,) float arrays
        Frames between which the latest contact that has begun at the row lasts, and its pressure [Pa];
        `NO_CONTACT` where there was none.
    """

    point: Indices
    first: Indices
    frame: Array
    movement: Array
    contact_start: Array
    contact_end: Array
    pressure: Array


def keyframe_tables(over_time: VertexHistories) -> KeyframeTables:
    """The vertex histories as one table.

    Values are rounded to `ramps.QUANTUM`, which those at rest are multiples of.

    Examples
    --------
    Two overlapping ramps of one place make four rows:

    >>> from softground_addon.core.playback.vertex_histories import PointContacts
    >>> sinks = np.array([[-0.5, 0.5], [-0.25, 0.25]])
    >>> ramps = Ramps(np.array([7, 7]), np.array([2.0, 3.0]), np.array([4.0, 5.0]), sinks)
    >>> nobody = PointContacts(np.zeros(0, dtype=np.intp), *np.zeros((3, 0)))
    >>> table = keyframe_tables(VertexHistories(ramps, nobody, 0.0))
    >>> table.point, table.frame, table.movement[:, 0]
    (array([7]), array([2., 3., 4., 5.]), array([ 0.   , -0.25 , -0.625, -0.75 ]))
    """
    ramps, contacts = over_time.movement, over_time.contacts
    point = np.concatenate([ramps.point, ramps.point, contacts.point, contacts.point])
    frame = np.concatenate([ramps.start, ramps.end, contacts.start, contacts.end])
    order = in_order(point, frame)
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(point[order]) != 0) | (np.diff(frame[order]) != 0)
    row = np.empty(len(order), dtype=np.intp)
    row[order] = np.cumsum(new) - 1
    point, frame = point[order][new], frame[order][new]
    begin, end, touch = np.split(row, np.cumsum([len(ramps.point)] * 2 + [len(contacts.point)]))[:3]
    first = np.append(np.flatnonzero(np.diff(point, prepend=-1)), len(point))
    places = point[first[:-1]]
    contact = _latest(contacts.start, contacts.end, contacts.pressure, touch, first)
    return KeyframeTables(places, first, frame, _curve(ramps, begin, end, frame, first), *contact)


def _curve(ramps: Ramps, start: Indices, end: Indices, frame: Array, first: Indices) -> Array:
    """Sums of the ramps at each row, (R, C); they begin and end at given rows."""
    rows = len(frame)
    run = np.diff(frame, append=0.0)
    run[first[1:] - 1] = 0.0
    values = np.zeros((rows, ramps.change.shape[1]))
    for channel, change in enumerate(ramps.change.T):
        slope = change / (ramps.end - ramps.start)
        bend = np.bincount(start, slope, minlength=rows) - np.bincount(end, slope, minlength=rows)
        values[1:, channel] = np.cumsum(np.cumsum(bend) * run)[:-1]
    values -= np.repeat(values[first[:-1]], np.diff(first), axis=0)
    rounded: Array = np.round(values / QUANTUM) * QUANTUM
    return rounded


def _latest(start: Array, end: Array, pressure: Array, row: Indices, first: Indices) -> tuple[Array, Array, Array]:
    """Start, end and pressure of the contact that began last at each row; contacts begin at given rows, in order."""
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
    result = np.full((3, rows), NO_CONTACT)
    result[2] = 0.0
    result[:, known] = np.stack([start, latest, pressure])[:, number[known]]
    return result[0], result[1], result[2]
