"""The estimated forces of a shot as OpenSim reads them: a table for each character, and the loads that apply it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path

import bpy
import numpy as np

from ...core.files import files, opensim
from ...core.loads.estimate import CharacterLoads
from ...core.loads.free_moments import free_moments


def write(loads: Sequence[CharacterLoads], path: Path, start: int, end: int) -> list[Path]:
    """Write the forces on all soles at the simulation's time steps; with several characters a file each.

    Raises
    ------
    InputError
        If a file cannot be written, or another one has the name of the external loads; nothing is written then.
    """
    targets: list[Path] = []
    taken: set[str] = set()
    for character in loads:
        target = path
        if len(loads) > 1:
            stem = f"{path.stem}_{bpy.path.clean_name(character.motion.name)}"
            numbered = (f"{stem}_{number}" if number > 1 else stem for number in count(1))
            target = path.with_stem(next(name for name in numbered if name.casefold() not in taken))
            taken.add(target.stem.casefold())
        targets.append(target)
        opensim.loads_beside(target)
    each = zip(loads, targets, strict=True)
    return [file for character, target in each for file in _write_one(character, target, start, end)]


def _write_one(character: CharacterLoads, path: Path, start: int, end: int) -> list[Path]:
    frames = character.motion.frames
    shown = (frames >= start) & (frames <= end)
    time = (frames[shown] - start) / character.motion.frame_rate
    twists = character.motion.joints and character.motion.centre is None
    moment = free_moments(character) if twists else np.zeros(character.contacts.touching.shape)
    feet = [
        opensim.FootForce(
            sole.sole.name,
            sole.sole.side,
            character.forces.forces[shown, number],
            np.where(
                character.contacts.touching[shown, number, None],
                character.forces.centre_of_pressure[shown, number],
                np.nan,
            ),
            moment[shown, number],
        )
        for number, sole in enumerate(character.motion.soles)
    ]
    files.write_text(path, opensim.storage(character.motion.name, time, feet))
    external = opensim.loads_beside(path)
    if external is None:
        return [path]
    files.write_text(external, opensim.external_loads(character.motion.name, path.name, feet))
    return [path, external]
