"""Hips and legs that follow the soles: descent of the body and displacement of each part of each leg."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..motion.motion import CharacterMotion
from ..motion.people import leg_sides
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.orientation import rotation_vectors
from ..numerics.plane_fit import smoothed, upper_envelope
from ..numerics.rigid import carried, displacement, rotation, unit
from ..numerics.slices import Slices, sliced
from .foot_placement import Placement
from .hips import HIPS_TIME, hips_follow, hips_go_along, wading_depth
from .knee_pace import PacedLeg, follow, relieve
from .legs import Leg, solve

ON_THE_ANKLE = 0.4
"""A sole whose middle stays this near to the ankle is the foot's, in leg lengths."""
RIGID = 0.05
"""Largest movement against the ankle of a contact shape that is worn on the foot, in leg lengths."""
ONE_PIECE = 1e-3
"""Largest movement of the sole at the end of a shank as seen from the knee, in leg lengths: single precision."""
SHORT_SHANK = 0.4
"""Shanks are no shorter than this, over the thigh: a foot under its ankle is about a fifth of its shank."""
TIPTOES = 0.7
"""A sole of a side that moves with the ankle is the foot's up to here: toes of cartoon feet, as long as their legs, in
leg lengths."""
KNEE_TIME = 0.06
"""Standard deviation of the smoothing of the direction of nearly straight knees [s], for an adult."""
HEEL_TIME = 0.06
"""Time before and after in which a heel rises into the leg's reach [s], for an adult."""
NEAR_ENOUGH = 0.002
"""Gap that a leg may be short by without rolling over the toes, in leg lengths."""
REACH_TIME = 0.15
"""Time before and after in which the hips come down into the legs' reach [s], for an adult."""
HEEL_RISE = np.radians(35.0)
"""A foot rolls over its toes by at most so much further than in the source before the hips come down [rad]."""
BEHIND = 0.15
"""A foot this far behind its hip rolls over its toes as far as it needs, one below or before it not, in leg lengths."""
COMFORTABLE_REACH = 0.985
"""A leg may stretch so far, over its length, or as far as in the source where that is more."""


@dataclass(frozen=True)
class LegResponse:
    """Rigid displacements of the parts of one leg from the source, (F, 4, 4)."""

    thigh: Array
    shank: Array
    foot: Array


@dataclass(frozen=True)
class Response:
    """Response of a character to the ground: rigid displacements of its parts in the world, on top of the source.

    Attributes
    ----------
    frames : (F,) float array
        Scene frames.
    body : (F, 4, 4) float array
        Of hips, trunk, head and arms.
    legs : mapping of str to LegResponse
        By side: "l" and "r", of further pairs "l2" and "r2".
    lean : (F, 2) float array
        Angle that the body leans toward +x and +y [rad].
    arms : mapping of str to (F, 4, 4) float array
        Displacements of the upper arms before that of `body`, by side; empty if none.
    """

    frames: Array
    body: Array
    legs: Mapping[str, LegResponse]
    lean: Array
    arms: Mapping[str, Array] = field(default_factory=dict)

    @property
    def is_none(self) -> bool:
        """True if nothing moves."""
        parts = [self.body, *(part for leg in self.legs.values() for part in (leg.thigh, leg.shank, leg.foot))]
        return all(np.allclose(part, np.eye(4), atol=1e-7) for part in (*parts, *self.arms.values()))


def leg_soles(motion: CharacterMotion) -> dict[str, int]:
    """Sole that each leg stands on, by side: the lowest of those that go with the foot.

    A leg without an ankle, as of figures made of blocks, stands on the end of its shank: foot and shank are of one
    piece.
    """
    by_side: dict[str, int] = {}
    for side in leg_sides(motion.joints):
        worn = [index for index, sole in enumerate(motion.soles) if _goes_with(motion, sole, side)]
        if worn:
            by_side[side] = min(worn, key=lambda index: float(motion.soles[index].landmark_positions()[..., 2].mean()))
    return by_side


def has_ankle(motion: CharacterMotion, side: str) -> bool:
    """True if the foot of a leg turns against its shank.

    An ankle that no sole goes with is none where one goes with the shank: the IK target of a leg without a foot.
    """
    if f"ankle_{side}" not in motion.joints:
        return False
    if any(_is_on_ankle(motion, sole, side) for sole in motion.soles):
        return True
    return not any(_is_end_of_shank(motion, sole, side) for sole in motion.soles)


