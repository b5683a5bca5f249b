"""Ground reaction forces on the soles of one character.

Two models (docs/model.md section 3): the paper's impulse model, causal, and the whole-body model.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..dynamics.body_dynamics import BodyDynamics, body_dynamics, with_flight
from ..dynamics.centre_of_mass import centre_of_mass
from ..dynamics.centre_of_pressure import centres_of_pressure, lowest_points
from ..dynamics.load_sharing import point_of_action, share_by_moment, whole_body_shares
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Mask
from ..numerics.intervals import runs
from .contacts import Contacts

UP = np.array([0.0, 0.0, 1.0])

RESTING_FRACTION = 0.014
"""Least share of a sole that touches: a foot's own mass, of the body mass (de Leva 1996)."""
LOWEST_MEETING = 0.5
"""Least height above the ground at which forces meet, in leg lengths: a body that lies presses straight down."""


@dataclass(frozen=True)
class ContactForces:
    """Forces of the ground on every sole at each step.

    Attributes
    ----------
    forces : (N, S, 3) float array
        Ground reaction force on each sole [N].
    total : (N, 3) float array
        Their sum [N].
    centre_of_pressure : (N, S, 3) float array
        Where each force acts, on the sole's underside [m].
    weight : (N, S) float array
        Part of the vertical force that carries the weight, for display [N].
    momentum : (N, S) float array
        The rest of it: what stops a landing sole or accelerates the body, for display [N].
    """

    forces: Array
    total: Array
    centre_of_pressure: Array
    weight: Array
    momentum: Array

    def during(self, steps: slice) -> ContactForces:
        """The forces at some of the steps."""
        return ContactForces(*(getattr(self, field.name)[steps] for field in dataclasses.fields(self)))

    def of(self, bearing: Mask) -> ContactForces:
        """The forces of those soles alone that bear, (N, S)."""
        forces = self.forces * bearing[..., None]
        weight, momentum = self.weight * bearing, self.momentum * bearing
        return dataclasses.replace(self, forces=forces, total=forces.sum(axis=1), weight=weight, momentum=momentum)


def impulse_forces(motion: CharacterMotion, contacts: Contacts, characteristic_time: float) -> ContactForces:
    """The paper's model, Eq. 3-8 with the corrections 1, 5 and 6 of docs/model.md section 2.

    The weight is split by the projection of the centre of mass on the segment between the soles; a sole that lands
    with velocity v into the ground adds share·mass·v/tau from the moment of contact on for tau. Causal: each step
    depends on the steps before it only.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    contacts : Contacts
        Of that motion.
    characteristic_time : float
        tau of the ground [s].

    Returns
    -------
    ContactForces
        A sole's momentum part lasts only while it touches.
    """
    pressure = lowest_points(motion)
    share = share_by_moment(pressure[..., :2], centre_of_mass(motion)[:, :2], contacts.touching)
    share = np.where(contacts.touching, np.maximum(share, RESTING_FRACTION), 0.0)
    share /= np.maximum(share.sum(axis=1, keepdims=True), RESTING_FRACTION)
    centre = centre_of_mass(motion)
    upward = np.maximum(motion.upward(centre, np.gradient(centre, motion.time_step, axis=0))[..., 2], 0.0)
    weight = share * motion.mass * motion.gravity * np.reshape(upward, (-1, 1))
    momentum = share * motion.mass * _landing_deceleration(motion, contacts, characteristic_time)
    forces = (weight + momentum)[..., None] * UP
    return ContactForces(forces, forces.sum(axis=1), pressure, weight, momentum)


