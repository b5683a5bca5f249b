"""Response of a character to the ground it presses: the composer of tilt and grounding (docs/model.md section 5)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..ground.hard_ground import through
from ..ground.heightfield import FlatTerrain, Terrain
from ..legs.foot_lock import moved
from ..legs.foot_placement import Placement, lowest_clearance, place_sole, posed_points
from ..legs.grounding import Response, has_ankle, heel_rises, leg_of, leg_soles, responding, settle, with_sole
from ..legs.one_piece import put_in_place
from ..legs.wading import DEPTH_TIME, body_depth
from ..loads.contacts import Contacts, detect_contacts
from ..motion.motion import CharacterMotion
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.interpolation import in_stretches
from ..numerics.plane_fit import fitted_slope, smoothed
from ..numerics.rigid import carried
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from ..record.ground_history import GroundHistory
from .moved_steps import Followed
from .performance import BENT, Performance, raised_arms, sinkage_over_time, swing_change
from .tilt import TiltGains, along_heading, lean, ring_around

HEADING_TIME = 0.25
"""Standard deviation of the smoothing of the direction in which a body walks [s], for an adult."""
SUPPORT_TIME = 0.04
"""Standard deviation of the smoothing of a body's support [s], for an adult: a foot loads and
unloads in about a tenth of a second."""
RING_WEIGHT = 0.15
"""Weight of a place of the ring around the body over one under a sole that stands."""


@dataclass(frozen=True)
class TiltOptions:
    """Options of the body's lean.

    Attributes
    ----------
    strength : float
        Part of the controller's lean that the body takes on.
    lateral : float
        The same of the lean across the direction of walking, 0 to 1 of the strength.
    """

    gains: TiltGains = field(default_factory=TiltGains)
    strength: float = 0.5
    lateral: float = 1.0


@dataclass(frozen=True)
class GroundingOptions:
    """Options of the feet on the ground.

    Attributes
    ----------
    align : float
        Share of the ground's slope that the feet take on, 0 to 1.
    lock : float
        Share of the source's sliding that is taken out of contacts, 0 to 1.
    performance : Performance
        Acting on top.
    """

    align: float = 1.0
    lock: float = 0.0
    performance: Performance = field(default_factory=Performance)


@dataclass(frozen=True)
class Gaps:
    """Distances of the lowest point of each sole from the ground while it touches.

    Attributes
    ----------
    frames : (K,) float array
        Scene frames.
    soles : (K,) int array
    heights : (K,) float array
        Positive where the sole floats, negative where it is in the ground [m].
    """

    frames: Array
    soles: NDArray[np.intp]
    heights: Array


@sliced
def respond(
    motion: CharacterMotion,
    touching: Mask,
    history: GroundHistory,
    *,
    tilt: TiltOptions | None,
    grounding: GroundingOptions | None,
    standing: Mask | None = None,
    followed: Followed | None = None,
) -> Slices[Response]:
    """The response to a ground that has been pressed.

    Parameters
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    touching : (F, S) bool array
        At scene frames.
    history : GroundHistory
        With all footprints that the ground holds, of all characters.
    standing : (F, S) bool array, optional
        Where grounded soles stand in their prints, if not as long as they touch (`leaving_early`).
    followed : Followed, optional
        Where moved steps take the feet; only with grounding.
    """
    leaning = np.zeros((len(motion.frames), 2))
    if tilt is not None:
        leaning = tilt.strength * _lean(motion, touching, history, tilt)
        yield
    if grounding is None:
        unmoved = {side: (sole, _unmoved(len(motion.frames))) for side, sole in leg_soles(motion).items()}
        in_place = np.ones_like(touching)  # feet stay where they are, in swings too
        return (yield from settle.slices(motion, unmoved, in_place, leaning))

    followed = followed or Followed()
    standing = touching if standing is None else standing
    solve = partial(_grounded.slices, motion, standing, history, leaning, grounding, followed)
    return (yield from put_in_place.slices(motion, standing, solve))


@sliced
def _grounded(
    motion: CharacterMotion,
    standing: Mask,
    history: GroundHistory,
    leaning: Array,
    grounding: GroundingOptions,
    followed: Followed,
    so_far: Mapping[str, Array],
) -> Slices[Response]:
    """See `respond`; feet start from where they are so far, (F, 4, 4) by side, or from the source."""
    undisturbed, feet = GroundHistory(history.terrain), leg_soles(motion)
    carries = {**followed.carries, **{feet[side]: carry for side, carry in so_far.items()}}

    def place(side: str, heel_rise: Array | None = None, change: Array | None = None) -> Slices[None]:
        yield
        sole = feet[side]
        carry = carries.get(sole)
        placed = place_sole(
            motion if carry is None else with_sole(motion, sole, moved(motion.soles[sole], carry)),
            sole,
            standing[:, sole],
            history,
            undisturbed,
            align=grounding.align if has_ankle(motion, side) else 0.0,
            lock=grounding.lock,
            heel_rise=heel_rise,
            change=change,
        )
        if carry is not None:
            middle = motion.soles[sole].landmark_positions().mean(axis=1)
            lift = placed.lift + (carried(carry, middle) - middle)[:, 2]
            placed = replace(placed, carry=placed.carry @ carry, lift=lift)
        placements[side] = sole, placed

    placements: dict[str, tuple[int, Placement]] = {}
    for side in feet:
        yield from place(side)
    acted, crouch, arms = _acted(motion, standing, placements, grounding.performance)
    for side, change in acted.items():
        yield from place(side, change=change)
    rises = heel_rises(motion, placements, standing, leaning, crouch=crouch, level=followed.hips)
    for side, rise in rises.items():
        if rise.any():
            yield from place(side, rise, acted.get(side))
    settled = yield from settle.slices(motion, placements, standing, leaning, crouch=crouch, level=followed.hips)
    return replace(settled, arms=arms)


def _acted(
    motion: CharacterMotion, touching: Mask, placements: Mapping[str, tuple[int, Placement]], acting: Performance
) -> tuple[dict[str, Array], Array | None, dict[str, Array]]:
    """Acting on top: displacement of each foot, descent of the hips, and rotations that raise the arms."""
    if acting.is_none or not placements:
        return {}, None, {}
    depths = {
        side: sinkage_over_time(placement.sinkage, touching[:, sole]) for side, (sole, placement) in placements.items()
    }
    depth = body_depth(depths, DEPTH_TIME * motion.adult_second)
    feet = {
        side: swing_change(leg_of(motion, side, sole).ankle, depths[side], touching[:, sole], acting, motion.leg_length)
        for side, (sole, _) in placements.items()
        if acting.knee_lift or acting.hold
    }
    shoulders = {side: motion.joints[f"shoulder_{side}"] for side in "lr" if f"shoulder_{side}" in motion.joints}
    arms = raised_arms(shoulders, _heading(motion), depth, acting.arms, motion.leg_length) if acting.arms else {}
    return feet, acting.crouch * BENT * depth, arms


def mean_sinkage(footprints: Sequence[Footprint], character: str) -> float:
    """Mean depth of a character's prints [m]."""
    depths = [footprint.max_depth_m for footprint in footprints if footprint.character == character]
    return float(np.mean(depths)) if depths else 0.0