def leg_of(motion: CharacterMotion, side: str, sole: int) -> Leg:
    """The joints of one leg; of one without an ankle, the middle of its sole is in the ankle's place."""
    joints, stands = motion.joints, motion.soles[sole]
    return Leg(
        joints[f"hip_{side}"],
        joints[f"knee_{side}"],
        joints[f"ankle_{side}"] if has_ankle(motion, side) else stands.landmark_positions().mean(axis=1),
        stands.transforms[:, 0, :3, 0],
    )


@sliced
def settle(
    motion: CharacterMotion,
    placements: Mapping[str, tuple[int, Placement]],
    touching: Mask,
    lean: Array,
    *,
    crouch: Array | None = None,
    level: Array | None = None,
) -> Slices[Response]:
    """Bring the hips to where they belong and solve the legs.

    Parameters
    ----------
    motion : CharacterMotion
        The source, at scene frames.
    placements : mapping of str to (int, Placement)
        By side: the leg's sole and where it belongs.
    touching : (F, S) bool array
    lean : (F, 2) float array
        Angle that the body leans toward +x and +y [rad], pivoting about the ground below the hips.
    crouch : (F,) float array, optional
        Further descent of the hips, by choice [m].
    level : (F, 2) float array, optional
        Movement of the hips along the ground [m].
    """
    tilted, raised = _hips_moved(motion, placements, touching, lean, crouch, level)
    legs, ankles = _legs_of(motion, placements)
    short = np.zeros(len(motion.frames))
    for side, leg in legs.items():
        hip = carried(tilted, leg.hip) + raised
        short = np.maximum(short, touching[:, placements[side][0]] * out_of_reach(leg, hip, ankles[side]))
    reach = round(REACH_TIME * motion.adult_second)
    raised[:, 2] -= upper_envelope(short, max(1, reach))
    feet: Mapping[str, Array] = {}
    if legs:
        hips = {side: carried(tilted, leg.hip) + raised for side, leg in legs.items()}
        paced = _paced(legs, placements, touching, hips, ankles)
        relief = yield from relieve.slices(
            paced,
            step=motion.time_step,
            time_scale=motion.time_scale,
            leg_length=motion.leg_length,
            wading=wading_depth(motion, dict(placements.values()), touching)[1],
        )
        raised, feet = raised + relief.hips, relief.feet
    body = tilted.copy()
    body[:, :3, 3] += raised
    return Response(motion.frames, body, _solved(motion, placements, body, feet), lean)


@sliced
def stand(
    motion: CharacterMotion, placements: Mapping[str, tuple[int, Placement]], touching: Mask, stands: Mask
) -> Slices[Response]:
    """Let the hips follow feet with little jerk and solve the legs; see `settle`.

    Parameters
    ----------
    touching, stands : (F, S) bool arrays
        When soles may not give way, and when the hips follow them.
    """
    legs, ankles = _legs_of(motion, placements)
    soles, offsets = [sole for sole, _ in placements.values()], [ankles[side] - leg.ankle for side, leg in legs.items()]
    hips = {side: leg.hip for side, leg in legs.items()}
    relief = yield from follow.slices(
        _paced(legs, placements, touching, hips, ankles),
        hips_go_along(motion, soles, offsets, stands, HIPS_TIME),
        step=motion.time_step,
        time_scale=motion.time_scale,
        leg_length=motion.leg_length,
    )
    body = np.broadcast_to(np.eye(4), (len(motion.frames), 4, 4)).copy()
    body[:, :3, 3] = relief.hips
    solved = _solved(motion, placements, body, relief.feet, KNEE_TIME * motion.adult_second)
    return Response(motion.frames, body, solved, np.zeros((len(motion.frames), 2)))


def _legs_of(
    motion: CharacterMotion, placements: Mapping[str, tuple[int, Placement]]
) -> tuple[dict[str, Leg], dict[str, Array]]:
    """The source's legs, and where their ankles belong (F, 3) [m], by side."""
    legs = {side: leg_of(motion, side, sole) for side, (sole, _) in placements.items()}
    return legs, {side: carried(placements[side][1].carry, leg.ankle) for side, leg in legs.items()}


def _paced(
    legs: Mapping[str, Leg],
    placements: Mapping[str, tuple[int, Placement]],
    touching: Mask,
    hips: Mapping[str, Array],
    ankles: Mapping[str, Array],
) -> dict[str, PacedLeg]:
    return {
        side: PacedLeg(leg, hips[side], ankles[side], reach_of(leg), touching[:, sole], placement.room)
        for (side, leg), (sole, placement) in zip(legs.items(), placements.values(), strict=True)
    }


