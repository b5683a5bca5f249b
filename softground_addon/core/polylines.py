"""Timelines as polylines over time, the form in which Blender's nodes sample them.

Between two points all is linear; where something jumps, two points share a frame. The pressure of a contact, which
timelines tell by its frames and its peak, becomes points too. They are made part by part of the ground, so that only
what is kept of them takes memory everywhere at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .footprints import Footprint
from .heightfield import SparseGrid
from .histories import Histories, histories
from .ramps import TOLERANCE
from .timelines import NO_VISIT, Timelines, timelines

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Floats = NDArray[np.float32]

LOADING = 0.2
"""Part of a contact over which the pressure rises, and again falls: about that of a walking step."""


@dataclass(frozen=True)
class Polylines:
    """The state of P places over time, as R points.

    Attributes
    ----------
    point : (P,) int array
        The places.
    first : (P + 1,) int array
        Where the points of each place begin, and of the last end.
    frame : (R,) float32 array
        Frames since the first of the place, ascending.
    state : (R, 4) float32 array
        Change of the displayed height [m], displayed compression [m], last frame of the latest contact that has begun
        (`timelines.NO_VISIT` where there was none), and the pressure [Pa].
    start, end : (P,) float32 arrays
        First and last frame of each place: before, nothing has happened to it; after, all but the pressure, which is
        none, stays as it is at the last.
    error : float
        Largest error of a displayed height, at any place and frame [m].
    """

    point: Indices
    first: Indices
    frame: Floats
    state: Floats
    start: Floats
    end: Floats
    error: float

    def stretched(self, factor: float) -> Polylines:
        """The same on a clock that counts `factor` frames where this one counts 1."""
        if factor == 1.0:
            return self
        state = self.state.copy()
        contact = state[:, 2]
        contact[contact < NO_VISIT] *= factor
        frame, start, end = (factor * frames for frames in (self.frame, self.start, self.end))
        return replace(self, frame=frame, start=start, end=end, state=state)

    def end_to_end(self) -> tuple[Indices, Array]:
        """Number of the string that each place is on if they are strung together, and where on it that begins [frames].

        The gap behind each is at least a frame. Strings begin no place beyond `STRING`.
        """
        last = self.frame[self.first[1:] - 1].astype(np.float64)
        begin = np.cumsum(np.ceil(last) + 1.0) - np.ceil(last) - 1.0
        _, first, string = np.unique(begin // STRING, return_index=True, return_inverse=True)
        return string, begin - begin[first[string]]


STRING = 512.0
"""Length up to which places are strung together [frames]: in single precision it is known to a `TICK`."""

TICK = 2.0**-14
"""Of the time along a string [frames]."""

VISITS_AT_ONCE = 40_000
"""Footprints' cells over places whose histories are worked out together: about a hundred megabytes."""

PART = 1.0
"""Side of the squares by which places are put together [m]: as large as a few footprints."""


def polylines_at(
    footprints: Sequence[Footprint], x: Array, y: Array, *, blur_sigma: float, tolerance: float = TOLERANCE
) -> Polylines:
    """The record as polylines at given places; what it is given is what `histories.histories` takes."""
    sizes, error = [np.zeros(0, dtype=np.intp)], 0.0
    whole: dict[str, tuple[type, bytearray]] = {
        "point": (np.intp, bytearray()),
        **{name: (np.float32, bytearray()) for name in ("frame", "state", "start", "end")},
    }  # grown in place: put together at the end, everything would be there twice
    for places in _parts(footprints, x, y):
        part = polylines(histories(footprints, x[places], y[places], blur_sigma=blur_sigma, tolerance=tolerance))
        part = replace(part, point=places[part.point])
        for name, (_, grown) in whole.items():
            grown.extend(getattr(part, name).tobytes())
        sizes.append(np.diff(part.first))
        error = max(error, part.error)
    arrays: dict[str, NDArray[Any]] = {name: np.frombuffer(grown, kind) for name, (kind, grown) in whole.items()}
    arrays["state"] = arrays["state"].reshape(-1, 4)
    return Polylines(first=np.concatenate([[0], np.cumsum(np.concatenate(sizes))]), error=error, **arrays)


