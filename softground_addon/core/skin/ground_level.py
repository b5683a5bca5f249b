"""The ground that a character rests on, and the speed that an in-place cycle lacks, found together."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from .bearing import TOUCH
from .skin_motion import PartTracks

REACH = 0.05
"""Largest height of resting skin over the lowest skin, in body heights."""
BIN = 0.004
"""Step of the levels that are tried, in body heights."""
OFTEN = 20.0
"""Percentile of the lowest calm skin at which some is on the ground: a runner has a foot there a third of the time."""
AROUND = 0.5
"""Time to either side over which that is looked for [s]: a stride of a run."""
WORTH = 0.3
"""Membership of a level beyond which a part counts as resting on it."""
FURTHER_PART = 0.15
"""Addition of a further part that rests at a level to a moment's vote for it."""
SUNK = 0.08
"""Feet dip through the ground by up to this in cycles as they are sold: skin that rests deeper below a level speaks
against it, in body heights."""
AGAINST = 0.35
"""Deduction for a moment of such rest."""
AS_LONG = 2 / 3
"""Share of the votes for a level that a part has at a higher one, while nothing rests at the lower, to raise it."""
SAME_WAY = 0.15
"""Velocities that differ by less are one, in H/s, or over the speed itself."""
STANDS = 0.15
"""A ground that moves slower than this stands, in H/s."""
STANDING_SHARE = 0.8
"""A ground that stands wins with this share of the votes of one that moves."""
GROUNDED_SHARE = 0.8
"""A velocity of low skin wins with this share of the votes that the ground has with that of all skin."""
WORLD_FLOOR = 2.0
"""Weight of the world's floor, at height 0, where two parts or more stand on it as the shot begins."""
MOST_VOTES = 500
"""Most moments of parts that vote."""
_SLICE = 200_000
"""Votes, times levels, that are counted in one slice."""


@sliced
def ground_of(tracks: PartTracks) -> Slices[tuple[float, Array]]:
    """Height of the ground [H] and its horizontal velocity, (2,) [H/s].

    Velocity is sought among skin that is low for the half second around, as feet that hang in flight are calm, too; and
    among all low skin, as feet may dip deep through the ground in swing. The ground is the level on which more skin
    rests.
    """
    drift, other = drift_of(tracks, _on_ground(tracks)), drift_of(tracks)
    level, votes = yield from level_of.slices(tracks, drift)
    if np.linalg.norm(other - drift) > STANDS:
        other_level, most = yield from level_of.slices(tracks, other)
        if votes < GROUNDED_SHARE * most:
            return other_level, other
    return level, drift


def _on_ground(tracks: PartTracks) -> Array:
    """Nearness of each part to the lowest calm skin around, (F, P): 1 at it, 0 from `REACH` above it on."""
    reach = max(round(AROUND * tracks.rate), 1)
    lowest = np.pad(np.where(_calm(tracks) > 0, tracks.low, np.inf).min(axis=1), reach, mode="symmetric")
    around = np.lib.stride_tricks.sliding_window_view(lowest, 2 * reach + 1)
    over = tracks.low - np.percentile(around, OFTEN, axis=1, method="lower")[:, None]
    return np.asarray(np.clip(1.0 - over / REACH, 0.0, 1.0))


def drift_of(tracks: PartTracks, counts: Array | float = 1.0) -> Array:
    """Horizontal velocity that most calm low skin has, (2,) [H/s]: 0 where the character travels.

    The belt's in a walk on the spot, backward: minus the travel that root motion would have. `counts` (F, P) are the
    weights of each part at each moment.
    """
    weight = _calm(tracks) * (tracks.low < tracks.lowest[:, None] + REACH) * counts
    frame, part = np.nonzero(weight)
    if not len(frame):
        return np.zeros(2)
    if len(frame) > MOST_VOTES:
        sampled = np.linspace(0, len(frame) - 1, MOST_VOTES).astype(int)
        frame, part = frame[sampled], part[sampled]
    ways, weight = tracks.ways.mean(axis=0)[frame, part], weight[frame, part]
    first = np.flatnonzero(np.diff(frame, prepend=-1))

    def votes(way: Array) -> Array:
        """Each moment has one vote for a velocity (N, 2), however many parts move with it."""
        apart = np.hypot(*(np.subtract.outer(asked, moving) for asked, moving in zip(way.T, ways.T, strict=True)))
        apart /= _width(way)[:, None]
        return np.asarray(np.maximum.reduceat(weight * np.clip(1 - apart, 0.0, None), first, axis=1).sum(axis=1))

    tally = votes(ways)
    best = ways[int(tally.argmax())]
    if np.linalg.norm(best) < STANDS or votes(np.zeros((1, 2)))[0] >= STANDING_SHARE * tally.max():
        return np.zeros(2)
    alike = weight * np.clip(1 - np.linalg.norm(ways - best, axis=-1) / _width(best), 0.0, None)
    return np.asarray((ways * alike[:, None]).sum(axis=0) / alike.sum())


