"""Report of a bake: its inputs, tables for the report, and what no longer fits it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import bpy

from ...core.composers.responses import floating_mm
from ...core.errors import InputError
from ...core.findings import Finding
from ...core.motion.motion import CharacterMotion
from ...core.record.footprints import Footprint
from ...core.record.record import load_edits
from ...core.record.typical_depth import typical_of
from ...core.settings import BakeSettings
from .. import settings
from ..ground import baked_ground, ground_mesh, still_ground
from ..jobs import STAGES
from ..reading import staleness
from ..sampling.skin_sampling import hidden_on, left_out_on
from ..weather import ground_weather as weather

FLOATING = "floating_mm"
"""Entry of a bake's summary: how far feet float above their prints [mm]."""

TYPICAL = "typical_depth_m"
"""Entry of a bake's summary: how deep its typical step is [m]."""
LAST_FRAME = "last_frame"
"""Entry of a bake's summary: the frame at which its last contact ends."""

BAKED_AT = "baked_at"
"""Entry of a bake's summary: when it was made [s], the same on all its grounds."""


def baked_grounds(options: Any) -> list[bpy.types.Object]:
    """Grounds of a scene with a bake, without those whose steps a later bake has; the first, where none has any."""
    grounds = settings.grounds_of(options)
    baked = [ground for ground in grounds if baked_ground.is_baked(ground)]
    shots = [_shot_on(ground) for ground in baked]
    return [
        ground
        for at, ground in enumerate(baked)
        if not any(shots[at].is_before(shot, is_listed_first=other < at) for other, shot in enumerate(shots))
    ] or grounds[:1]


@dataclass(frozen=True)
class _BakedShot:
    """What a bake on a ground was of: that ground and all of the shot by name, its characters, its frames; and when."""

    ground: str = ""
    grounds: frozenset[str] = frozenset()
    characters: frozenset[str] = frozenset()
    frames: tuple[int, int] = (0, 0)
    baked_at: float = 0.0

    def is_before(self, other: _BakedShot, *, is_listed_first: bool) -> bool:
        """True if another bake has the steps of this one, and is later, or listed first where nothing tells.

        Each bake writes all grounds of its shot: what it was about and has not written was written since. That tells
        of bakes of earlier versions, which do not know when they were made.
        """
        (start, end), (first, last) = self.frames, other.frames
        if not self.characters & other.characters or last < start or end < first:
            return False
        if self.baked_at != other.baked_at:
            return self.baked_at < other.baked_at
        if self.grounds == other.grounds:
            return False
        knows, is_known = other.ground in self.grounds, self.ground in other.grounds
        return knows if knows != is_known else is_listed_first


def _shot_on(ground: bpy.types.Object) -> _BakedShot:
    """The shot of the bake on a ground; one without characters where the record is damaged."""
    with suppress(InputError, KeyError, TypeError, ValueError, OverflowError):
        inputs = load_edits(bytes(baked_ground.stored_record(ground)))[0]["inputs"]
        grounds = [str(each["ground"]) for each in (inputs, *inputs.get("grounds", ()))]
        characters = frozenset(str(character["name"]) for character in inputs["characters"])
        baked_at = ground_mesh.summary_of(baked_ground.display_mesh_of(ground)).get(BAKED_AT, 0.0)
        return _BakedShot(grounds[0], frozenset(grounds), characters, baked_ground.frames_of(inputs), baked_at)
    return _BakedShot()


def note_prints(options: Any) -> None:
    """Note the grounds of a scene that have prints, so that they are known once they leave the list."""
    known = [*(item.object for item in options.printed), *settings.listed_grounds(options)]
    options.printed.clear()
    for ground in dict.fromkeys(filter(settings.exists, known)):
        if baked_ground.has_remains(ground):
            options.printed.add().object = ground


def forget_deleted(options: Any) -> None:
    """Take grounds that were deleted out of what `note_prints` noted, or the file would hold their prints for ever."""
    for number in reversed(range(len(options.printed))):
        if not settings.exists(options.printed[number].object):
            options.printed.remove(number)


