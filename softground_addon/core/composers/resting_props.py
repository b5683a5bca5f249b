"""Depth of the print of a prop, which is taken as if it rested where it is."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..ground.heightfield import Window
from ..ground.material import GroundMaterial
from ..loads.estimate import CharacterLoads
from ..motion.props import posed
from ..pressing.ground_cells import UndisturbedCells
from ..pressing.indentation import stress
from ..pressing.prop_imprint import GroundUnder, ground_under
from .sole_contacts import contacts_of

POSES = 12
"""Steps of a body's contact that are looked at, and the one that presses hardest."""


def prop_poses(character: CharacterLoads, index: int, cells: UndisturbedCells) -> Iterator[tuple[GroundUnder, float]]:
    """The ground under a body at some steps of each contact, and the force on it.

    Each is taken as if it rested there: too large for one that rolls on before the ground gives way.
    """
    motion = character.motion
    sole, force = motion.soles[index], character.forces.forces[:, index]
    prop = sole.sole.prop
    assert prop is not None, sole.sole.name
    normal_force = np.maximum(np.einsum("ni,ni->n", force, character.contacts.normal[:, index]), 0.0)
    for contact in contacts_of(character, index):
        steps = np.arange(contact.start, contact.stop)
        chosen = np.unique([*np.linspace(steps[0], steps[-1], POSES).astype(int), steps[normal_force[steps].argmax()]])
        for step in chosen:
            pose = sole.transforms[step, 0]
            across = posed(prop.vertices, pose)[:, :2]
            window = Window.around(across.min(axis=0), across.max(axis=0), cells.cell_size)
            under = ground_under(prop, pose, cells.surface(window), np.inf, cells.factors(window))
            if under is not None:
                yield under, float(normal_force[step])


def depth_under(under: GroundUnder, force: float, material: GroundMaterial) -> float:
    """Largest compression under a lasting force, where the crust gives way to it [m]."""
    springs = under.springs
    compression = springs.compression(springs.sinkage(force, material), material) * under.bears
    loaded = stress(compression, material, stiffness=springs.stiffness, depth=springs.depth)
    return float(compression.max(initial=0.0, where=loaded >= material.crust_stress))
