"""Heel strike and toe-off to a few milliseconds, from the forces on the whole body.

Heights and speeds tell that a foot is on the ground, not quite when it got there: a swinging foot comes in flat and
slow, and a toe leaves while it hardly moves. The forces do: in double support the point through which the total force
acts moves from the trailing to the leading foot.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..dynamics.body_dynamics import FREE_FALL, BodyDynamics, flights
from ..dynamics.centre_of_pressure import extents, lowest_points
from ..dynamics.load_sharing import whole_body_shares
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array
from ..numerics.intervals import close_short, runs
from ..numerics.smoothing_spline import smooth_path
from .contacts import EDGE_CUTOFF, LEAVE_HEIGHT, TOUCH_SPEED, Contacts
from .sliding import treadmill_velocity

SEARCH = 0.33
"""How far the forces may move heel strike and toe-off, in sqrt(leg length/gravity) (0.1 s for an adult)."""
TIMING_DEVIATION = 0.08
"""Standard deviation of the times found from heights and speeds, in the same unit (25 ms)."""
SHARE_DEVIATION = 0.07
"""Least standard deviation of the leading foot's share as the point of action tells it."""
WANDER = 2.0
"""How far the point of action wanders under a foot that rolls from heel to toes, in its `extents`."""
SURE = 2.0
"""How far from the times found the other foot is surely off the ground, in `TIMING_DEVIATION`."""
SHARE_MEMORY = 0.25
"""Time over which the error of that share is about the same, in the same unit (one period of the low-pass at 4/5)."""
SHORTEST_OVERLAP = 0.1
"""Shortest double support, in the same unit (30 ms)."""

LANDING_DEVIATION = 0.07
"""Standard deviation of the time of a landing after flight as heights and speeds tell it, in the same unit (20 ms)."""
ONSET_DEVIATION = 0.035
"""Standard deviation of that time as the rise of the total force tells it, in the same unit (10 ms)."""
SHORTEST_SUPPORT = 0.165
"""A push up that lasts less does not prove a contact, in the same unit (50 ms)."""
LONGEST_ROLL = 0.5
"""On the spot, a foot that is not lifted stands on while it rolls from its heel faster or slower than the belt, for at
most this long, in the same unit (0.15 s)."""
HIGHEST_SUPPORT = 0.2
"""A sole higher than this bears nothing, whatever pushes the body up, in leg lengths."""
SUPPORT_RANGE = 0.08
"""A sole bears while it is within this of its lowest place, in leg lengths."""
IDLE_LOAD = 0.15
"""A sole that never bears more than this only drags, in body weights."""
RESTS = 0.5
"""A sole whose skin rests for more of its contact does not drag."""
QUARTER_SINE, HALF_SINE = np.arcsin((0.25, 0.5))
"""Phases at which a sine has a quarter and a half of its peak."""

COARSE_STRIDE = 3
"""Steps between the times that are tried first."""
WINDOW_UNIT = 8
"""Steps to a whole number of which a transition's window is extended, so that many are fitted at once."""
AT_ONCE = 32
"""Transitions that are fitted at once: a thousand ramps are tried on each."""


@dataclass(frozen=True)
class Transition:
    """The load passes from one sole to another.

    Attributes
    ----------
    trailing, leading : int
        Soles.
    strike, leave : int
        Step at which the leading sole lands and the trailing one has left; they overlap when strike < leave.
    """

    trailing: int
    leading: int
    strike: int
    leave: int


def refine_contacts(motion: CharacterMotion, contacts: Contacts, body: BodyDynamics) -> Contacts:
    """Contacts that agree with the forces on the whole body.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    contacts : Contacts
        Found from heights and speeds.
    body : BodyDynamics
        Of that motion, before anything is known about flight.
    """
    unit = motion.pendulum_time / motion.time_step
    flying = flights(~contacts.touching.any(axis=1), body, motion)
    touching = _supported(motion, contacts, np.where(flying, 0.0, body.force[:, 2]))
    for sole in range(touching.shape[1]):
        touching[:, sole] = close_short(touching[:, sole], round(SHORTEST_SUPPORT * unit))
    if treadmill_velocity(motion, dataclasses.replace(contacts, touching=touching)).any():
        lifted = flying[:, None] | (contacts.clearance > LEAVE_HEIGHT * motion.leg_length)
        touching = _rolled_on(touching, lifted, round(LONGEST_ROLL * unit))
    lowest = lowest_points(motion)
    changes = [
        change
        for change in transitions(touching, round(SEARCH * unit))
        # In flight the feet are right, there is no double support.
        if body.force[change.leave : change.strike, 2].min(initial=np.inf) >= FREE_FALL
        and not flying[change.leave : change.strike].any()
    ]
    for change, (strike, leave) in zip(
        changes, _fit_overlaps(changes, lowest, extents(motion, lowest), body, unit), strict=True
    ):
        touching[min(strike, change.strike) : max(strike, change.strike), change.leading] = strike < change.strike
        touching[min(leave, change.leave) : max(leave, change.leave), change.trailing] = leave > change.leave
    for first, sole in _landings(touching):
        onset = _onset(body.force[:, 2], first, round(SEARCH * unit))
        weight = LANDING_DEVIATION**2 / (LANDING_DEVIATION**2 + ONSET_DEVIATION**2)
        strike = round(first + weight * (onset - first))
        touching[min(strike, first) : max(strike, first), sole] = strike < first
    load = whole_body_shares(motion, lowest, touching, body) * body.force[:, 2:]
    return dataclasses.replace(contacts, touching=_without_idle(touching, load, _resting(motion)))


