"""Estimate of loads from a character's motion: contacts and forces on the simulation's time grid.

One of four ways, by what is known: a motion that jumps is estimated part by part; a body that is a prop (`centre`)
falls freely between its contacts; landings alone shape the forces where the user wants it or joints are missing; else
the whole body's dynamics do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..dynamics.body_dynamics import body_dynamics
from ..dynamics.continuation import continued, without_holds
from ..ground.hard_ground import HardOnSoft
from ..ground.heightfield import Terrain
from ..ground.material import GroundMaterial
from ..motion.motion import CharacterMotion, steps_per_frame
from ..numerics.slices import Slices, sliced
from .contact_timing import refine_contacts
from .contacts import Contacts, detect_contacts
from .forces import ContactForces, impulse_forces, whole_body_forces
from .free_bodies import free_loads
from .hovering import hovers
from .jumps import FEWEST, joined
from .missing_ground import beyond_edge, without_missing
from .sliding import treadmill_speed

ForceModel = Literal["WHOLE_BODY", "IMPULSE"]


@dataclass(frozen=True)
class CharacterLoads:
    """Loads of one character on the ground, on the simulation's time grid.

    Attributes
    ----------
    hovers : float
        Share of the frames in which nothing of it touches, if it hovers and so has no contacts; else 0.
    """

    motion: CharacterMotion
    contacts: Contacts
    forces: ContactForces
    hovers: float = 0.0


def follows_landings(motion: CharacterMotion, force_model: ForceModel) -> bool:
    """True if the forces of a motion are those of its landings, which last as long as the ground needs to give way."""
    return motion.centre is not None or force_model == "IMPULSE" or not motion.joints


@sliced
def estimate_loads(
    motion: CharacterMotion,
    terrain: Terrain,
    *,
    force_model: ForceModel,
    material: GroundMaterial,
) -> Slices[CharacterLoads]:
    """Resample the motion to the simulation's time grid, find its contacts and estimate its forces.

    Parameters
    ----------
    motion : CharacterMotion
        At scene frames.
    terrain : Terrain
        The undisturbed ground.
    force_model : 'WHOLE_BODY' or 'IMPULSE'
    material : GroundMaterial
        Its characteristic time shapes the impulse model and the landings of props without a skeleton; the
        whole-body model of a character does not depend on it.
    """
    steps = steps_per_frame(motion.frame_rate)
    if len(motion.starts) > 1:
        ends, parts = [*motion.starts[1:], len(motion.frames)], []
        for samples in map(slice, motion.starts, ends):
            if samples.stop - samples.start >= FEWEST:
                part = motion.of(samples)
                work = estimate_loads.slices(part, terrain, force_model=force_model, material=material)
                loads = yield from work
                parts.append((samples, loads.contacts, loads.forces))
        return CharacterLoads(motion.resampled(steps), *joined(motion, parts, steps))
    if motion.centre is not None:
        tau = material.characteristic_time
        return CharacterLoads(
            *free_loads(motion, terrain, steps=steps, characteristic_time=tau, force_model=force_model)
        )
    source, shot = continued(without_holds(motion))
    source = source.resampled(steps)
    yield
    ground = beyond_edge(source, terrain)
    contacts = yield from detect_contacts.slices(source, ground)
    yield
    if follows_landings(motion, force_model):  # without joints, nothing tells what the body does
        forces = impulse_forces(source, contacts, material.characteristic_time)
    else:
        body = body_dynamics(source, ~contacts.touching.any(axis=1))
        yield
        # Of a body that walks on the spot, the dynamics tell less about its contacts than its skin does.
        if source.ground_level is None or treadmill_speed(source, contacts) == 0:
            contacts = refine_contacts(source, contacts, body)
        yield
        forces = whole_body_forces(source, contacts, body)
    if ground is not terrain or isinstance(terrain, HardOnSoft):
        contacts, forces = without_missing(source, terrain, contacts, forces)
    shown = slice(shot.start * steps, (shot.stop - 1) * steps + 1)
    motion, contacts, forces = motion.resampled(steps), contacts.during(shown), forces.during(shown)
    if share := hovers(motion, contacts):
        none = np.zeros_like(contacts.touching)
        contacts, forces = replace(contacts, touching=none), forces.of(none)
    return CharacterLoads(motion, contacts, forces, share)