def whole_body_forces(
    motion: CharacterMotion,
    contacts: Contacts,
    body: BodyDynamics | None = None,
    *,
    cutoff_factor: float = 1.0,
) -> ContactForces:
    """Forces that accelerate the centre of mass as the motion shows: m·(g + a_com), where something touches.

    Parameters
    ----------
    motion : CharacterMotion
        On the simulation's time grid.
    contacts : Contacts
        Of that motion, best after `refine_contacts`.
    body : BodyDynamics, optional
        Of that motion, where it is known already.
    cutoff_factor : float
        See `body_dynamics`.

    Returns
    -------
    ContactForces
        None pulls; they are 0 where nothing touches.
    """
    grounded = contacts.touching.any(axis=1)
    body = body or body_dynamics(motion, ~grounded, cutoff_factor=cutoff_factor)
    body = with_flight(motion, body, ~grounded, cutoff_factor=cutoff_factor)
    body_weight = motion.mass * motion.gravity
    total = np.where((grounded & (body.force[:, 2] > 0))[:, None], body.force, 0.0)
    lowest = lowest_points(motion)
    share = _with_idle(whole_body_shares(motion, lowest, contacts.touching, body), contacts.touching)
    target = point_of_action(motion, lowest, contacts.touching, body)
    pressure = centres_of_pressure(motion, lowest, share, target, np.clip(total[:, 2], 0.0, 1.0))
    forces = body_weight * share[..., None] * total[:, None]
    forces[..., :2] += forces[..., 2:] * _along_legs(motion, body.centre, share, pressure)
    weight = np.minimum(body_weight * share, forces[..., 2])
    return ContactForces(forces, forces.sum(axis=1), pressure, weight, forces[..., 2] - weight)


def _with_idle(share: Array, touching: NDArray[np.bool_]) -> Array:
    """Shares (N, S) in which what touches without any load bears a foot's own mass."""
    idle = np.zeros_like(touching)
    for sole in range(touching.shape[1]):
        for first, last in zip(*runs(touching[:, sole]), strict=True):
            idle[first:last, sole] = share[first:last, sole].max() < RESTING_FRACTION
    if not idle.any():
        return share
    least = np.where(idle, RESTING_FRACTION, share)
    return np.asarray(least / np.maximum(least.sum(axis=1, keepdims=True), RESTING_FRACTION))


def _along_legs(motion: CharacterMotion, centre: Array, share: Array, pressure: Array) -> Array:
    """Lean of each force beyond that of their sum, (N, S, 2): legs push along themselves.

    Feet that bear together push against each other so that their forces meet above the body's centre (Maus et al. 2010,
    "Upright human gait did not provide a major mechanical challenge for our ancestors", Nature Communications 1,
    doi:10.1038/ncomms1073), each as far from there as its hip is from the other.
    """
    toward = -pressure[..., :2]
    hips = [motion.joints.get(f"hip_{side}") for side in "lr"]
    if hips[0] is not None and hips[1] is not None and not motion.four_legged:
        half = (hips[0] - hips[1])[:, :2] / 2
        for index, sole in enumerate(motion.soles):
            toward[:, index] += {"L": half, "R": -half}.get(sole.sole.side, 0.0)
    height = centre[:, 2] - np.einsum("ns,ns->n", share, pressure[..., 2])
    lean = toward / np.maximum(height, LOWEST_MEETING * motion.leg_length)[:, None, None]
    return lean - np.einsum("ns,nsc->nc", share, lean)[:, None]


def _landing_deceleration(motion: CharacterMotion, contacts: Contacts, characteristic_time: float) -> Array:
    """v_n/tau of each sole's last landing, for tau after it, (N, S) [m/s²]."""
    step = motion.time_step
    deceleration = np.zeros(contacts.touching.shape)
    for sole, first, last, speed in _landings(motion, contacts):
        # The part of each step that lies within tau, so that the impulse is mass·v at any frame rate.
        lasting = np.clip(characteristic_time / step - np.arange(last - first), 0.0, 1.0)
        deceleration[first:last, sole] = speed / characteristic_time * lasting
    return deceleration


def _landings(motion: CharacterMotion, contacts: Contacts) -> Iterator[tuple[int, int, int, float]]:
    """Sole, first and last step of each contact that begins within the motion, and its speed into the ground [m/s],
    by the unit in which it falls with gravity.

    The speed is that of the step before the first one that touches.
    """
    for index, sole in enumerate(motion.soles):
        points = sole.landmark_positions()
        for first, last in zip(*runs(contacts.touching[:, index]), strict=True):
            if first < 2:
                continue  # it stood from the beginning, or landed too early to have a velocity
            normal = contacts.normal[first, index]
            landmark = (points[first] @ normal).argmin()
            into_ground = (points[first - 2, landmark] - points[first - 1, landmark]) @ normal / motion.time_step
            yield index, int(first), int(last), max(float(into_ground), 0.0) * motion.gravity / motion.fall
