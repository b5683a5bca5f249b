"""The only composer: from a character's motion to its loads on the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from .contacts import Contacts, detect_contacts
from .forces import ContactForces, impulse_forces, whole_body_forces
from .motion import CharacterMotion, steps_per_frame

if TYPE_CHECKING:
    from .deformation import GroundMaterial
    from .heightfield import Terrain

ForceModel = Literal["WHOLE_BODY", "IMPULSE"]


@dataclass(frozen=True)
class CharacterLoads:
    """What one character does to the ground, on the simulation's time grid."""

    motion: CharacterMotion
    contacts: Contacts
    forces: ContactForces


def estimate_loads(
    motion: CharacterMotion, terrain: Terrain, *, force_model: ForceModel, material: GroundMaterial
) -> CharacterLoads:
    """Resample the motion to the simulation's time grid, find its contacts and estimate its forces.

    Parameters
    ----------
    motion : CharacterMotion
        At scene frames.
    terrain : Terrain
        The undisturbed ground.
    force_model : 'WHOLE_BODY' or 'IMPULSE'
    material : GroundMaterial
        Its characteristic time shapes the impulse model; the whole-body model does not depend on it.
    """
    fine = motion.resampled(steps_per_frame(motion.frame_rate))
    contacts = detect_contacts(fine, terrain)
    if force_model == "IMPULSE":
        forces = impulse_forces(fine, contacts, material.characteristic_time)
    else:
        forces = whole_body_forces(fine, contacts)
    return CharacterLoads(fine, contacts, forces)