def _unmoved(count: int) -> Placement:
    return Placement(np.broadcast_to(np.eye(4), (count, 4, 4)), np.zeros(count), np.zeros(count), np.zeros(count))


def _lean(motion: CharacterMotion, touching: Mask, history: GroundHistory, tilt: TiltOptions) -> Array:
    slope = along_heading(seen_slope(motion, touching, history), _heading(motion), tilt.lateral)
    return lean(slope, frame_rate=motion.frame_rate, gains=tilt.gains, supported=_support(motion, touching))


def _support(motion: CharacterMotion, touching: Mask) -> Array:
    """Support of the body (F,), from 0 to 1."""
    width = SUPPORT_TIME * motion.adult_second
    return smoothed(touching.any(axis=1).astype(float), width)


def seen_slope(motion: CharacterMotion, touching: Mask, history: GroundHistory) -> Array:
    """Slope of the ground that carries the body (F, 2) [rad], at each frame as it stood one frame before."""
    ring = ring_around(motion.hips[:, :2], motion.leg_length)
    soles = [posed_points(sole)[..., :2] for sole in motion.soles]
    places = np.concatenate([*soles, ring], axis=1)
    weights = [np.broadcast_to(touching[:, i, None], part.shape[:2]) / part.shape[1] for i, part in enumerate(soles)]
    weight = np.concatenate([*weights, np.full(ring.shape[:2], RING_WEIGHT)], axis=1)
    before = motion.frames - motion.time_step * motion.frame_rate
    heights = history.heights(places[..., 0], places[..., 1], np.broadcast_to(before[:, None], weight.shape))
    return fitted_slope(np.concatenate([places, heights[..., None]], axis=-1), weight)


def _heading(motion: CharacterMotion) -> Array:
    """Level direction in which the body walks (F, 2), where its feet point while it stands."""
    width = HEADING_TIME * motion.adult_second
    path = smoothed(motion.hips[:, :2], width)
    velocity = np.gradient(path, axis=0) * motion.frame_rate if len(path) > 1 else np.zeros_like(path)
    feet = np.mean([sole.transforms[:, 0, :2, 0] for sole in motion.soles], axis=0)
    slow = 0.05 * motion.froude_speed
    direction = velocity + slow * smoothed(feet, width)
    return np.asarray(direction / np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9))


