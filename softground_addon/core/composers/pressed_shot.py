"""A bake between what is read and what is written: the prints that a shot leaves, and how its characters respond."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from ..errors import InputError
from ..findings import Finding
from ..ground.hard_ground import SeveralGrounds, soft_ground
from ..ground.heightfield import Terrain
from ..ground.soft_ground import SoftGround
from ..loads.cell_limits import check_cell_size
from ..loads.estimate import CharacterLoads, follows_landings
from ..loads.shared_ground import grounds_under, loads_on
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
    """Loads, records and responses of a shot.

    Attributes
    ----------
    shares : list of list of CharacterLoads
        What of the loads each ground bears.
    records : list of BakeRecord
        The steps of each ground, as they are and as they are edited.
    forces : dict or None
        The force on each sole at each frame [N], for the report; None where it is not asked for.
    """

    loads: list[CharacterLoads]
    shares: list[list[CharacterLoads]]
    records: list[BakeRecord]
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
    terrain: Terrain,
    grounds: Sequence[SoftGround],
    edits: Mapping[str, StepEdit],
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
    terrain : Terrain
        On which they were found.
    grounds : sequence of SoftGround
        All that takes prints, in the order of `wanted.of_each_ground`.
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
    """
    asked = wanted.response
    shares = yield from shares_of(wanted, standing, loads, terrain)
    if wanted.carves:
        for of_ground in zip(wanted.of_each_ground, shares, grounds, strict=True):
            yield from _check_carving(*of_ground)
    footprints, forces = yield from _pressed(wanted, shares, grounds, seen)
    before = None
    for _ in range(LEAN_PASSES):
        records = yield from _edited(wanted, grounds, footprints, edits)
        yield None
        now = yield from leaning.slices(loads, standing, terrain, records, asked)
        if not leans_anew(now, before):
            break
        known = list(zip(before.motions if before else standing, loads, strict=True))
        before = now
        loads = yield from loads_of_shot.slices(wanted, now.motions, terrain, known)
        shares = yield from shares_of(wanted, now.motions, loads, terrain)
        footprints, forces = yield from _pressed(wanted, shares, grounds)
    records = yield from _edited(wanted, grounds, footprints, edits)
    rigged = [bool(character.armature) for character in wanted.characters]
    with_rig = list(compress(loads, rigged)), list(compress(motions, rigged))
    responses = yield from responses_of.slices(*with_rig, terrain, records, asked)
    return PressedShot(loads, shares, records, forces, responses)


def shares_of(
    wanted: BakeSettings, motions: Sequence[CharacterMotion], loads: list[CharacterLoads], terrain: Terrain
) -> Slices[list[list[CharacterLoads]]]:
    """What of the loads each ground bears, as `wanted.of_each_ground` has them: all of it, if it is the only one."""
    several = soft_ground(terrain)
    if not isinstance(several, SeveralGrounds):
        return [loads]
    shares, models = [], [character.force_model for character in wanted.characters]
    under = {id(character): grounds_under(character, several) for character in loads}
    # Landings last as long as the ground needs to give way, which is another time on each.
    same = [not follows_landings(*each) for each in zip(motions, models, strict=True)]
    known = list(compress(zip(motions, loads, strict=True), same))
    for number, made_with in enumerate(wanted.of_each_ground):
        of_ground = loads
        if number and not all(same):
            of_ground = yield from loads_of_shot.slices(made_with, motions, terrain, known)
        on = [under[id(each)] if id(each) in under else grounds_under(each, several) for each in of_ground]
        shares.append([loads_on(each, where, number) for each, where in zip(of_ground, on, strict=True)])
        yield
    return shares


def _check_carving(wanted: BakeSettings, loads: Sequence[CharacterLoads], ground: SoftGround) -> Slices[None]:
    """Raise InputError if legs would carve the ground for longer, or more of it, than the bake may take.

    What is too much without carving is refused as such.
    """
    try:
        check_cell_size(loads, replace(wanted.fineness, is_carved=True), wanted.longest_bake_s)
    except InputError as error:  # if it is deep
        check_cell_size(loads, wanted.fineness, wanted.longest_bake_s)
        depths = (yield from pressed_contacts.slices(loads, ground, wanted.cell_size_m)).depths
        if wading(depths.max(initial=0.0), shortest_sole([character.motion for character in loads])) > 0:
            raise InputError(
                f"Legs carve deep ground. {error}",
                "carving" if error.code == "too_long" else "carving_memory",
                remedy="Or do without carving.",
                **error.facts,
            ) from None


def _edited(
    wanted: BakeSettings,
    grounds: Sequence[SoftGround],
    footprints: Sequence[Sequence[Footprint]],
    edits: Mapping[str, StepEdit],
) -> Slices[list[BakeRecord]]:
    """The record of each ground, with the edits of its steps; the first with steps has those whose steps no ground has.

    A ground without steps gets no bake beside others that have some.
    """
    lacking_on = [{*without_step(of_ground, edits)} for of_ground in footprints]
    keeper = first_with_steps(footprints)
    elsewhere = {
        name for number, lacking in enumerate(lacking_on) if number != keeper for name in edits.keys() - lacking
    }
    records = []
    for number, (ground, of_ground) in enumerate(zip(grounds, footprints, strict=True)):
        lacking = elsewhere if number == keeper else lacking_on[number]
        its_edits = {name: edit for name, edit in edits.items() if name not in lacking}
        record = BakeRecord(of_ground, {})
        if its_edits:
            record = yield from with_edits.slices(record, its_edits, ground, wanted.cell_size_m)
        records.append(record)
    return records


def first_with_steps(footprints: Sequence[Sequence[Footprint]]) -> int:
    """Number of the first ground that has footprints; 0 where none has."""
    return next((number for number, of_ground in enumerate(footprints) if of_ground), 0)


def _pressed(
    wanted: BakeSettings,
    shares: Sequence[Sequence[CharacterLoads]],
    grounds: Sequence[SoftGround],
    seen: list[Footprint] | None = None,
) -> Generator[int | None, None, tuple[list[list[Footprint]], dict[str, object] | None]]:
    """The footprints of each ground, and the forces on all of them."""
    results: list[tuple[list[Footprint], dict[str, object] | None]] = []
    for of_ground in zip(wanted.of_each_ground, shares, grounds, strict=True):
        results.append((yield from _simulate(*of_ground, len(results), len(grounds), seen)))
    return [footprints for footprints, _ in results], results[0][1]


def _simulate(
    wanted: BakeSettings,
    loads: Sequence[CharacterLoads],
    ground: SoftGround,
    number: int,
    count: int,
    seen: list[Footprint] | None,
) -> Generator[int, None, tuple[list[Footprint], dict[str, object] | None]]:
    """The footprints of one of so many grounds in the order of their first contact; on request, the force on each sole
    at each frame [N]."""
    before = number * (wanted.frames[1] - wanted.frames[0] + 1)
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
        yield (before + len(frames)) // count
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