def unlisted(options: Any) -> list[bpy.types.Object]:
    """Grounds with prints of bakes of a scene that are not among its grounds any more."""
    listed, printed = settings.listed_grounds(options), [item.object for item in options.printed]
    return [
        ground
        for ground in printed
        if ground not in listed and settings.exists(ground) and baked_ground.has_remains(ground)
    ]


def unlisted_findings(options: Any, wanted: BakeSettings) -> list[Finding]:
    """Findings about the `unlisted` grounds of a scene, without those on which other characters alone have walked."""
    present = {character.name for character in wanted.characters}
    return [
        Finding(
            "unlisted_prints",
            "note",
            f"'{ground.name}' keeps the prints of an earlier bake, and is not among the grounds any more.",
            "Clear them, or list it again, in the Ground panel.",
        )
        for ground in unlisted(options)
        if not (its := _shot_on(ground).characters) or its & present
    ]


def ground_findings(ground: bpy.types.Object | None, frame: int) -> list[Finding]:
    """Findings about a ground that changes its shape over time, read at one frame."""
    modifier = still_ground.changes_with_time(ground) if ground else ""
    if not (ground and modifier):
        return []
    return [
        Finding(
            "changing_ground",
            "warning",
            f"Ground '{ground.name}' changes its shape over time by its modifier '{modifier}': it was taken as it is "
            f"at frame {frame}, where the bake starts.",
            "Apply the modifier at the frame you want, or switch it off.",
        )
    ]


def hidden_skins(objects: settings.Objects, wanted: BakeSettings, motions: Sequence[CharacterMotion]) -> list[Finding]:
    """Feet of which a mesh is there that is not rendered, so that they print with a sole of average shape."""
    findings = []
    for character, motion in zip(wanted.characters, motions, strict=True):
        average = {m.sole.name for m in motion.soles if m.sole.prop is None and m.sole.underside is None}
        if not average or not character.armature:
            continue
        armature = settings.resolve(character.armature)
        bones = {
            bone for sole in character.soles if sole.name in average for bone in (sole.bone, sole.toe_bone) if bone
        }
        findings += [
            Finding(
                "hidden_skin",
                "warning",
                f"The feet of '{character.name}' print with a sole of average shape: '{body.name}', which covers them, "
                "is hidden from renders.",
                "Show it in renders and bake again, or leave it if those feet fit.",
            )
            for body in hidden_on(objects, armature, bones)[:1]
        ]
    return findings


def shapes_left_out(objects: settings.Objects, wanted: BakeSettings) -> list[Finding]:
    """Findings about deformers of the feet's skin that were not read."""
    findings = []
    for character in wanted.characters:
        if not character.armature:
            continue
        bones = {bone for sole in character.soles for bone in (sole.bone, sole.toe_bone, *sole.parts) if bone}
        findings += [
            Finding(
                "skin_left_out",
                "warning",
                f"The skin of '{body}' was read without {' and '.join(causes)}.",
                "Check that its feet lie in their prints; if not, apply it or switch it off.",
            )
            for body, causes in left_out_on(objects, settings.resolve(character.armature), bones).items()
        ]
    return findings


def summary(result: dict[str, Any]) -> dict[str, float]:
    """Summary of a bake that was just made, for the panel."""
    totals, timings = result["totals"], result["timings"]
    seconds = sum(timings[stage] for stage in STAGES)
    shown = {key: totals[key] for key in ground_mesh.SHOWN}
    last = max((step["frame_end"] for step in result["steps"]), default=0.0)
    floating = floating_mm(result["gaps_mm"])
    return shown | {"seconds": seconds, FLOATING: floating, LAST_FRAME: last, BAKED_AT: time.time()}


def summary_of_prints(footprints: Sequence[Footprint]) -> dict[str, float]:
    """Summary for the panel of prints that no bake reported, such as those kept of live mode."""
    return {
        "steps": len(footprints),
        "max_depth_m": max((footprint.max_depth_m for footprint in footprints), default=0.0),
        TYPICAL: typical_of(footprints),
        "peak_force_n": max((float(footprint.peak_force_n) for footprint in footprints), default=0.0),
    }


def stale_reasons(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Changes since the bake on the scene's ground, as texts for the user; none if it is up to date."""
    wanted = weather.felt(settings.snapshot(scene))
    return staleness.reasons(scene.softground.ground, scene.objects, wanted)