def _width(way: Array) -> Array:
    return np.maximum(SAME_WAY, SAME_WAY * np.linalg.norm(way, axis=-1))


@sliced
def level_of(tracks: PartTracks, drift: Array) -> Slices[tuple[float, float]]:
    """Height of the ground [H], where calm skin that moves with the ground is most often, and the votes for it.

    Of feet that land alone at different heights, the highest counts, whichever is seen in more frames: a foot that
    sinks below it prints, one that hovers over it never does.
    """
    lowest = tracks.lowest
    speed = max(float(np.linalg.norm(drift)), 1.0)
    agrees = np.clip(1.5 - tracks.slip(drift) / (4 * SAME_WAY * speed), 0.1, 1.0)
    calm = _calm(tracks) * agrees
    weight = calm * np.clip(1 - (tracks.low - lowest[:, None]) / REACH, 0.0, None)
    lies, sinks = _at(0.0, tracks) * calm > WORTH, (tracks.low < -TOUCH) & (calm > WORTH)
    deep = tracks.low[0][sinks[0]]  # arms hang through a floor each to a depth of its own
    if lies[0].sum() > (np.abs(np.subtract.outer(deep, deep)) < BIN).sum(axis=1).max(initial=1):
        weight = np.where(lies, calm, weight)  # also where arms that hang through the floor are lower
    if not weight.any():
        return float(np.percentile(lowest, OFTEN)), 0.0
    levels = np.arange(lowest.min(), (tracks.low[weight > 0]).max() + BIN, BIN)
    score, rests = np.empty(len(levels)), np.empty((len(levels), weight.shape[1]))
    count = max(_SLICE // weight.size, 1)
    for start in range(0, len(levels), count):
        here = slice(start, start + count)
        near = _at(levels[here, None, None], tracks) * weight
        rests[here] = near.sum(axis=1)
        votes = near.max(axis=2) * (1 + FURTHER_PART * np.clip((near > WORTH).sum(axis=2) - 1, 0, 3))
        sunk = (weight * (tracks.low < levels[here, None, None] - SUNK)).max(axis=2)
        score[here] = (votes - AGAINST * sunk).sum(axis=1)
        yield
    on_floor = (np.abs(levels) < BIN) & bool((_at(0.0, tracks)[0] > WORTH).sum() > 1)
    score[on_floor] *= WORLD_FLOOR
    best = float(levels[score.argmax()])
    if not on_floor[score.argmax()]:
        best = _raised(best, levels[rests.argmax(axis=0)], tracks, weight)
    here = weight * (np.abs(tracks.low - best) < 1.5 * BIN)
    return float((tracks.low * here).sum() / here.sum()) if here.any() else best, float(score.max())


def _raised(level: float, of_part: Array, tracks: PartTracks, weight: Array) -> float:
    """A level [H], or the highest of the levels of single parts (P,) where these rest alone about as long."""
    resting = (_at(level, tracks) * weight).max(axis=1)
    alone = (_at(of_part, tracks) * weight)[resting == 0].sum(axis=0)
    raises = (of_part > level + TOUCH) & (of_part < level + SUNK) & (alone > AS_LONG * resting.sum())
    return float(of_part[raises].max(initial=level))


def _at(level: Array | float, tracks: PartTracks) -> Array:
    """Membership of each part in a level [H], (F, P) or (L, F, P)."""
    return np.clip(1.5 - np.abs(tracks.low - level) / BIN, 0.0, 1.0)


def _calm(tracks: PartTracks) -> Array:
    return np.clip(1.5 - tracks.rise / tracks.calm, 0.0, 1.0)