@sliced
def gaps(
    motion: CharacterMotion,
    touching: Mask,
    history: GroundHistory,
    posed: Callable[[SoleMotion], Array] = posed_points,
) -> Slices[Gaps]:
    """Distance of the lowest of each standing sole's `posed` points from the ground as it is at that frame."""
    frames, soles, heights = [], [], []
    for index, sole in enumerate(motion.soles):
        yield
        stands = np.flatnonzero(touching[:, index])
        clearance = _clearance(sole, posed, stands, motion.frames[stands], history)
        known = np.isfinite(clearance)
        frames.append(motion.frames[stands][known])
        soles.append(np.full(int(known.sum()), index))
        heights.append(clearance[known])
    return Gaps(np.concatenate(frames), np.concatenate(soles), np.concatenate(heights))


def _clearance(
    sole: SoleMotion,
    posed: Callable[[SoleMotion], Array],
    samples: NDArray[np.intp],
    frames: Array,
    history: GroundHistory,
) -> Array:
    """Height of a sole's lowest point above the ground at some of its samples, which are at these frames, (K,) [m]."""

    def during(part: slice) -> Array:
        points = posed(replace(sole, transforms=sole.transforms[samples[part]]))
        return lowest_clearance(points, history, frames[part])

    return in_stretches(during, len(samples))


@sliced
def stood_on(motion: CharacterMotion, terrain: Terrain) -> Slices[CharacterMotion]:
    """The motion on the terrain: unchanged if it was made for it, else put on it.

    A walk that was made for level ground and is placed on a hill or on bumps touches nothing as it is. Its contacts
    are those with the level that it was made for; its feet keep the heights above the terrain that they had above the
    level, and hips and legs follow.
    """
    if not _is_uneven(motion, terrain):
        return motion
    made_for = _contacts_with_level(motion)
    yield
    if made_for is None or not _fits_better(motion, made_for, detect_contacts(motion, through(terrain))):
        return motion
    yield
    ground = GroundHistory(terrain)
    placements = {}
    for side, sole in leg_soles(motion).items():
        yield
        as_made = np.maximum(made_for.clearance[:, sole], 0.0)
        placements[side] = (
            sole,
            place_sole(
                motion,
                sole,
                made_for.touching[:, sole],
                ground,
                ground,
                clearance=np.where(np.isfinite(as_made), as_made, 0.0),
            ),
        )
    level_body = np.zeros((len(motion.frames), 2))
    return responding(motion, (yield from settle.slices(motion, placements, made_for.touching, level_body)))


_LEVEL = 0.005
"""Difference of height up to which ground counts as level, in leg lengths."""
_SAME_GROUND = 0.015
"""Spread of the standing soles' clearance up to which a motion was made for a ground, in leg lengths."""
_SHORTER = 0.8
"""A motion touches the ground it was made for at least for so much of the time that it touches any level."""


def _is_uneven(motion: CharacterMotion, terrain: Terrain) -> bool:
    """True if the ground under the paths of the soles is not level."""
    paths = np.concatenate([sole.landmark_positions().reshape(-1, 3) for sole in motion.soles])
    heights = terrain.heights(paths[:, 0], paths[:, 1])
    heights = heights[np.isfinite(heights)]
    return bool(len(heights) and np.ptp(heights) >= _LEVEL * motion.leg_length)


def _contacts_with_level(motion: CharacterMotion) -> Contacts | None:
    """Contacts with the level that the soles stand on; None where they stand at no one height."""
    lowest = [sole.landmark_positions()[..., 2].min(axis=1) for sole in motion.soles]
    low = float(np.median([np.percentile(height, 10.0) for height in lowest]))
    contacts = detect_contacts(motion, FlatTerrain(low))  # which takes out the float of each sole
    return contacts if np.isfinite(contacts.offset).all() else None


def _fits_better(motion: CharacterMotion, level: Contacts, terrain: Contacts) -> bool:
    """True if the motion was made for one level rather than for the terrain, by its contacts with both."""
    standing = terrain.clearance[terrain.touching]
    spread = float(np.std(standing)) if len(standing) else 0.0
    return bool(len(standing) < _SHORTER * level.touching.sum() or spread > _SAME_GROUND * motion.leg_length)


def at_scene_frames(touching: Mask, frames: Array, motion: CharacterMotion) -> Mask:
    """States (N, S) of the simulation's time grid at the scene frames of a motion, (F, S).

    A sole that leaves within the half frame after a scene frame is seen leaving at it.
    """
    ahead = np.array([0.0, 0.5 * motion.time_step * motion.frame_rate])
    index = np.searchsorted(frames, motion.frames[:, None] + ahead - 1e-6)
    return np.asarray(touching[np.minimum(index, len(frames) - 1)].all(axis=1))
