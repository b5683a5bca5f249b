"""A bake between what is read and what is written: the prints that a shot leaves, and how its characters respond."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..checks.volumes import check_volumes
from ..errors import InputError
from ..findings import Finding
from ..ground.heightfield import Terrain
from ..ground.soft_ground import SoftGround
from ..loads.cell_limits import check_cell_size
from ..loads.estimate import CharacterLoads
from ..motion.motion import CharacterMotion, shortest_sole
from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from ..record.edits import StepEdit, without_sole, without_step
from ..record.footprints import Footprint
from ..record.record import BakeRecord
from ..settings import BakeSettings
from ..soles.deep_ground import wading
from .edited_steps import with_edits
from .prediction import pressed_contacts
from .responses import LEAN_PASSES, CharacterResponse, leaning, leans_anew, responses_of, standing_on
from .shot_loads import loads_of_shot
from .simulation import simulate


@dataclass(frozen=True)
class PressedShot:
    """Loads, record and responses of a shot.

    Attributes
    ----------
    record : BakeRecord
        Its steps, as they are and as they are edited.
    forces : dict or None
        The force on each sole at each frame [N], for the report; None where it is not asked for.
    """

    loads: list[CharacterLoads]
    record: BakeRecord
    forces: dict[str, object] | None
    responses: list[CharacterResponse]


@sliced
def loads_standing(
    wanted: BakeSettings, motions: Sequence[CharacterMotion], terrain: Terrain
) -> Slices[tuple[tuple[CharacterMotion, ...], list[CharacterLoads]]]:
    """The motions of a shot as they will walk on the terrain, and their loads; errors as of `loads_of_shot`."""
    standing = yield from standing_on.slices(motions, terrain, wanted.response)
    return standing, (yield from loads_of_shot.slices(wanted, standing, terrain))


def press_shot(
    wanted: BakeSettings,
    motions: Sequence[CharacterMotion],
    standing: Sequence[CharacterMotion],
    loads: list[CharacterLoads],
    ground: SoftGround,
    edits: Mapping[str, StepEdit],
    factors: Array | None = None,
    seen: list[Footprint] | None = None,
) -> Generator[int | None, None, PressedShot]:
    """Footprints and, on request, forces of a shot, and how its characters respond to the edited steps.

    Where bodies lean, the forces are found anew for the leaning bodies, and the ground is pressed by them, until the
    lean that the pressed ground gives is the lean that pressed it.

    Parameters
    ----------
    motions, standing : sequence of CharacterMotion
        As they were read, and as they will walk.
    loads : list of CharacterLoads
        From `loads_standing`.
    factors : (V, 3) float array, optional
        What is painted on the ground.
    seen : list of Footprint, optional
        Takes each print as soon as its contact ends, for a preview; where bodies lean, that of the first pass.

    Yields
    ------
    int or None
        Number of frames pressed so far, None for as many as before.

    Raises
    ------
    InputError
        If the cells are too small for the shot.
    BakeError
        If a footprint breaks an invariant.
    """
    terrain, asked = ground.terrain, wanted.response
    if wanted.carves:
        yield from _check_carving(wanted, loads, ground)
    footprints, forces = yield from _simulate(wanted, loads, ground, seen)
    before = None
    for _ in range(LEAN_PASSES):
        record = yield from _edited(wanted, ground, footprints, edits)
        yield None
        now = yield from leaning.slices(loads, standing, terrain, record.edited, asked)
        if not leans_anew(now, before):
            break
        known = list(zip(before.motions if before else standing, loads, strict=True))
        before = now
        loads = yield from loads_of_shot.slices(wanted, now.motions, terrain, known)
        footprints, forces = yield from _simulate(wanted, loads, ground)
    check_volumes(footprints, ground, factors)
    yield None
    record = yield from _edited(wanted, ground, footprints, edits)
    responses = yield from responses_of.slices(loads, motions, terrain, record, asked)
    return PressedShot(loads, record, forces, responses)


def _check_carving(wanted: BakeSettings, loads: Sequence[CharacterLoads], ground: SoftGround) -> Slices[None]:
    """Raise InputError if legs would carve the ground for longer, or more of it, than the bake may take."""
    try:
        check_cell_size(loads, replace(wanted.fineness, is_carved=True), wanted.longest_bake_s)
    except InputError as error:  # if it is deep
        depths = (yield from pressed_contacts.slices(loads, ground, wanted.cell_size_m)).depths
        if wading(depths.max(initial=0.0), shortest_sole([character.motion for character in loads])) > 0:
            raise InputError(f"Legs carve deep ground. {error}", "carving", remedy="Or do without carving.") from None


def _edited(
    wanted: BakeSettings, ground: SoftGround, footprints: Sequence[Footprint], edits: Mapping[str, StepEdit]
) -> Slices[BakeRecord]:
    record = BakeRecord(footprints, {})
    return (yield from with_edits.slices(record, edits, ground, wanted.cell_size_m)) if edits else record


def _simulate(
    wanted: BakeSettings, loads: Sequence[CharacterLoads], ground: SoftGround, seen: list[Footprint] | None = None
) -> Generator[int, None, tuple[list[Footprint], dict[str, object] | None]]:
    """The footprints in the order of their first contact; on request, the force on each sole at each frame [N]."""
    footprints: list[Footprint] = []
    check_cell_size(loads, wanted.fineness, wanted.longest_bake_s)
    frames: list[float] = []
    forces: list[tuple[Array, ...]] = []
    for result in simulate(loads, ground, wanted.cell_size_m):
        footprints += result.footprints
        if seen is not None:
            seen += result.footprints
        frames.append(result.frame)
        if wanted.keep_forces:
            forces.append(result.forces)
        yield len(frames)
    footprints.sort(
        key=lambda footprint: (footprint.start_frame, footprint.end_frame, footprint.character, footprint.sole)
    )
    return footprints, _force_table(loads, frames, forces) if wanted.keep_forces else None


def _force_table(
    loads: Sequence[CharacterLoads], frames: list[float], forces: list[tuple[Array, ...]]
) -> dict[str, object]:
    """The force on each sole at each frame [N], by character and sole."""
    characters: dict[str, dict[str, list[list[float]]]] = {}
    for number, character in enumerate(loads):
        of_character = np.array([at_frame[number] for at_frame in forces])
        names = [sole.sole.name for sole in character.motion.soles]
        characters[character.motion.name] = {
            name: np.round(of_character[:, sole], 3).tolist() for sole, name in enumerate(names)
        }
    return {"frames": frames, "characters": characters}


def offsets_mm(loads: Sequence[CharacterLoads]) -> dict[str, dict[str, float]]:
    """Constant float (positive) or sink of the source animation, by character and sole [mm]."""
    return {
        character.motion.name: {
            sole.sole.name: round(float(offset) * 1e3, 3)
            for sole, offset in zip(character.motion.soles, character.contacts.offset, strict=True)
        }
        for character in loads
    }


def edit_findings(record: BakeRecord) -> list[Finding]:
    """Findings about edits of the artist that have lost their step."""
    steps = [
        Finding(
            "edit_without_step",
            "warning",
            f"Step '{name}', which you edited, no longer exists: its foot does not touch the ground at that frame.",
            "The edit is kept for when the step comes back.",
            {"step": name},
        )
        for name in without_step(record.footprints, record.edits)
    ]
    soles = [
        Finding(
            "edit_without_sole",
            "warning",
            f"Step '{name}' was pressed with its own sole, as no foot in this bake and no mesh in this scene has the "
            f"sole '{record.edits[name].sole}' of its edit.",
            "The edit is kept for when that foot or mesh is there; choose another sole, or reset the step.",
            {"step": name, "sole": record.edits[name].sole},
        )
        for name in without_sole(record.footprints, record.edits)
    ]
    return steps + soles
