"""Loads of a motion that jumps: a cut or a constant key puts the body elsewhere between two frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from ..motion.motion import CharacterMotion
from .contacts import Contacts
from .forces import UP, ContactForces

FEWEST = 3
"""What is seen for fewer samples between two jumps bears nothing."""
STAYS = 0.02
"""A sole that moves less in a jump stays where it is, in leg lengths."""


def joined(
    motion: CharacterMotion, parts: Sequence[tuple[slice, Contacts, ContactForces]], steps: int
) -> tuple[Contacts, ContactForces]:
    """Contacts and forces of a motion, at `steps` steps a frame, from those of the parts between its jumps.

    Parameters
    ----------
    motion : CharacterMotion
        At scene frames.
    parts : sequence of (samples, contacts, forces)
        Those that were looked at. Nothing bears in others, nor from the last sample before a jump to the first after
        it, but for soles that stay.
    """
    count, soles = (len(motion.frames) - 1) * steps + 1, len(motion.soles)
    contacts = Contacts(
        touching=np.zeros((count, soles), dtype=bool),
        offset=np.zeros(soles),
        normal=np.broadcast_to(UP, (count, soles, 3)).copy(),
        clearance=np.full((count, soles), np.inf),
        aloft=np.ones((count, soles), dtype=bool) if all(part[1].aloft is not None for part in parts) else None,
        hard=np.zeros((count, soles), dtype=bool) if any(part[1].hard is not None for part in parts) else None,
    )
    vectors = (np.zeros((count, soles, 3)), np.zeros((count, 3)), np.zeros((count, soles, 3)))
    forces = ContactForces(*vectors, np.zeros((count, soles)), np.zeros((count, soles)))
    longest = np.zeros(soles)
    for samples, of_part, forces_of_part in parts:
        first = samples.start * steps
        here = slice(first, first + len(of_part.touching))
        for whole, part in ((contacts, of_part), (forces, forces_of_part)):
            for field in fields(part):
                if field.name != "offset" and getattr(whole, field.name) is not None:
                    getattr(whole, field.name)[here] = getattr(part, field.name)
        time = of_part.touching.sum(axis=0)
        contacts.offset[:] = np.where(time > longest, of_part.offset, contacts.offset)
        longest = np.maximum(time, longest)
    _bridge(motion, contacts, forces, steps)
    return contacts, forces


def _bridge(motion: CharacterMotion, contacts: Contacts, forces: ContactForces, steps: int) -> None:
    """Let soles that stay bear through the jumps, and end the contacts of the others there."""
    for start in motion.starts[1:]:
        before, after = (start - 1) * steps, start * steps
        for index, sole in enumerate(motion.soles):
            apart = np.ptp(sole.landmark_positions()[start - 1 : start + 1], axis=0).max()
            if apart < STAYS * motion.leg_length and contacts.touching[[before, after], index].all():
                for array in (contacts.touching, contacts.clearance, contacts.normal, forces.forces):
                    array[before + 1 : after, index] = array[before, index]
                forces.centre_of_pressure[before + 1 : after, index] = forces.centre_of_pressure[before, index]
                forces.weight[before + 1 : after, index] = forces.forces[before, index, 2]
                forces.total[before + 1 : after] += forces.forces[before, index]
            elif steps == 1:  # no step lies between
                contacts.touching[before, index] = False
                forces.total[before] -= forces.forces[before, index]
                for array in (forces.forces, forces.weight, forces.momentum):
                    array[before, index] = 0.0