def _rolled_on(touching: NDArray[np.bool_], lifted: NDArray[np.bool_], longest: int) -> NDArray[np.bool_]:
    """Contacts (N, S) without the gaps of at most `longest` steps in which the sole is never lifted."""
    joined = touching.copy()
    for sole in range(touching.shape[1]):
        for first, last in zip(*runs(~touching[:, sole]), strict=True):
            inside = first > 0 and last < len(touching) and last - first <= longest
            joined[first:last, sole] = inside and not lifted[first:last, sole].any()
    return joined


def _resting(motion: CharacterMotion) -> NDArray[np.bool_]:
    """True while the skin of each sole rests, (N, S); never where that is not seen."""
    never = np.zeros(len(motion.frames), dtype=bool)
    return np.stack([never if sole.bears is None else sole.bears for sole in motion.soles], axis=1)


def _without_idle(touching: NDArray[np.bool_], load: Array, resting: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Contacts less those whose load (N, S) [body weights] is never worth the name: a foot that drags bears nothing.

    What mostly rests stays: how hard it presses shows in its depth.
    """
    bearing = touching.copy()
    for sole in range(touching.shape[1]):
        for first, last in zip(*runs(touching[:, sole]), strict=True):
            rests = resting[first:last, sole].mean() > RESTS
            bearing[first:last, sole] = rests or load[first:last, sole].max() > IDLE_LOAD
    return np.where(bearing.any(axis=1, keepdims=True), bearing, touching)


def _supported(motion: CharacterMotion, contacts: Contacts, force: Array) -> NDArray[np.bool_]:
    """Contacts, with a sole on the ground wherever the body is pushed up: the lowest one, any about as low and slow.

    Feet that float by more in one step than in another are missed by their height. Such a contact may overlap those
    before and after it for a moment, as in double support.
    """
    unit = motion.pendulum_time / motion.time_step
    overlap = round(SEARCH * unit)
    same_height, highest = SUPPORT_RANGE * motion.leg_length, HIGHEST_SUPPORT * motion.leg_length
    clearance, touching = contacts.clearance, contacts.touching.copy()
    if contacts.aloft is not None:
        clearance = np.where(contacts.aloft, np.inf, clearance)
    unsupported = [
        (first, last)
        for first, last in zip(*runs((force > FREE_FALL) & ~touching.any(axis=1)), strict=True)
        if last - first >= round(SHORTEST_SUPPORT * unit) and clearance[first:last].min() <= highest
    ]
    if not unsupported:
        return touching
    speed = _sole_speeds(motion, treadmill_velocity(motion, contacts))
    about_as_low = clearance < clearance.min(axis=1, keepdims=True) + same_height
    slowest = np.where(about_as_low, speed, np.inf).min(axis=1, keepdims=True)
    about_as_slow = speed < slowest + TOUCH_SPEED * motion.froude_speed
    bearing = about_as_low & about_as_slow & (force > 0)[:, None]
    for first, last in unsupported:
        begin, end = max(first - overlap, 0), last + overlap
        for sole in range(touching.shape[1]):
            for start, stop in zip(*runs(bearing[begin:end, sole]), strict=True):
                if begin + start < last and begin + stop > first:
                    height = clearance[begin + start : begin + stop, sole]
                    touching[begin + start : begin + stop, sole] |= height < height.min() + same_height
    return touching


def _sole_speeds(motion: CharacterMotion, belt: Array) -> Array:
    """Horizontal speed of each sole's slowest landmark on a belt of a velocity (2,), (N, S) [m/s]."""
    cutoff = EDGE_CUTOFF / (2 * np.pi * motion.pendulum_time)
    frames = motion.at_frames()
    points = [sole.landmark_positions()[..., :2] for sole in frames.soles]
    path = np.concatenate(points, axis=1)
    _, velocity, _ = smooth_path(path.reshape(len(path), -1), frames.time_step, cutoff)
    first = np.cumsum([0, *(place.shape[1] for place in points)])[:-1]
    slowest = np.minimum.reduceat(np.linalg.norm(velocity.reshape(path.shape) - belt, axis=-1), first, axis=1)
    return np.stack([np.interp(motion.frames, frames.frames, speed) for speed in slowest.T], axis=1)


def _landings(touching: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First steps of contacts that end a flight, with their soles."""
    grounded, _ = runs(touching.any(axis=1))
    return [(int(first), int(sole)) for first in grounded[grounded > 0] for sole in np.flatnonzero(touching[first])]


def _onset(force: Array, first: int, search: int) -> float:
    """Step at which the vertical force (N,) [body weights] starts to rise, near the landing at step `first`.

    The low-pass leads the force into the flight; its steep flank stays in place. The flank is that of a half sine, as
    running and landing show: from one half of the peak through one quarter to 0 in known proportion.
    """
    window = force[max(first - search, 0) : first + max(search, 1)]
    crest = int(window.argmax())
    peak = window[crest]
    quarter, half = (_last_below(window[: crest + 1], level * peak) for level in (0.25, 0.5))
    if peak < 1.0 or quarter < 0 or window[: crest + 1].min() > 0.25 * peak:
        return float(first)
    onset = quarter - (half - quarter) * QUARTER_SINE / (HALF_SINE - QUARTER_SINE)
    return max(first - search, 0) + float(np.clip(onset, 0, len(window)))


def _last_below(rising: Array, level: float) -> float:
    """Last crossing of a level by a curve, in fractional samples; -1 if it is never below."""
    since = int((rising[::-1] < level).argmax())
    if not since:  # it is below to the end, or never
        return -1.0
    i = len(rising) - 1 - since
    return float(i + (level - rising[i]) / (rising[i + 1] - rising[i]))


def transitions(touching: NDArray[np.bool_], reach: int) -> list[Transition]:
    """Changes of load from one sole to another that no third sole has a part in.

    Parameters
    ----------
    touching : (N, S) bool array
    reach : int
        Longest gap between the trailing sole's contact and the leading one's [steps].
    """
    count = len(touching)
    intervals = [
        (int(first), int(last), sole)
        for sole in range(touching.shape[1])
        for first, last in zip(*runs(touching[:, sole]), strict=True)
    ]
    changes = []
    for first, last, leading in intervals:
        if first == 0:
            continue
        partners = [
            (end, sole)
            for start, end, sole in intervals
            if sole != leading and start < first and first - reach <= end < min(last, count)
        ]
        if len(partners) != 1:
            continue
        leave, trailing = partners[0]
        window = slice(max(min(first, leave) - reach, 0), max(first, leave) + reach)
        others = np.delete(touching[window], (leading, trailing), axis=1)
        if not others.any():
            changes.append(Transition(trailing, leading, first, leave))
    return changes


@dataclass(frozen=True)
class _Windows:
    """Transitions that are fitted together, and the steps at which each is looked at.

    Attributes
    ----------
    estimated : (T, 2) int array
        Strike and leave as they were found.
    feet : (T, 2) int array
        The trailing and the leading sole.
    step : (T, W) int array
        Steps of each window, as many for all.
    end : (T,) int array
        Where each window ends: its steps from there on say nothing.
    """

    estimated: NDArray[np.intp]
    feet: NDArray[np.intp]
    step: NDArray[np.intp]
    end: NDArray[np.intp]


def _fit_overlaps(
    changes: list[Transition], lowest: Array, extent: Array, body: BodyDynamics, unit: float
) -> NDArray[np.intp]:
    """Strike and leave of each transition whose cosine ramp fits the point of action best, (T, 2)."""
    search = max(round(SEARCH * unit), 1)
    ramps = np.array([(change.strike, change.leave) for change in changes]).reshape(-1, 2)
    begin = np.maximum(ramps.min(axis=1) - search, 0)
    end = np.minimum(ramps.max(axis=1) + search, len(lowest))
    fitted = ramps.copy()
    # Those whose windows are about as long are fitted together.
    width = -(-(end - begin) // WINDOW_UNIT) * WINDOW_UNIT
    alike = [np.flatnonzero(width == steps) for steps in np.unique(width)]
    for batch in (part for group in alike for part in np.split(group, range(AT_ONCE, len(group), AT_ONCE))):
        feet = np.array([(changes[index].trailing, changes[index].leading) for index in batch])
        windows = _Windows(
            ramps[batch],
            feet,
            begin[batch, None] + np.arange(width[batch[0]]),
            end[batch],
        )
        share, telling = _shares_told(windows, lowest, extent, body, unit)
        fitted[batch] = _best_ramps(windows, share, telling, unit)
    return fitted


def _shares_told(
    windows: _Windows, lowest: Array, extent: Array, body: BodyDynamics, unit: float
) -> tuple[Array, Array]:
    """The leading foot's share at each step as the point of action tells it, and how much that says, both (T, W).

    Surely before the strikes and after the leaves that were found the share is 0 and 1: what the point of action tells
    there shows how far it can be trusted. A body animated by eye moves with little regard to the foot that bears it.
    """
    step, end = windows.step, windows.end[:, None]
    trailing, leading = windows.feet[:, :1], windows.feet[:, 1:]
    inside = step < end
    sure = round(SURE * TIMING_DEVIATION * unit)
    before = step < windows.estimated.min(axis=1, keepdims=True) - sure
    after = (step >= windows.estimated.max(axis=1, keepdims=True) + sure) & inside
    within = np.minimum(step, end - 1)
    back, front = lowest[within, trailing], lowest[within, leading]
    ground = np.select([before, after], [back[..., 2], front[..., 2]], (back[..., 2] + front[..., 2]) / 2)
    along = (front - back)[..., :2]
    length = (along**2).sum(axis=-1)
    share = ((body.point_of_action(ground, within) - back[..., :2]) * along).sum(axis=-1) / np.maximum(length, 1e-12)
    share = np.clip(share, 0.0, 1.0)
    # The point of action wanders under each sole as far as that can press: so much less it tells about the shares.
    wander = (1 - share) * extent[within, trailing] ** 2 + share * extent[within, leading] ** 2
    wander *= WANDER**2 / np.maximum(length, 1e-12)
    off = np.select([before, after], [share, 1 - share], 0.0) ** 2
    beyond = np.maximum(off - wander, 0.0).sum(axis=1, keepdims=True)
    beyond /= np.maximum((before | after).sum(axis=1, keepdims=True), 1)
    # Where the point of action leaves a foot that bears alone, shares near 0 and 1 tell nothing of the other.
    trust = (SHARE_DEVIATION**2 / (SHARE_DEVIATION**2 + beyond)) ** 2
    telling = trust + (1 - trust) * (4 * share * (1 - share)) ** 2
    telling /= SHARE_MEMORY * unit * (SHARE_DEVIATION**2 + wander + beyond)
    return share, np.where(inside, telling, 0.0)


def _best_ramps(windows: _Windows, share: Array, telling: Array, unit: float) -> NDArray[np.intp]:
    """The pairs of strike and leave near those found whose ramps fit the shares (T, W) best, (T, 2)."""
    first, step, end = windows.estimated, windows.step, windows.end[:, None]
    search = max(round(SEARCH * unit), 1)
    best = first
    for stride in (COARSE_STRIDE, 1):
        reach = search // stride * stride if stride > 1 else COARSE_STRIDE - 1
        offset = np.arange(-reach, reach + 1, stride)
        pairs = best[:, None] + np.stack(np.meshgrid(offset, offset, indexing="ij"), axis=-1).reshape(-1, 2)
        strike, leave = pairs[..., 0], pairs[..., 1]
        possible = (leave - strike >= SHORTEST_OVERLAP * unit) & (strike > step[:, :1]) & (leave < end)
        overlap = np.where(possible, leave - strike, 1)[..., None]
        lengths = np.arange(1, overlap.max() + 1)[:, None]
        cosines = np.cos(np.pi * np.minimum(np.arange(len(lengths) + 1) / lengths, 1.0))
        into = np.clip(step[:, None] - strike[..., None], 0, overlap)
        into += (overlap - 1) * cosines.shape[1]
        ramp = cosines.ravel().take(into)
        ramp += 2 * share[:, None] - 1  # minus twice the misfit of a ramp (1 - cos)/2
        # A matrix product would wake the threads of the BLAS library, which cost more than they save here.
        misfit = np.einsum("gpw,gw->gp", np.square(ramp, out=ramp), telling / 4)
        moved = (pairs - first[:, None]) / unit
        cost = np.where(possible, misfit + ((moved / TIMING_DEVIATION) ** 2).sum(axis=-1), np.inf)
        least = np.take_along_axis(pairs, cost.argmin(axis=1)[:, None, None], axis=1)[:, 0]
        best = np.where(possible.any(axis=1, keepdims=True), least, best)
    return best