def _parts(footprints: Sequence[Footprint], x: Array, y: Array) -> list[Indices]:
    """Places (K,) in parts that lie together, of which each takes about as much to work out."""
    order = np.lexsort((np.floor(x / PART), np.floor(y / PART)))
    visits = SparseGrid(footprints[0].cell_size if footprints else PART, channels=1)
    for footprint in footprints:
        visits.write(footprint.window, visits.read(footprint.window) + 1)
    so_far = np.cumsum(visits.nearest(x[order], y[order])[0])
    return np.split(order, np.flatnonzero(np.diff(so_far // VISITS_AT_ONCE)) + 1)


def polylines(over_time: Histories) -> Polylines:
    """The histories as polylines.

    Examples
    --------
    A contact from frame 2 to 12 on ground that does not move:

    >>> from softground_addon.core.histories import Visits
    >>> from softground_addon.core.ramps import Ramps
    >>> visits = Visits(np.array([7]), np.array([2.0]), np.array([12.0]), np.array([5e4]))
    >>> lines = polylines(Histories(Ramps.joined([], 2), visits, 0.0))
    >>> lines.start.tolist(), lines.frame.tolist(), lines.state[:, 3].tolist()
    ([2.0], [0.0, 2.0, 8.0, 10.0], [0.0, 50000.0, 50000.0, 0.0])
    """
    table = timelines(over_time)
    place = np.repeat(np.arange(len(table.point)), np.diff(table.first))
    row, frame = _with_turns(table, place)
    jump = np.flatnonzero(table.frame == table.visit_start)
    jump = jump[np.isin(jump, table.first, invert=True)]
    # A point on either side of each jump: that before belongs to the contact of the row before.
    points = np.concatenate([jump - 1, row])
    when = np.concatenate([table.frame[jump], frame])
    after = np.repeat([0, 1], [len(jump), len(row)])
    order = np.lexsort((after, when, place[points]))
    points, when = points[order], when[order]
    size = np.bincount(place[points], minlength=len(table.point))
    start = table.frame[table.first[:-1]]
    return Polylines(
        point=table.point,
        first=np.concatenate([[0], np.cumsum(size)]),
        frame=(when - np.repeat(start, size)).astype(np.float32),
        state=_states(table, points, when),
        start=start.astype(np.float32),
        end=table.frame[table.first[1:] - 1].astype(np.float32),
        error=over_time.error,
    )


def _with_turns(table: Timelines, place: Indices) -> tuple[Indices, Array]:
    """The rows and frames of all points but those before jumps: the table's own, and where the pressure turns."""
    contact = np.flatnonzero((table.frame == table.visit_start) & (table.visit_end > table.visit_start))
    length = table.visit_end[contact] - table.visit_start[contact]
    turns = [table.visit_start[contact] + part * length for part in (LOADING, 1.0 - LOADING)]
    own = np.arange(len(place))
    when = np.concatenate([table.frame, *turns])
    source = np.concatenate([own, contact, contact])
    order = np.lexsort((np.arange(len(when)) >= len(own), when, place[source]))
    row = np.maximum.accumulate(np.where(order < len(own), order, -1))
    # A turn counts while its contact is the latest, and where there is no row already.
    kept = (order < len(own)) | (
        (table.visit_start[row] == table.visit_start[source[order]]) & (table.frame[row] < when[order])
    )
    return row[kept], when[order][kept]


def _states(table: Timelines, row: Indices, frame: Array) -> Floats:
    """The states at given frames, each between a row and the next, (N, 4)."""
    following = np.minimum(row + 1, max(len(table.frame) - 1, 0))
    run = table.frame[following] - table.frame[row]
    since = frame - table.frame[row]
    share = np.divide(since, run, out=np.zeros(len(row)), where=since > 0)
    begin, end = table.visit_start[row], table.visit_end[row]
    passed = np.divide(frame - begin, end - begin, out=np.zeros(len(row)), where=end > begin)
    loaded = np.clip(np.minimum(passed, 1.0 - passed) / LOADING, 0.0, 1.0)
    return np.stack(
        [
            *(values[row] + share * (values[following] - values[row]) for values in table.movement.T),
            end,
            loaded * table.pressure[row],
        ],
        axis=-1,
    ).astype(np.float32)
