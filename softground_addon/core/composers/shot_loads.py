"""The loads of all characters of a shot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import compress

import numpy as np

from ..errors import InputError
from ..findings import listed
from ..ground.hard_ground import SeveralGrounds, soft_ground
from ..ground.heightfield import Terrain
from ..ground.terrain import MeshTerrain
from ..loads.estimate import CharacterLoads, estimate_loads
from ..loads.hovering import hovering
from ..motion.motion import CharacterMotion
from ..numerics.slices import Slices, sliced
from ..settings import BakeSettings


@sliced
def loads_of_shot(
    wanted: BakeSettings,
    motions: Sequence[CharacterMotion],
    terrain: Terrain,
    known: Iterable[tuple[CharacterMotion, CharacterLoads]] = (),
) -> Slices[list[CharacterLoads]]:
    """The loads of the motions of a shot, with the masses and force models that are wanted.

    Parameters
    ----------
    known : iterable of (CharacterMotion, CharacterLoads)
        The loads of motions that were looked at before: where one of them is met again they are taken over.

    Raises
    ------
    InputError
        If nobody touches the ground, or it lies overhead or in layers under a foot.
    """
    loads, known_by = [], {id(motion): contacts for motion, contacts in known}
    for motion, character in zip(motions, wanted.characters, strict=True):
        if id(motion) in known_by:
            loads.append(known_by[id(motion)])
            continue
        moved = replace(motion, mass=character.mass_kg)
        work = estimate_loads.slices(moved, terrain, force_model=character.force_model, material=wanted.material)
        loads.append((yield from work))
        yield
    _check_contacts(loads, terrain, [ground.name for ground in wanted.soft_grounds])
    return loads


def _check_contacts(loads: Sequence[CharacterLoads], terrain: Terrain, grounds: Sequence[str]) -> None:
    """Raise InputError if nothing touches the grounds of those names, or they lie overhead or in layers underfoot."""
    place = np.concatenate(
        [
            sole.landmark_positions()[character.contacts.touching[:, number]].reshape(-1, 3)
            for character in loads
            for number, sole in enumerate(character.motion.soles)
        ]
    )
    whole = soft_ground(terrain)
    parts = whole.grounds if isinstance(whole, SeveralGrounds) else (whole,)
    name = listed(grounds) or "the ground"
    if not any(character.contacts.standing.any() for character in loads):
        if floats := [hovering(character.motion.name, character.hovers) for character in loads if character.hovers]:
            raise InputError(floats[0].message, floats[0].code, remedy=floats[0].remedy)
        characters = ", ".join(f"'{character.motion.name}'" for character in loads)
        message = f"No foot of {characters} touches {name} in these frames"
        raise InputError(message, "no_contact", remedy="move the ground under the feet, or correct the feet.")
    layered = [
        isinstance(part, MeshTerrain) and not part.is_height_field(place[:, 0], place[:, 1]).all() for part in parts
    ]
    if any(layered):
        raise InputError(
            f"Ground {listed(compress(grounds, layered)) or name} has several layers one above the other under the "
            "feet, such as a bridge or an overhang: separate the layer that is walked on into an object of its own.",
            "layered_ground",
        )
    for character in loads:
        contacts, leg = character.contacts, character.motion.leg_length
        below = -(contacts.clearance + contacts.offset)[contacts.touching]
        if len(below) and (depth := float(np.median(below))) > leg:
            message = f"The feet of '{character.motion.name}' are {depth:.2g} m below {name}"
            remedy = "move the ground down to them. If it is a room, turn its faces inward."
            raise InputError(message, "below_ground", remedy=remedy, character=character.motion.name, depth=depth)
