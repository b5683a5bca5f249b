"""Foot lock: takes the slide out of each contact of a foot on a hard floor.

A rigid foot rolls over heel, ball and toes while it stands. At each moment only its lowest points bear, and those may
not move along the floor; the others may. So the foot rolls as it does in the source, without slip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..loads.contacts import LEAVE_SPEED, REST_SPEED, TOUCH_HEIGHT, TOUCH_SPEED
from ..motion.motion import CharacterMotion
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from ..numerics.rigid import displacement, rotation
from .foot_placement import PressedGround, between_contacts
from .sole_rim import along, posed_rim, rim_pieces

PLANTED = 0.01
"""Points of a sole bear that are this near to its lowest, in sole lengths (3 mm of an adult's shoe)."""
YIELD = 0.0025
"""Height above the lowest point at which a point bears 1/e as much, in sole lengths (0.7 mm of an adult's shoe): with
more, the bearing points creep along while the foot rolls over its toes."""
MOST = 0.8
"""A rigid piece of the sole bears that has this part as many points near the floor as the one with most of them."""
AXLE = 0.01
"""Points that bear within about this distance of each other are an axle, about which the foot may turn, in lengths."""
TWIST = np.radians(25.0)
"""A foot that turns by more than this in one contact keeps its turn, about the place along it that is calmest as it
turns [rad]."""
PLACES = 21
"""Places along a sole of which one is the calmest..."""
STRIP = 0.05
"""...each the mean of the points about it, of which those at this distance count 1/e as much, in sole lengths."""
OFF_FLOOR = 0.1
"""A foot turns about its calmest place while that is no higher than this above the lowest point, in sole lengths; from
twice as high on, about the points that bear."""
TRAVEL = 0.15
"""A foot that goes so far along the floor in a burst is meant to go there, in leg lengths (14 cm for an adult)."""
FARTHEST = 0.5
"""A foot that slides farther than this in one contact glides all along, however slowly, in leg lengths: hips that
stayed with it would leave the animation."""
REFITS = 5
"""Times that each frame of a contact is fitted to where its planted points were planted: further ones take out less
than a tenth of a percent of the slide."""
STILL = 0.004
"""A contact is held where its foot moves slowest: frames with less slide than this count alike, in sole lengths."""


@dataclass(frozen=True)
class Underside:
    """The rim of a sole over time, on a floor.

    Attributes
    ----------
    points : (F, Q, 3) float array
        In the world [m].
    heights : (F, Q) float array
        Above the floor [m].
    piece : (Q,) int array
        Which rigid piece of the sole each belongs to.
    length : float
        Of the sole [m].
    along : (Q,) float array
        Place of each along the sole, from 0 at its rear end to 1 at its front.
    """

    points: Array
    heights: Array
    piece: NDArray[np.intp]
    length: float
    along: Array

    def lowest(self) -> Array:
        """Height of the lowest point, (F,) [m]."""
        return np.asarray(self.heights.min(axis=1))

    def bearing(self, most: float = MOST) -> Array:
        """Share that each point bears (F, Q), 1 in all of a frame.

        The lowest points bear: those of the piece with most of them, and of another with a part as many (`most`). Where
        the toes lie flat, the ball of the foot that bends up from them rolls off the floor.
        """
        above = self.heights - self.lowest()[:, None]
        bears = np.exp(-above / (YIELD * max(self.length, 1e-9))) * self._of_bearing_piece(above, most)
        return np.asarray(bears / bears.sum(axis=1, keepdims=True))

    def planted(self) -> Mask:
        """True for bearing points (F, Q): no higher than `PLANTED` above the lowest, of a piece that bears."""
        above = self.heights - self.lowest()[:, None]
        return (above <= PLANTED * self.length) & self._of_bearing_piece(above, MOST)

    def _of_bearing_piece(self, above: Array, most: float) -> Mask:
        near = above <= PLANTED * self.length
        count = np.stack([near[:, self.piece == piece].sum(axis=1) for piece in range(self.piece.max() + 1)], axis=1)
        return np.asarray((count >= most * count.max(axis=1, keepdims=True))[:, self.piece])


def underside_on(motion: SoleMotion, floor: PressedGround, frames: Array) -> Underside:
    """The rim of a sole over time and its heights above a floor, above its own lowest point where there is none."""
    points = posed_rim(motion)
    ground = floor.heights(points[..., 0], points[..., 1], np.broadcast_to(frames[:, None], points.shape[:2]))
    known = np.isfinite(ground)
    above_lowest = points[..., 2] - points[..., 2].min(axis=1, keepdims=True)
    heights = np.where(known.any(axis=1, keepdims=True), np.where(known, points[..., 2] - ground, np.inf), above_lowest)
    return Underside(points, heights, rim_pieces(motion.sole), motion.sole.length, along(motion.sole))


def lock(sole: Underside, touching: Mask, weight: Array | None = None) -> Array:
    """Level displacements (F, 4, 4) that keep the bearing points of a sole in place during each contact.

    Parameters
    ----------
    touching : (F,) bool array
    weight : (F, Q) float array, optional
        Weight with which each point stays in place, by default that of its bearing; 1 in all of a frame.
    """
    weight = sole.bearing() if weight is None else weight
    turn, move = np.zeros(len(touching)), np.zeros((len(touching), 2))
    middle = sole.points[..., :2].mean(axis=1)
    for first, end in zip(*runs(touching), strict=True):
        during = slice(first, end)
        turn[during], shift = _held(sole, during, weight[during])
        move[during] = turned_level(turn[during], middle[during]) + shift - middle[during]
    return eased(middle, turn, move, touching)


def eased(middle: Array, turn: Array, move: Array, touching: Mask) -> Array:
    """Level displacements (F, 4, 4) of contacts, passing smoothly from each to the next.

    Parameters
    ----------
    middle : (F, 2) float array
        Of the sole [m].
    turn : (F,) float array
        Counter-clockwise [rad]; like `move`, only its values in contacts count.
    move : (F, 2) float array
        Displacement of the middle [m].
    touching : (F,) bool array
    """
    if not touching.any():
        return np.broadcast_to(np.eye(4), (len(touching), 4, 4))
    turn = between_contacts(turn, touching)
    move = between_contacts(move, touching)
    start = np.concatenate([middle, np.zeros((len(middle), 1))], axis=1)
    end = np.concatenate([middle + move, np.zeros((len(middle), 1))], axis=1)
    return displacement(rotation(turn[:, None] * (0.0, 0.0, 1.0)), start, end)


def _steps(sole: Underside, during: slice, weight: Array) -> tuple[Array, Array, bool]:
    """Turns (K - 1,) and shifts (K - 1, 2) that bring each frame's bearing points back to where they were in the frame
    before, and True if the foot turns on purpose: then the shifts alone do, of the foot turned back about its pivot."""
    points, both = sole.points[during, :, :2], _bearing_in_both(weight)
    back = _fitted(points[1:], points[:-1], np.ones_like(both), 0.0)[0]
    if abs(back.sum()) <= TWIST:
        return (*_fitted(points[1:], points[:-1], both, AXLE * sole.length), False)
    bearing = np.einsum("kq,kqi->ki", both / both.sum(axis=1, keepdims=True), points[1:])
    arm = _pivot(sole, during, bearing, np.abs(back)) - bearing
    shifts = _fitted(points[1:], points[:-1], both, np.inf)[1]
    return 0.0 * back, shifts - (arm - turned_level(back, arm)), True


def _pivot(sole: Underside, during: slice, bearing: Array, turning: Array) -> Array:
    """Place (K - 1, 2) about which a foot turns by angles (K - 1,) in each step: the one along it that moves least as
    it turns, or what bears (K - 1, 2) while that is off the floor."""
    near = np.exp(-np.abs(sole.along - np.linspace(0.0, 1.0, PLACES)[:, None]) / STRIP)
    places = np.einsum("pq,kqi->kpi", near / near.sum(axis=1, keepdims=True), sole.points[during])
    calmest = int((turning @ np.linalg.norm(np.diff(places[..., :2], axis=0), axis=-1)).argmin())
    heights = sole.heights[during]
    over = np.isfinite(heights)  # what is beyond the floor has no height above it
    share = near[calmest] * over
    height = np.einsum("kq,kq->k", share, np.where(over, heights, 0.0)) / np.maximum(share.sum(axis=1), 1e-300)
    rests = np.clip(2.0 - (height - sole.lowest()[during]) / (OFF_FLOOR * sole.length), 0.0, 1.0)[1:, None]
    return np.asarray(bearing + rests * (places[1:, calmest, :2] - bearing))


def rolled(points: Array, weight: Array) -> Array:
    """Movement of the bearing points along the floor from frame to frame (K - 1, 2), of points (K, Q, 2) [m]."""
    return -_fitted(points[1:], points[:-1], _bearing_in_both(weight), np.inf)[1]


def _bearing_in_both(weight: Array) -> Array:
    """Weight with which points bear (K - 1, Q) in a frame and the one before."""
    both = np.sqrt(weight[1:] * weight[:-1])
    return np.where(both.sum(axis=1, keepdims=True) > 1e-3, both, weight[1:] + weight[:-1])


def _held(sole: Underside, during: slice, weight: Array) -> tuple[Array, Array]:
    """Turn (K,) and shift (K, 2) of one contact's frames: x goes to R(turn)·x + shift, and bearing points stay."""
    points, length = sole.points[during, :, :2], sole.length
    turns, shifts, on_purpose = _steps(sole, during, weight)
    turn = np.concatenate([[0.0], np.cumsum(turns)])
    shift = np.concatenate([np.zeros((1, 2)), np.cumsum(turned_level(turn[:-1], shifts), axis=0)])
    if not on_purpose:
        turn, shift = _refitted(points, weight, length, turn, shift)
    slid = np.linalg.norm(np.gradient(shift, axis=0), axis=1) if len(shift) > 1 else np.zeros(1)
    slow = (1.0 / (1.0 + (slid / (STILL * length)) ** 2))[:, None] * weight
    held = turned_level(turn[:, None], points) + shift[:, None]
    axle = np.inf if on_purpose else AXLE * length
    back, away = _fitted(held.reshape(1, -1, 2), points.reshape(1, -1, 2), slow.reshape(1, -1), axle)
    return turn + back, turned_level(back, shift) + away


def _refitted(points: Array, weight: Array, length: float, turn: Array, shift: Array) -> tuple[Array, Array]:
    """Turn (K,) and shift (K, 2) with which planted points are as near as can be to where they were planted.

    Where skin bends, they cannot all stay: from step to step the points that bear most would win, and the slides of the
    others would add up.
    """
    bears = weight >= np.exp(-PLANTED / YIELD) * weight.max(axis=1, keepdims=True)
    since = _planted_since(bears)[..., None]
    for _ in range(REFITS):
        held = turned_level(turn[:, None], points) + shift[:, None]
        back, away = _fitted(held, np.take_along_axis(held, since, axis=0), bears.astype(float), AXLE * length)
        turn, shift = turn + back, turned_level(back, shift) + away
    return turn, shift


def _fitted(start: Array, end: Array, weight: Array, axle: float) -> tuple[Array, Array]:
    """Least-squares turn (K,) and shift (K, 2) from points to points (K, Q, 2) (Procrustes); points nearer to each
    other than `axle` do not turn."""
    weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
    a, b = np.einsum("kq,kqi->ki", weight, start), np.einsum("kq,kqi->ki", weight, end)
    p, q = start - a[:, None], end - b[:, None]
    sine = np.einsum("kq,kq->k", weight, p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0])
    cosine = np.einsum("kq,kq->k", weight, p[..., 0] * q[..., 0] + p[..., 1] * q[..., 1])
    turn = np.zeros(len(start)) if np.isinf(axle) else np.arctan2(sine, np.maximum(cosine, 0.0) + axle**2)
    return turn, b - turned_level(turn, a)