def _solved(
    motion: CharacterMotion,
    placements: Mapping[str, tuple[int, Placement]],
    body: Array,
    feet: Mapping[str, Array],
    steady: float = 0.0,
) -> dict[str, LegResponse]:
    """Legs that reach from a body (F, 4, 4) to feet, each (F,) nearer to its hip [m]."""
    responses = {}
    legs, ankles = _legs_of(motion, placements)
    for side, leg in legs.items():
        hip = carried(body, leg.hip)
        solved = solve(leg, hip, ankles[side] + feet[side][:, None] * unit(hip - ankles[side]), steady)
        foot = placements[side][1].carry.copy()
        foot[:, :3, 3] += carried(solved.shank, leg.ankle) - ankles[side]
        shank = solved.shank
        if not has_ankle(motion, side):
            foot = shank = _turned_as(foot, shank, leg)
        responses[side] = LegResponse(solved.thigh, shank, foot)
    return responses


def _turned_as(foot: Array, shank: Array, leg: Leg) -> Array:
    """A shank (F, 4, 4) turned about its own length as far as a foot (F, 4, 4) that is of one piece with it."""
    ankle = carried(shank, leg.ankle)
    axis = unit(carried(shank, leg.knee) - ankle)
    more = rotation_vectors(foot[:, :3, :3] @ np.swapaxes(shank[:, :3, :3], -1, -2))
    return displacement(rotation(np.sum(more * axis, axis=-1, keepdims=True) * axis), ankle, ankle) @ shank


def heel_rises(
    motion: CharacterMotion,
    placements: Mapping[str, tuple[int, Placement]],
    touching: Mask,
    lean: Array,
    *,
    crouch: Array | None = None,
    level: Array | None = None,
) -> dict[str, Array]:
    """Angle by which each trailing foot rolls over its toes to stay in reach (F,) [rad], by side; see `settle`."""
    tilted, raised = _hips_moved(motion, placements, touching, lean, crouch, level)
    trial = np.linspace(0.0, HEEL_RISE, 8)
    width = round(HEEL_TIME * motion.adult_second)
    rises = {}
    for side, (sole, placement) in placements.items():
        leg = leg_of(motion, side, sole)
        hip, ankle = carried(tilted, leg.hip) + raised, carried(placement.carry, leg.ankle)
        foot = placement.carry[:, :3, :3] @ motion.soles[sole].transforms[:, 0, :3, :3]
        toes = carried(placement.carry, motion.soles[sole].landmark_positions()[:, -1])
        short = np.stack(
            [
                out_of_reach(leg, hip, carried(displacement(rotation(angle * foot[..., 1]), toes, toes), ankle))
                for angle in trial
            ]
        )
        enough = short <= NEAR_ENOUGH * motion.leg_length
        angle = trial[np.where(enough.any(axis=0), enough.argmax(axis=0), short.argmin(axis=0))]
        level = foot[:, :2, 0] / np.maximum(np.linalg.norm(foot[:, :2, 0], axis=1, keepdims=True), 1e-9)
        behind = np.sum((hip - ankle)[:, :2] * level, axis=1) / (BEHIND * motion.leg_length)
        rises[side] = smoothed(upper_envelope(angle * np.clip(behind, 0.0, 1.0), width), width / 2)
    return rises


def _hips_moved(
    motion: CharacterMotion,
    placements: Mapping[str, tuple[int, Placement]],
    touching: Mask,
    lean: Array,
    crouch: Array | None,
    level: Array | None,
) -> tuple[Array, Array]:
    """The body's tilt about the ground below the hips (F, 4, 4), and the movement of the hips after it (F, 3) [m]."""
    raised = np.zeros((len(motion.frames), 3))
    raised[:, 2] = hips_follow(motion, dict(placements.values()), touching)
    if crouch is not None:
        raised[:, 2] -= crouch
    if level is not None:
        raised[:, :2] += level
    turn = rotation(np.stack([-lean[:, 1], lean[:, 0], np.zeros(len(lean))], axis=-1))
    pivot = motion.hips - (0.0, 0.0, motion.leg_length)
    return displacement(turn, pivot, pivot), raised


def out_of_reach(leg: Leg, hip: Array, ankle: Array, during: slice = slice(None)) -> Array:
    """Descent of the hip that brings the ankle in reach, (..., F) [m], of places (..., F, 3)."""
    reach = reach_of(leg)[during]
    level = np.linalg.norm((ankle - hip)[..., :2], axis=-1)
    below = hip[..., 2] - ankle[..., 2]
    return np.asarray(np.where(below > 0, below - np.sqrt(np.maximum(reach**2 - level**2, 0.0)), 0.0).clip(min=0.0))


