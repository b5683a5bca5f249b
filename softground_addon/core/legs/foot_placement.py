"""Placement of each sole on the ground that gave way under it: turned to its slope, let down or lifted onto it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..motion.motion import CharacterMotion
from ..motion.sole_motion import Sole, SoleMotion, SolePatch
from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import smooth_step
from ..numerics.intervals import runs
from ..numerics.plane_fit import fitted_slope, smoothed, upper_envelope
from ..numerics.rigid import carried, displacement, rotation
from ..soles.deep_ground import wading
from .wading import depth_of_contacts, dragged, ploughed

ANKLE_PITCH = np.radians(25.0)
"""Largest pitch that a foot takes on beside that of the source [rad]: feet bend up by 20-30° (dorsiflexion)."""
ANKLE_ROLL = np.radians(15.0)
"""Largest roll that a foot takes on beside that of the source [rad]: it everts by about 15°."""
EDGE = 0.06
"""The outermost part of a sole that its ground is not read under, in sole lengths: prints have soft edges there."""
POINTS_ALONG = 9
"""Points along a sole at which the ground is read."""
ALIGN_TIME = 0.05
"""Standard deviation of the smoothing of a foot's turn over time [s], for an adult."""
PIVOT_DEPTH = 0.05
"""A foot is turned about those of its points that are this near to its lowest, in sole lengths: where it presses."""
SLIDE_DEPTH = 0.01
"""The same for the points whose sliding is that of the sole."""
CLEAR_TIME = 0.10
"""Half the time over which a swinging foot is lifted over obstacles [s], for an adult."""


Pieces = Sequence[tuple[int, Array]]
"""Points of a sole: patch and positions (K, 3) in the patch's frame [m]."""


class PressedGround(Protocol):
    """The ground over time, as `ground_history.GroundHistory`."""

    def heights(self, x: Array, y: Array, frame: Array) -> Array:
        """Heights at places and frames [m], NaN where there is no ground."""
        ...


@dataclass(frozen=True)
class Placement:
    """Placement of one sole.

    Attributes
    ----------
    carry : (F, 4, 4) float array
        Rigid displacement from the source's sole.
    lift : (F,) float array
        Its vertical part [m].
    sinkage : (F,) float array
        Depth below where it would stand on the undisturbed ground, 0 where it does not touch [m].
    room : (F,) float array
        Height above the ground, 0 where it touches and infinite where there is no ground [m].
    """

    carry: Array
    lift: Array
    sinkage: Array
    room: Array


def underside(sole: Sole, edge: float = EDGE) -> Pieces:
    """Points spread over a sole, inside its edge: patch and positions (K, 3) in the patch's frame [m].

    The landmarks where the sole has no patches.
    """
    if not sole.patches:
        return [(int(p), sole.landmarks[sole.landmark_patch == p]) for p in np.unique(sole.landmark_patch)]
    length = float(np.ptp(sole.outline, axis=0).max())
    return [(number, _inside(patch, length, edge)) for number, patch in enumerate(sole.patches)]


def _inside(patch: SolePatch, length: float, edge: float) -> Array:
    stride = max(1, round(length / POINTS_ALONG / patch.spacing))
    deepest = -float(patch.signed_distance.min())
    inside = patch.signed_distance < -min(edge * length, 0.7 * deepest)
    rows, columns = np.nonzero(inside)
    on_lattice = ((rows - rows.min()) % stride == 0) & ((columns - columns.min()) % stride == 0)
    rows, columns = rows[on_lattice], columns[on_lattice]
    x = patch.origin[0] + columns * patch.spacing
    y = patch.origin[1] + rows * patch.spacing
    return np.stack([x, y, patch.heights[rows, columns]], axis=-1)


def posed_points(motion: SoleMotion, pieces: Pieces | None = None) -> Array:
    """World positions of points in the frames of a sole's patches, or of its `underside`, (F, Q, 3) [m]."""
    poses = motion.transforms
    return np.concatenate(
        [
            points @ np.swapaxes(poses[:, patch, :3, :3], -1, -2) + poses[:, patch, None, :3, 3]
            for patch, points in (underside(motion.sole) if pieces is None else pieces)
        ],
        axis=1,
    )


def lowest_clearance(points: Array, ground: PressedGround, frames: Array) -> Array:
    """Height of the lowest of the points (F, Q, 3) above the ground, (F,) [m]; infinite off the ground."""
    heights = ground.heights(points[..., 0], points[..., 1], np.broadcast_to(frames[:, None], points.shape[:2]))
    return np.asarray(np.where(np.isfinite(heights), points[..., 2] - heights, np.inf).min(axis=1, initial=np.inf))


