"""Contacts that the artist holds in another way: by the heel, by the ball, flat, or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from ..legs.foot_lock import Underside
from ..legs.foot_placement import PressedGround, between_contacts, posed_points
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from ..numerics.orientation import rotation_vectors
from ..numerics.plane_fit import fitted_slope
from ..numerics.rigid import carried, displacement, rotation, turn_between

HoldMode = Literal["ROLL", "HEEL", "BALL", "FLAT", "FULL"]
MODES: tuple[HoldMode, ...] = get_args(HoldMode)


@dataclass(frozen=True)
class FootHold:
    """The way in which one contact of a foot is held.

    Attributes
    ----------
    foot : str
        Name of the sole.
    frame : float
        Any scene frame of the contact.
    mode : 'ROLL', 'HEEL', 'BALL', 'FLAT' or 'FULL'
        The part that stays in its place: the bearing points, as the foot rolls over them; the heel or the ball; the
        bearing points of a foot that lies flat all the time; or the whole foot, as it is where it moves slowest.
    strength : float
        0 leaves the contact as it is in the source, 1 holds it.
    ease_in, ease_out : float
        Frames at its beginning and end over which the foot still comes to rest, and begins to leave.
    """

    foot: str
    frame: float
    mode: HoldMode = "ROLL"
    strength: float = 1.0
    ease_in: float = 0.0
    ease_out: float = 0.0


@dataclass(frozen=True)
class HeldContacts:
    """The contacts of one foot, each as it is to be held.

    Attributes
    ----------
    touching : (F,) bool array
    contacts : tuple of (slice, FootHold)
        Contacts that are held in another way than by their bearing points.
    missed : tuple of FootHold
        Those in whose frame the foot does not touch.
    """

    touching: Mask
    contacts: tuple[tuple[slice, FootHold], ...] = ()
    missed: tuple[FootHold, ...] = ()

    def standing(self, travels: Mask) -> Mask:
        """True while the foot is to stand still (F,): it touches, and does not travel (F,) in a contact that the artist
        does not hold."""
        stands = self.touching & ~travels
        for during, _ in self.contacts:
            stands[during] = self.touching[during]
        return stands

    @staticmethod
    def of(holds: Sequence[FootHold], foot: str, frames: Array, touching: Mask) -> HeldContacts:
        """Holds of a foot that touches (F,) at scene frames (F,); of two for one contact, the later in the list."""
        by_contact: dict[int, tuple[slice, FootHold]] = {}
        missed: list[FootHold] = []
        starts, ends = runs(touching)
        for hold in (each for each in holds if each.foot == foot):
            at = int(np.abs(frames - hold.frame).argmin())
            if not touching[at] or abs(frames[at] - hold.frame) > 1.0:
                missed.append(hold)
                continue
            number = int(np.searchsorted(starts, at, side="right")) - 1
            by_contact[number] = slice(int(starts[number]), int(ends[number])), hold
        return HeldContacts(touching, tuple(by_contact[number] for number in sorted(by_contact)), tuple(missed))

    def held(self, frames: Array, standing: Mask) -> Mask:
        """True while the foot is held, (F,): it stands (F,) and is not eased; at one frame of an eased contact at
        least."""
        held = standing.copy()
        for during, hold in self.contacts:
            since, until = frames[during] - frames[during][0], frames[during][-1] - frames[during]
            still = (since >= hold.ease_in) & (until >= hold.ease_out)
            if not still.any():
                still[np.abs(since - hold.ease_in - (until - hold.ease_out)).argmin()] = True
            held[during] = still
        return held

    def attitude(self, sole: SoleMotion, floor: PressedGround, frames: Array, held: Mask) -> Array:
        """Rigid displacements (F, 4, 4) that turn the foot about its middle: flat onto the floor, or to one pose."""
        turn, points = np.zeros((len(frames), 3)), posed_points(sole)
        middle = points.mean(axis=1)
        for during, hold in self.contacts:
            axes, at = sole.transforms[during, 0, :3, :3], during.start + _slowest(points[during])
            if hold.mode == "FLAT":
                turn[during] = turn_between(axes[..., 2], _normal(points[at], floor, frames[at]))
            elif hold.mode == "FULL":
                turn[during] = rotation_vectors(sole.transforms[at, 0, :3, :3] @ np.swapaxes(axes, -1, -2))
        if not turn.any():
            return np.broadcast_to(np.eye(4), (len(frames), 4, 4))
        turn = between_contacts(turn, held)
        return displacement(rotation(turn), middle, middle)

    def bearing(self, under: Underside, sole: SoleMotion) -> Array:
        """Weight of each point of an underside as held, (F, Q), 1 in all of a frame."""
        weight = under.bearing()
        for during, hold in self.contacts:
            if hold.mode == "FULL":
                weight[during] = 1.0 / weight.shape[1]
            elif hold.mode in ("HEEL", "BALL"):
                place = sole.landmark_positions()[during, 0 if hold.mode == "HEEL" else len(sole.sole.landmarks) // 2]
                nearest = np.linalg.norm(under.points[during] - place[:, None], axis=-1).mean(axis=0).argmin()
                weight[during] = np.arange(weight.shape[1]) == nearest
        return weight

    def faded(self, sole: SoleMotion, carry: Array) -> Array:
        """Displacements (F, 4, 4) of a foot by the strength of each contact, smoothly from one to the next."""
        if all(hold.strength == 1.0 for _, hold in self.contacts):
            return carry
        strength = np.ones(len(carry))
        for during, hold in self.contacts:
            strength[during] = hold.strength
        strength = between_contacts(strength, self.touching)
        middle = posed_points(sole).mean(axis=1)
        turn = rotation(strength[:, None] * rotation_vectors(carry[:, :3, :3]))
        return displacement(turn, middle, middle + strength[:, None] * (carried(carry, middle) - middle))


def _slowest(points: Array) -> int:
    """The frame of a contact in which the points (K, Q, 3) of its sole move least."""
    if len(points) < 2:
        return 0
    return int(np.linalg.norm(np.gradient(points, axis=0), axis=-1).mean(axis=1).argmin())


def _normal(points: Array, floor: PressedGround, frame: float) -> Array:
    """Normal of the floor under points (Q, 3), (3,); upward where there is none."""
    height = floor.heights(points[None, :, 0], points[None, :, 1], np.full((1, len(points)), frame))
    slope = fitted_slope(np.concatenate([points[None, :, :2], height[..., None]], axis=-1), np.ones(height.shape))[0]
    return np.array([-np.tan(slope[0]), -np.tan(slope[1]), 1.0])
