"""What a shot leaves: pressed from the settings and from what was read, or as the last bake has it from the same.

All is read anew at each bake, and compared by value: keys, rigs, meshes and settings that have changed give other
prints, whoever has changed them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.carried.marks import Marks
from ...core.carving.carves import with_carves
from ...core.checks.self_check import bottomed_out, self_check
from ...core.composers.pressed_shot import offsets_mm, press_shot
from ...core.composers.responses import CharacterResponse, gap_table
from ...core.debris.debris import Debris
from ...core.events.events import events
from ...core.files import report
from ...core.findings import Finding
from ...core.ground.soft_ground import SoftGround
from ...core.ground.terrain import MeshTerrain
from ...core.numerics.packed import PackedArray
from ...core.record.edits import StepEdit
from ...core.record.footprints import Footprint
from ...core.record.record import BakeRecord
from ...core.settings import Acts, BakeSettings
from ..jobs import Job, Progress, counted, meanwhile
from ..reading.shots import Shot
from ..state import state
from .publish import marks_left, with_debris

LARGEST = 2**26
"""Most that is held for the next bake [bytes]: a minute of walking takes half of it."""


@dataclass(frozen=True)
class ShotPrints:
    """What a shot leaves.

    Attributes
    ----------
    left : BakeRecord
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

    left: BakeRecord
    debris: Debris | None
    marks: Marks | None
    responses: list[CharacterResponse]
    findings: tuple[Finding, ...]
    happened: list[dict[str, Any]]
    reported: Mapping[str, Any]


def forget() -> None:
    """Press anew at the next bake, and give back what is held for it."""
    state.prints = None


def shot_prints(wanted: BakeSettings, shot: Shot, ground: SoftGround, edits: Mapping[str, StepEdit]) -> Job[ShotPrints]:
    """What a shot leaves; errors as of `press_shot`."""
    source = yield from _source(wanted, shot, ground, edits)
    if source and state.prints and state.prints[0] == source:
        prints: ShotPrints = state.prints[1]
        return prints
    forget()  # room for those that come
    prints = yield from _pressed(wanted, shot, ground, edits)
    if source and prints.marks is None and _size(prints) <= LARGEST:
        state.prints = source, prints
    return prints


def _source(wanted: BakeSettings, shot: Shot, ground: SoftGround, edits: Mapping[str, StepEdit]) -> Job[str]:
    """A hash of all that the prints follow from; empty where they are of no mesh, or of more than can be compared."""
    if not isinstance(ground.terrain, MeshTerrain):
        return ""
    before, after = wanted.between(Acts.READING, Acts.RESPONDING), wanted.between(Acts.OUTPUT, Acts.OUTPUT)
    still = replace(ground, weathering=None)  # which the settings have
    skins = shot.skins if wanted.carves else {}
    hashing = report.hash_inputs.slices(before, after, shot.motions, still, edits, skins)
    return (yield from meanwhile(Progress("simulate", 0.0), hashing))


def _pressed(wanted: BakeSettings, shot: Shot, ground: SoftGround, edits: Mapping[str, StepEdit]) -> Job[ShotPrints]:
    at_end = Progress("simulate", 1.0)
    pressing = press_shot(wanted, shot.motions, ground, edits, shot.surface.factors if shot.surface else None)
    pressed = yield from counted(pressing, "simulate", wanted.frames[1] - wanted.frames[0] + 1)
    responses = [(each.motion, each.response) for each in pressed.responses]
    carving = with_carves.slices(pressed.left, responses, shot.skins, ground, wanted.surface)
    left = yield from meanwhile(at_end, carving)
    throwing = with_debris.slices(left, ground, wanted, pressed.loads)
    left, debris = yield from meanwhile(at_end, throwing)
    marking = marks_left.slices(left, shot.terrain, wanted, pressed.loads, debris)
    marks = yield from meanwhile(at_end, marking)
    measuring = gap_table.slices(pressed.responses, pressed.loads, shot.motions, shot.terrain, left.edited)
    gaps = yield from meanwhile(at_end, measuring)
    name = wanted.ground.name if wanted.ground else "the ground"
    checking = self_check.slices(pressed.loads, left.footprints, shot.terrain, wanted.cell_size_m, name)
    findings = yield from meanwhile(at_end, checking)
    happening = events.slices(pressed.loads, left.footprints, surface=wanted.surface, first_frame=wanted.frames[0])
    return ShotPrints(
        left,
        debris,
        marks,
        pressed.responses,
        (*findings, *_bottomed_out(wanted, left.footprints, name)),
        (yield from meanwhile(at_end, happening)),
        {"offsets_mm": offsets_mm(pressed.loads), "forces": pressed.forces, "gaps_mm": gaps},
    )


def _bottomed_out(wanted: BakeSettings, footprints: Sequence[Footprint], ground: str) -> list[Finding]:
    """What to say of steps that end at the bottom of the deepest layer of their surface."""
    by_depth = sorted(wanted.kinds[0], key=lambda kind: kind.material.deepest)
    findings = []
    for surface, material in {kind.surface: kind.material for kind in by_depth}.items():
        steps = [step for step in footprints if (step.surface or wanted.surface) == surface]
        findings += bottomed_out(steps, material, ground)
    return findings


def _size(*values: Any) -> int:
    """About the memory that values take [bytes], those that they share once."""
    waiting, seen, size = list(values), set[int](), 0
    while waiting:
        value = waiting.pop()
        if id(value) in seen or isinstance(value, type):
            continue
        seen.add(id(value))
        size += value.nbytes if isinstance(value, np.ndarray | PackedArray) else 50
        waiting += value.values() if isinstance(value, Mapping) else getattr(value, "__dict__", {}).values()
        waiting += value if isinstance(value, list | tuple) else ()
    return size