def place_sole(
    motion: CharacterMotion,
    number: int,
    touching: Mask,
    ground: PressedGround,
    undisturbed: PressedGround,
    *,
    align: float = 1.0,
    lock: float = 0.0,
    heel_rise: Array | None = None,
    change: Array | None = None,
    clearance: Array | None = None,
    points: Array | None = None,
) -> Placement:
    """Put a sole on the ground.

    While it touches, its lowest point lies on the ground, or as far above it as is wanted, and it is turned by the
    ground's slope as far as the ankle allows. Between contacts both change smoothly, and the sole keeps above the
    ground.

    Parameters
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    number : int
        Index of the sole.
    touching : (F,) bool array
        True while that sole touches.
    ground, undisturbed : PressedGround
        As it stands at each frame, and before the bake.
    align : float
        Share of the slope that the foot takes on, 0 to 1.
    lock : float
        Share of the source's sliding during a contact that is taken out, 0 to 1.
    heel_rise : (F,) float array, optional
        Angle by which the foot rolls further over its toes [rad].
    change : (F, 3) float array, optional
        Further displacement, 0 while it touches [m].
    clearance : (F,) float array, optional
        Height of its lowest point above the ground while it touches [m].
    points : (F, Q, 3) float array, optional
        Of the sole, that the ground is read under; by default those inside its edge, as in a print with soft edges [m].

    Returns
    -------
    Placement
        Without effect where the sole never touches.
    """
    sole, frames = motion.soles[number], motion.frames
    points = posed_points(sole) if points is None else points
    if not touching.any():
        carry = np.broadcast_to(np.eye(4), (len(frames), 4, 4)).copy()
        return Placement(carry, np.zeros(len(frames)), np.zeros(len(frames)), np.full(len(frames), np.inf))
    pivot = np.einsum("fq,fqi->fi", _lowest(points, PIVOT_DEPTH), points)
    slide = lock * slide_offset(points, touching) if lock else np.zeros_like(pivot)
    width = ALIGN_TIME * motion.adult_second
    alignment = np.zeros_like(pivot)
    if align:
        alignment = _alignment(sole, points + slide[:, None], touching, ground, undisturbed, frames, width)
    turn = rotation(align * alignment)
    carry = displacement(turn, pivot, pivot + slide)
    if heel_rise is not None:
        across = (turn @ sole.transforms[:, 0, :3, 1, None])[..., 0]
        toes = carried(carry, points[:, _foremost(sole, points)])
        carry = displacement(rotation(heel_rise[:, None] * across), toes, toes) @ carry
    turned = carried(carry[:, None], points)
    needed = -lowest_clearance(turned, ground, frames)
    on_top = needed if undisturbed is ground else -lowest_clearance(turned, undisturbed, frames)
    if clearance is not None:
        needed = np.where(touching, needed + clearance, needed)
    stands = touching & np.isfinite(on_top)
    sinkage = np.maximum(np.subtract(on_top, needed, out=np.zeros_like(needed), where=stands), 0.0)
    depth, clear_time = depth_of_contacts(sinkage, touching), CLEAR_TIME * motion.adult_second
    level = wading(depth, sole.sole.length)
    lift = between_contacts(np.where(np.isfinite(needed), needed, 0.0), touching, upward=True, level=level)
    ploughs = ploughed(depth, sole.sole.length)
    lift += _swing_clearance(needed - lift - ploughs, touching, max(1, round(clear_time)))
    if (drags := dragged(depth, sole.sole.length)).any():
        lift -= drags * _swing_lowered(lift - on_top + ploughs, touching, clear_time)
    carry[:, 2, 3] += lift
    if change is not None:
        carry[:, :3, 3] += change
    room = np.where(touching, 0.0, np.maximum(lift - needed, 0.0))
    return Placement(carry, lift, sinkage, room)


def _foremost(motion: SoleMotion, points: Array) -> int:
    """Index of the point (F, Q, 3) that lies farthest toward the toes."""
    return int(((points[0] - motion.transforms[0, 0, :3, 3]) @ motion.transforms[0, 0, :3, 0]).argmax())