def turned_level(turn: Array, points: Array) -> Array:
    """Level points (..., 2) turned about the origin by angles (...) [rad]."""
    cosine, sine = np.cos(turn), np.sin(turn)
    x, y = points[..., 0], points[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def travelling(sole: Underside, touching: Mask, motion: CharacterMotion) -> Mask:
    """True while a foot that touches travels along the floor on purpose, as in a lunge or on skates, (F,).

    Somewhere on such a way it is faster than a foot that still touches and than half the body; a foot that skids,
    because its walk is scaled wrongly, is slower than half the body. The way begins and ends where the foot stands, or
    with the contact, stays at its height, unlike that of a foot that lands or leaves, and is no shorter than `TRAVEL`.
    A contact in which the foot gets farther than `FARTHEST` is such a way as a whole.

    Parameters
    ----------
    touching : (F,) bool array
    motion : CharacterMotion
        Whose sole it is, at the same frames.
    """
    body = np.linalg.norm(np.diff(motion.hips[:, :2], axis=0), axis=1)
    unit = motion.froude_speed * motion.time_step
    weight, lowest, travels = sole.bearing(), sole.lowest(), np.zeros(len(touching), bool)
    for first, end in zip(*runs(touching), strict=True):
        step = rolled(sole.points[first:end, :, :2], weight[first:end])
        length = np.linalg.norm(step, axis=1)
        fast = length > np.maximum(LEAVE_SPEED * TOUCH_SPEED * unit, body[first : end - 1] / 2)
        if np.linalg.norm(np.cumsum(step, axis=0), axis=1).max(initial=0.0) > FARTHEST * motion.leg_length:
            travels[first:end] = True
            continue
        high = np.abs(lowest[first:end] - np.median(lowest[first:end])) > TOUCH_HEIGHT * motion.leg_length
        for start, stop in zip(*runs(length > REST_SPEED * unit), strict=True):
            far = np.linalg.norm(np.cumsum(step[start:stop], axis=0), axis=1).max() > TRAVEL * motion.leg_length
            if far and fast[start:stop].any() and not high[start : stop + 1].any():
                begin, until = start + (start > 0), stop + (stop == len(step))
                travels[first + begin : first + max(until, begin + 1)] = True
    return travels


def slides(sole: Underside, touching: Mask) -> Array:
    """Distance of each planted point from where it was planted, for each of its frames, (N,) [m].

    For a foot that turns on purpose (`TWIST`), the slide of its pivot.
    """
    planted, weight = sole.planted() & touching[:, None], sole.bearing()
    distances = [np.zeros(0)]
    for first, end in zip(*runs(touching), strict=True):
        points = sole.points[first:end, :, :2]
        _, shifts, on_purpose = _steps(sole, slice(first, end), weight[first:end])
        if on_purpose:
            distances.append(np.linalg.norm(np.cumsum(shifts, axis=0), axis=1))
        else:
            distances.append(_since_planted(points, planted[first:end]))
    return np.concatenate(distances)


def _since_planted(points: Array, planted: Mask) -> Array:
    """Distance of planted points (K, Q, 2) from where they were planted, at each of the frames in which they are."""
    first = np.take_along_axis(points, _planted_since(planted)[..., None], axis=0)
    return np.asarray(np.linalg.norm(points - first, axis=-1)[planted])


def _planted_since(planted: Mask) -> NDArray[np.intp]:
    """Frame at which each point (K, Q) was planted, at each of the frames in which it is."""
    starts = planted & ~np.concatenate([np.zeros((1, planted.shape[1]), bool), planted[:-1]])
    return np.maximum.accumulate(np.where(starts, np.arange(len(planted))[:, None], 0), axis=0)


def moved(motion: SoleMotion, carry: Array) -> SoleMotion:
    """A sole carried by rigid displacements (F, 4, 4)."""
    return SoleMotion(motion.sole, carry[:, None] @ motion.transforms, motion.bears)
