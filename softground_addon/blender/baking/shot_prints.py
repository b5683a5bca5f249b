"""Prints of a shot: pressed, or taken from the last bake of the same inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...core.carried.film import CarriedMass
from ...core.carried.marks import Marks
from ...core.carving.carves import with_carves
from ...core.checks.self_check import bottomed_out, self_check
from ...core.checks.volumes import check_volumes
from ...core.composers.floor_prints import floor_prints
from ...core.composers.pressed_shot import PressedShot, first_with_steps, loads_standing, offsets_mm, press_shot
from ...core.composers.responses import CharacterResponse, gap_table
from ...core.debris.debris import Debris
from ...core.events.events import Event, as_edited, events, in_order
from ...core.files import report
from ...core.findings import Finding
from ...core.ground.hard_ground import HardOnSoft, SeveralGrounds, soft_ground
from ...core.ground.heightfield import FlatTerrain
from ...core.ground.soft_ground import SoftGround
from ...core.ground.terrain import MeshTerrain
from ...core.loads.estimate import CharacterLoads, follows_landings
from ...core.motion.motion import CharacterMotion
from ...core.record.edits import StepEdit
from ...core.record.record import BakeRecord, EditableStep
from ...core.settings import Acts, BakeSettings
from .. import session
from ..jobs import Job, Progress, counted, meanwhile
from ..reading.shots import Shot, ground_of
from ..reuse import reused
from .publish import marks_of_record, with_debris

_Stood = tuple[tuple[CharacterMotion, ...], list[CharacterLoads]]
"""From `loads_standing`."""


@dataclass(frozen=True)
class GroundPrints:
    """Prints of a ground.

    Attributes
    ----------
    made_with : BakeSettings
        What it is baked with.
    record : BakeRecord
        Prints that soles press, as they are and as they are edited, and what bodies carve.
    debris : Debris or None
        What steps throw.
    marks : Marks or None
        Those on hard ground.
    happened : list of dict
        Events, for the record.
    """

    made_with: BakeSettings
    record: BakeRecord
    debris: Debris | None
    marks: Marks | None
    happened: list[dict[str, Any]]


@dataclass(frozen=True)
class ShotPrints:
    """Prints of a shot, and what else a bake writes of it.

    Attributes
    ----------
    grounds : tuple of GroundPrints
        Those of each ground.
    loads : list of CharacterLoads
        On all grounds together.
    responses : list of CharacterResponse
    reported : mapping
        Offsets, forces and gaps, for the report.
    findings : tuple of Finding
        What checks say of them.
    """

    grounds: tuple[GroundPrints, ...]
    loads: list[CharacterLoads]
    responses: list[CharacterResponse]
    reported: Mapping[str, Any]
    findings: tuple[Finding, ...] = ()

    @property
    def steps(self) -> list[tuple[EditableStep, str]]:
        """All steps, each with the name of its ground, or none where there is only one."""
        if len(self.grounds) == 1:
            return [(step, "") for step in self.grounds[0].record.steps]
        names = [each.made_with.ground.name if each.made_with.ground else "" for each in self.grounds]
        steps = [(step, name) for each, name in zip(self.grounds, names, strict=True) for step in each.record.steps]
        return sorted(steps, key=lambda step: step[0].baked.start_frame)

    @property
    def events(self) -> list[Event]:
        """Events of all steps as they are edited."""
        rows = []
        for each in self.grounds:
            of_ground = as_edited(each.happened, each.record.steps, each.record.laid_carves)
            rows += each.marks.floors.with_films(of_ground, each.record.steps) if each.marks else of_ground
        return in_order(rows)

    @property
    def carried(self) -> CarriedMass | None:
        """Masses that soles carried onto hard floors; None if they left no marks."""
        masses = [each.marks.carried for each in self.grounds if each.marks]
        return sum(masses, CarriedMass()) if masses else None


def shot_prints(wanted: BakeSettings, shot: Shot, edits: Mapping[str, StepEdit]) -> Job[ShotPrints]:
    """The prints of a shot; errors as of `loads_standing` and `press_shot`."""
    begun, models = Progress("simulate", 0.0), [character.force_model for character in wanted.characters]
    lands, material = any(map(follows_landings, shot.motions, models)), wanted.material
    if not isinstance(soft_ground(shot.terrain), MeshTerrain | FlatTerrain | SeveralGrounds):  # slopes are not compared
        prints = yield from _pressed(wanted, shot, (yield from _stood(wanted, shot)), edits)
        return replace(prints, findings=(yield from _checked(wanted, shot, prints))[1])
    read = yield from meanwhile(begun, report.hash_inputs.slices(shot.motions, shot.terrain))
    source = read, wanted.between(Acts.LOADS, Acts.LOADS), wanted.sinks, material.characteristic_time if lands else None
    stood = yield from reused(begun, "loads", source, _stood(wanted, shot))
    before, after = wanted.between(Acts.READING, Acts.RESPONDING), wanted.between(Acts.OUTPUT, Acts.OUTPUT)
    for settings, key in ((before, "ground"), (after, "camera"), (after, "margin_m")):
        settings.pop(key, None)
    of_each = list(zip(wanted.of_each_ground, shot.of_each_ground, strict=True))
    painted = [(part.variation, part.regions(each)) for each, part in of_each]  # the settings have the rest
    skins, legs = shot.skins if wanted.carves else {}, [rig.legs for rig in shot.rigs]
    pressing = _pressed(wanted, shot, stood, edits)
    prints = yield from reused(begun, "prints", (read, before, after, painted, edits, skins, legs), pressing)
    pairs = zip(prints.grounds, wanted.of_each_ground, strict=True)  # those before may write otherwise
    prints = replace(prints, grounds=tuple(replace(ground, made_with=each) for ground, each in pairs))
    # What is reported of them is held with them: nothing else has its identity meanwhile.
    compared = id(prints.reported), [ground.name for ground in wanted.soft_grounds]
    at_end = Progress("simulate", 1.0)
    _, findings = yield from reused(at_end, "findings", compared, _checked(wanted, shot, prints))
    return replace(prints, findings=findings)


def _stood(wanted: BakeSettings, shot: Shot) -> Job[_Stood]:
    work = loads_standing.slices(wanted, shot.motions, shot.terrain)
    return (yield from meanwhile(Progress("simulate", 0.0), work))


def _pressed(wanted: BakeSettings, shot: Shot, stood: _Stood, edits: Mapping[str, StepEdit]) -> Job[ShotPrints]:
    at_end = Progress("simulate", 1.0)
    grounds = list(map(ground_of, wanted.of_each_ground, shot.of_each_ground))
    seen = session.show_pressing(wanted.scene.uid, shot.terrain, shot.frame)
    pressing = press_shot(wanted, shot.responding, *stood, shot.terrain, grounds, edits, seen)
    pressed = yield from counted(pressing, "simulate", wanted.frames[1] - wanted.frames[0] + 1)
    prints: list[GroundPrints] = []
    for each in zip(wanted.of_each_ground, shot.of_each_ground, grounds, strict=True):
        prints.append((yield from _of_ground(shot, pressed, len(prints), *each)))
    records = [each.record for each in prints]
    measuring = gap_table.slices(pressed.responses, pressed.loads, shot.motions, shot.terrain, records)
    gaps = yield from meanwhile(at_end, measuring)
    reported = {"offsets_mm": offsets_mm(pressed.loads), "forces": pressed.forces, "gaps_mm": gaps}
    return ShotPrints(tuple(prints), pressed.loads, pressed.responses, reported)


def _checked(
    wanted: BakeSettings, shot: Shot, prints: ShotPrints
) -> Job[tuple[Mapping[str, Any], tuple[Finding, ...]]]:
    """What is reported of prints, and what checks say of them and name their grounds."""
    footprints = [step for each in prints.grounds for step in each.record.footprints]
    names = "', '".join(ground.name for ground in wanted.soft_grounds) or "the ground"
    checking = self_check.slices(prints.loads, footprints, shot.terrain, wanted.cell_size_m, names)
    findings = yield from meanwhile(Progress("simulate", 1.0), checking)
    findings += [finding for each in prints.grounds for finding in _bottomed_out(each)]
    return prints.reported, tuple(findings)


def _of_ground(
    shot: Shot, pressed: PressedShot, number: int, made_with: BakeSettings, part: Shot, ground: SoftGround
) -> Job[GroundPrints]:
    """The prints of one of the grounds; the first with steps has what happens, and what soles bring, elsewhere.

    Raises BakeError if a footprint breaks an invariant.
    """
    at_end = Progress("simulate", 1.0)
    check_volumes(pressed.records[number].footprints, ground, part.surface.factors if part.surface else None)
    loads, record, terrain = pressed.shares[number], pressed.records[number], shot.terrain
    responses = [(each.motion, each.response) for each in pressed.responses]
    carving = with_carves.slices(record, responses, shot.skins, ground, made_with.surface)
    record = yield from meanwhile(at_end, carving)
    throwing = with_debris.slices(record, ground, made_with, loads)
    record, debris = yield from meanwhile(at_end, throwing)
    brought = {each.name: (each.dirty_with or made_with.surface, each.dirty_soles) for each in made_with.characters}
    has_the_rest = number == first_with_steps([each.footprints for each in pressed.records])
    if not has_the_rest and isinstance(terrain, HardOnSoft):
        terrain, brought = replace(terrain, wet={}), {}
    if has_the_rest:
        treading = floor_prints.slices(loads, shot.terrain, made_with.cell_size_m)
        record = replace(record, on_floors=(yield from meanwhile(at_end, treading)))
    marks = yield from meanwhile(
        at_end, marks_of_record.slices(record, terrain, made_with, loads, debris, brought=brought)
    )
    first = made_with.frames[0]
    happening = events.slices(loads, record.footprints, surface=made_with.surface, first_frame=first)
    happened = yield from meanwhile(at_end, happening)
    if not has_the_rest:
        happened = [row for row in happened if row["step"]]
    return GroundPrints(made_with, record, debris, marks, happened)


def _bottomed_out(prints: GroundPrints) -> list[Finding]:
    """Findings about steps that end at the bottom of the deepest layer of their surface."""
    made_with = prints.made_with
    name = made_with.ground.name if made_with.ground else "the ground"
    by_depth = sorted(made_with.kinds[0], key=lambda kind: kind.material.deepest)
    findings = []
    for surface, material in {kind.surface: kind.material for kind in by_depth}.items():
        steps = [step for step in prints.record.footprints if (step.surface or made_with.surface) == surface]
        findings += bottomed_out(steps, material, name)
    return findings
