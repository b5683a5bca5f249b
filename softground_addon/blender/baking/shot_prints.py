"""Prints of a shot: pressed, or taken from the last bake of the same inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...core.carried.marks import Marks
from ...core.carving.carves import with_carves
from ...core.checks.self_check import bottomed_out, self_check
from ...core.composers.pressed_shot import loads_standing, offsets_mm, press_shot
from ...core.composers.responses import CharacterResponse, gap_table
from ...core.debris.debris import Debris
from ...core.events.events import events
from ...core.files import report
from ...core.findings import Finding
from ...core.ground.soft_ground import SoftGround
from ...core.ground.terrain import MeshTerrain
from ...core.loads.estimate import CharacterLoads, follows_landings
from ...core.motion.motion import CharacterMotion
from ...core.record.edits import StepEdit
from ...core.record.footprints import Footprint
from ...core.record.record import BakeRecord
from ...core.settings import Acts, BakeSettings
from .. import session
from ..jobs import Job, Progress, counted, meanwhile
from ..reading.shots import Shot
from ..reuse import reused
from .publish import marks_of_record, with_debris

_Stood = tuple[tuple[CharacterMotion, ...], list[CharacterLoads]]
"""From `loads_standing`."""


@dataclass(frozen=True)
class ShotPrints:
    """Prints of a shot, and what else a bake writes of it.

    Attributes
    ----------
    record : BakeRecord
        Prints that soles press, as they are and as they are edited, and what bodies carve.
    debris : Debris or None
        What steps throw.
    marks : Marks or None
        Those on hard ground.
    findings : tuple of Finding
        What checks say of them.
    happened : list of dict
        Events, for the record.
    reported : mapping
        Offsets, forces and gaps, for the report.
    """

    record: BakeRecord
    debris: Debris | None
    marks: Marks | None
    responses: list[CharacterResponse]
    findings: tuple[Finding, ...]
    happened: list[dict[str, Any]]
    reported: Mapping[str, Any]


def shot_prints(wanted: BakeSettings, shot: Shot, ground: SoftGround, edits: Mapping[str, StepEdit]) -> Job[ShotPrints]:
    """The prints of a shot; errors as of `loads_standing` and `press_shot`."""
    begun, models = Progress("simulate", 0.0), [character.force_model for character in wanted.characters]
    lands, material = any(map(follows_landings, shot.motions, models)), wanted.material
    if not isinstance(ground.terrain, MeshTerrain):  # what is made or hard is not compared
        return (yield from _pressed(wanted, shot, (yield from _stood(wanted, shot)), ground, edits))
    read = yield from meanwhile(begun, report.hash_inputs.slices(shot.motions, ground.terrain))
    source = read, wanted.between(Acts.LOADS, Acts.LOADS), wanted.sinks, material.characteristic_time if lands else None
    stood = yield from reused(begun, "loads", source, _stood(wanted, shot))
    before, after = wanted.between(Acts.READING, Acts.RESPONDING), wanted.between(Acts.OUTPUT, Acts.OUTPUT)
    painted = ground.variation, ground.regions  # the rest of the ground the settings have
    skins = shot.skins if wanted.carves else {}
    pressing = _pressed(wanted, shot, stood, ground, edits)
    return (yield from reused(begun, "prints", (read, before, after, painted, edits, skins), pressing))


def _stood(wanted: BakeSettings, shot: Shot) -> Job[_Stood]:
    work = loads_standing.slices(wanted, shot.motions, shot.terrain)
    return (yield from meanwhile(Progress("simulate", 0.0), work))


def _pressed(
    wanted: BakeSettings, shot: Shot, stood: _Stood, ground: SoftGround, edits: Mapping[str, StepEdit]
) -> Job[ShotPrints]:
    at_end, factors = Progress("simulate", 1.0), shot.surface.factors if shot.surface else None
    seen = session.show_pressing(wanted.scene, shot.terrain, shot.frame)
    pressing = press_shot(wanted, shot.motions, *stood, ground, edits, factors, seen)
    pressed = yield from counted(pressing, "simulate", wanted.frames[1] - wanted.frames[0] + 1)
    responses = [(each.motion, each.response) for each in pressed.responses]
    carving = with_carves.slices(pressed.record, responses, shot.skins, ground, wanted.surface)
    record = yield from meanwhile(at_end, carving)
    throwing = with_debris.slices(record, ground, wanted, pressed.loads)
    record, debris = yield from meanwhile(at_end, throwing)
    marking = marks_of_record.slices(record, shot.terrain, wanted, pressed.loads, debris)
    marks = yield from meanwhile(at_end, marking)
    measuring = gap_table.slices(pressed.responses, pressed.loads, shot.motions, shot.terrain, record.edited)
    gaps = yield from meanwhile(at_end, measuring)
    name = wanted.ground.name if wanted.ground else "the ground"
    checking = self_check.slices(pressed.loads, record.footprints, shot.terrain, wanted.cell_size_m, name)
    findings = yield from meanwhile(at_end, checking)
    happening = events.slices(pressed.loads, record.footprints, surface=wanted.surface, first_frame=wanted.frames[0])
    return ShotPrints(
        record,
        debris,
        marks,
        pressed.responses,
        (*findings, *_bottomed_out(wanted, record.footprints, name)),
        (yield from meanwhile(at_end, happening)),
        {"offsets_mm": offsets_mm(pressed.loads), "forces": pressed.forces, "gaps_mm": gaps},
    )


def _bottomed_out(wanted: BakeSettings, footprints: Sequence[Footprint], ground: str) -> list[Finding]:
    """Findings about steps that end at the bottom of the deepest layer of their surface."""
    by_depth = sorted(wanted.kinds[0], key=lambda kind: kind.material.deepest)
    findings = []
    for surface, material in {kind.surface: kind.material for kind in by_depth}.items():
        steps = [step for step in footprints if (step.surface or wanted.surface) == surface]
        findings += bottomed_out(steps, material, ground)
    return findings