def reach_of(leg: Leg) -> Array:
    """Largest distance of an ankle from its hip, (F,) [m]."""
    return leg.length * np.maximum(leg.extension, COMFORTABLE_REACH)


def responding(motion: CharacterMotion, response: Response) -> CharacterMotion:
    """The motion with the response on top of it."""
    carry_of_joint: dict[str, Array] = {
        f"{joint}_{side}": part
        for side, leg in response.legs.items()
        for joint, part in (
            ("hip", response.body),
            ("knee", leg.thigh),
            ("ankle", leg.shank),
            ("ball", leg.foot),
            ("toe", leg.foot),
        )
    }
    for side, arm in response.arms.items():
        carry_of_joint |= {f"{joint}_{side}": response.body @ arm for joint in ("shoulder", "elbow", "wrist")}
    joints = {name: carried(carry_of_joint.get(name, response.body), path) for name, path in motion.joints.items()}
    soles = []
    for sole in motion.soles:
        worn_by = next((side for side in response.legs if _goes_with(motion, sole, side)), None)
        carry = response.legs[worn_by].foot if worn_by else response.body
        soles.append(SoleMotion(sole.sole, carry[:, None] @ sole.transforms))
    return dataclasses.replace(motion, joints=joints, soles=tuple(soles))


def with_sole(motion: CharacterMotion, number: int, sole: SoleMotion) -> CharacterMotion:
    """The motion with another course of one of its soles."""
    soles = tuple(sole if index == number else other for index, other in enumerate(motion.soles))
    return dataclasses.replace(motion, soles=soles)


def with_legs(motion: CharacterMotion, joints: Mapping[str, Array]) -> CharacterMotion:
    """The motion with the joints (F, 3) of further legs; where these are all its legs, it is as large as they are."""
    known, legs = leg_sides(motion.joints), dataclasses.replace(motion, joints={**motion.joints, **joints})
    lengths = [leg_of(legs, side, sole).length.mean() for side, sole in leg_soles(legs).items()]
    return legs if known or not lengths else dataclasses.replace(legs, leg_length=float(np.mean(lengths)))


def _goes_with(motion: CharacterMotion, sole: SoleMotion, side: str) -> bool:
    """True if a sole is the foot of a side, or worn on it such as a snowshoe."""
    if sole.sole.side.lower() not in (side[0], ""):
        return False
    return (_is_on_ankle if has_ankle(motion, side) else _is_end_of_shank)(motion, sole, side)


def _is_on_ankle(motion: CharacterMotion, sole: SoleMotion, side: str) -> bool:
    """True if a sole is near the ankle of a side, or moves with it, and no other ankle of its side is nearer."""
    middle, own = sole.landmark_positions().mean(axis=1), sole.sole.side.lower()
    legs = [side, *(leg for leg in leg_sides(motion.joints) if own in ("", leg[0]))]
    ankles = [motion.joints[f"ankle_{leg}"] for leg in legs if f"ankle_{leg}" in motion.joints]
    away = [np.linalg.norm(middle - ankle, axis=-1) for ankle in ankles]
    distance = away[0]
    if distance.mean() > min(float(each.mean()) for each in away):
        return False
    is_near = float(distance.mean()) <= ON_THE_ANKLE * motion.leg_length
    is_rigid = float(np.ptp(distance)) < RIGID * motion.leg_length
    if not sole.sole.side:
        return is_near and is_rigid
    return is_near or (is_rigid and float(distance.mean()) <= TIPTOES * motion.leg_length)


def _is_end_of_shank(motion: CharacterMotion, sole: SoleMotion, side: str) -> bool:
    """True if a sole keeps its place as seen from the knee, as far from it as the end of a shank is, and no other knee
    is nearer."""
    middle = sole.landmark_positions().mean(axis=1)
    knees = [motion.joints[f"knee_{leg}"] for leg in (side, *leg_sides(motion.joints))]
    this, *both = (np.linalg.norm(middle - knee, axis=-1) for knee in knees)
    thigh = float(np.linalg.norm(knees[0] - motion.joints[f"hip_{side}"], axis=-1).mean())
    is_rigid, is_shank = float(np.ptp(this)) < ONE_PIECE * motion.leg_length, float(this.mean()) > SHORT_SHANK * thigh
    return is_rigid and is_shank and float(this.mean()) <= min(float(far.mean()) for far in both)