def _lowest(points: Array, depth: float) -> Array:
    """Weight of each of the points (F, Q, 3) as one of the lowest, (F, Q), 1 in all.

    Points count that are higher by no more than about `depth`, in lengths of the sole.
    """
    height = points[..., 2] - points[..., 2].min(axis=1, keepdims=True)
    weight = np.exp(-height / (depth * max(float(np.ptp(points[0], axis=0).max()), 1e-9)))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def slide_offset(points: Array, touching: Mask) -> Array:
    """Level offset that takes out the sliding of a sole's lowest points during each contact, (F, 3) [m].

    Each contact is held where it is in its middle; between contacts the correction changes smoothly.
    """
    count = len(points)
    weight = _lowest(points, SLIDE_DEPTH)
    step = np.zeros((count, 3))
    step[1:] = np.einsum("fq,fqi->fi", (weight[1:] + weight[:-1]) / 2, np.diff(points, axis=0))
    step[:, 2] = 0.0
    offset = np.zeros((count, 3))
    for first, end in zip(*runs(touching), strict=True):
        slid = np.cumsum(np.concatenate([np.zeros((1, 3)), step[first + 1 : end]]), axis=0)
        offset[first:end] = slid[len(slid) // 2] - slid
    return between_contacts(offset, touching)


def _alignment(
    motion: SoleMotion,
    points: Array,
    touching: Mask,
    ground: PressedGround,
    undisturbed: PressedGround,
    frames: Array,
    width: float,
) -> Array:
    """Rotation vectors (F, 3) that turn the foot by the slope under it, against the slope that it was posed for."""
    heading = motion.transforms[:, 0, :2, 0]
    heading = heading / np.maximum(np.linalg.norm(heading, axis=1, keepdims=True), 1e-9)
    slope = _slope(points, ground, frames) - _posed_for(motion, points, touching, undisturbed, frames)
    left = np.stack([-heading[:, 1], heading[:, 0]], axis=-1)
    pitch = np.clip(np.sum(slope * heading, axis=1), -ANKLE_PITCH, ANKLE_PITCH)
    roll = np.clip(np.sum(slope * left, axis=1), -ANKLE_ROLL, ANKLE_ROLL)
    slope = pitch[:, None] * heading + roll[:, None] * left
    contact = np.flatnonzero(touching)
    now = np.arange(len(frames))
    slope = np.stack([np.interp(now, contact, slope[contact, i]) for i in range(2)], axis=-1)
    slope = smoothed(slope, width)
    return np.stack([slope[:, 1], -slope[:, 0], np.zeros(len(slope))], axis=-1)


def _slope(points: Array, ground: PressedGround, frames: Array) -> Array:
    when = np.broadcast_to(frames[:, None], points.shape[:2])
    heights = ground.heights(points[..., 0], points[..., 1], when)
    return fitted_slope(np.concatenate([points[..., :2], heights[..., None]], axis=-1), np.ones(heights.shape))


def _posed_for(motion: SoleMotion, points: Array, touching: Mask, undisturbed: PressedGround, frames: Array) -> Array:
    """Slope (F, 2) of the ground that the source's foot was posed for: in each contact level, or the terrain's own."""
    terrain = _slope(points, undisturbed, frames)
    posed = np.zeros_like(terrain)
    up = motion.transforms[:, 0, :3, 2]
    normal = np.concatenate([-np.tan(terrain), np.ones((len(terrain), 1))], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    to_terrain = np.arccos(np.clip(np.sum(up * normal, axis=1), -1, 1))
    to_level = np.arccos(np.clip(up[:, 2], -1, 1))
    for first, end in zip(*runs(touching), strict=True):
        if to_terrain[first:end].min() < to_level[first:end].min():
            posed[first:end] = terrain[first:end]
    return posed


def between_contacts(values: Array, touching: Mask, *, upward: bool = False, level: Array | float = 0.0) -> Array:
    """Values (F,) or (F, N) of the contacts, with a cubic from the end of each to the start of the next; the ends held.

    With `upward`, a value that falls at the end of a contact or will rise after the start of one does not go on so
    between them: a foot leaves its print upward and comes down on the next. Where it is `level`, (F,) from 0 to 1, it
    does not come down as fast as it sinks then: in deep ground that is sudden.
    """
    level = np.broadcast_to(level, len(values))
    starts, ends = runs(touching)
    result = values.copy()
    result[: starts[0]] = values[starts[0]]
    result[ends[-1] :] = values[ends[-1] - 1]
    for last, first in zip(ends[:-1] - 1, starts[1:], strict=True):
        gap = first - last
        u = (np.arange(1, gap) / gap).reshape(-1, *[1] * (values.ndim - 1))
        a, b = values[last], values[first]
        before = (a - values[last - 1]) * gap if last > 0 and touching[last - 1] else 0.0
        after = (values[first + 1] - b) * gap if first + 1 < len(values) and touching[first + 1] else 0.0
        steepest = 1.5 * np.maximum(np.abs(b - a), 1e-3)
        before = np.clip(before, 0.0 if upward else -steepest, steepest)
        after = np.clip(after, -steepest, 0.0 if upward else steepest) * (1.0 - level[first])
        result[last + 1 : first] = a + u * (
            before + u * (3 * (b - a) - 2 * before - after + u * (2 * (a - b) + before + after))
        )
    return result


def _swing_clearance(missing: Array, touching: Mask, reach: int) -> Array:
    """Further lift (F,) over obstacles between contacts, 0 at their ends [m]."""
    extra = np.zeros(len(missing))
    wanted = upper_envelope(np.where(touching | ~np.isfinite(missing), 0.0, np.maximum(missing, 0.0)), reach)
    distance = _frames_from_contact(touching)
    extra[~touching] = (wanted * smooth_step(distance / (reach + 1)))[~touching]
    return extra


def _swing_lowered(spare: Array, touching: Mask, time: float) -> Array:
    """Amount by which a foot that ploughs swings lower (F,) [m]: what is to spare, 0 at contacts."""
    distance = _frames_from_contact(touching) - 0.5  # between the frames
    return np.where(np.isfinite(spare), np.maximum(spare, 0.0), 0.0) * smooth_step(distance / time)


def _frames_from_contact(touching: Mask) -> Array:
    index = np.arange(len(touching))
    contact = np.flatnonzero(touching)
    place = np.searchsorted(contact, index)
    before = np.abs(index - contact[np.maximum(place - 1, 0)])
    after = np.abs(contact[np.minimum(place, len(contact) - 1)] - index)
    return np.minimum(before, after).astype(float)
