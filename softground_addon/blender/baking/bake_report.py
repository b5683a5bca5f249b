"""Report of a bake: its inputs, tables for the report, and what no longer fits it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import bpy

from ...core.composers.responses import floating_mm
from ...core.errors import InputError
from ...core.findings import Finding
from ...core.motion.motion import CharacterMotion
from ...core.record.footprints import Footprint
from ...core.record.record import load_edits
from ...core.record.typical_depth import typical_of
from ...core.settings import BakeSettings, identity_of
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


@dataclass(frozen=True)
class HeardBake:
    """A bake on a ground, without what later bakes have of its characters.

    Attributes
    ----------
    characters : mapping of str to str
        Who each of its characters is (`core.settings.identity_of`), by name.
    later : tuple of (set of str, (int, int))
        Of each bake that is later: the same of its characters, and its first and last frame.
    """

    ground: bpy.types.Object
    frames: tuple[int, int]
    characters: Mapping[str, str]
    later: tuple[tuple[frozenset[str], tuple[int, int]], ...]

    def has(self, character: str, frame: float) -> bool:
        """True if no later bake has what a character does at a frame."""
        who = self.characters.get(character, character)
        return not any(who in theirs and first <= frame <= last for theirs, (first, last) in self.later)

    @property
    def is_heard(self) -> bool:
        """True if something is left of it."""
        first, last = self.frames
        ends = {first, *(end + 1 for _, (_, end) in self.later if first <= end < last)}
        return not self.later or any(self.has(who, frame) for who in self.characters for frame in ends)


def heard_bakes(options: Any) -> list[HeardBake]:
    """Bakes on the grounds of a scene, each without the steps that a later one has; of the first, where none is left.

    Characters are known whatever their rigs are called by then.
    """
    grounds = settings.grounds_of(options)
    shots = [_shot_on(ground) for ground in grounds if baked_ground.is_baked(ground)]
    bakes = []
    for at, (shot, ground) in enumerate(zip(shots, filter(baked_ground.is_baked, grounds), strict=True)):
        later = [each for n, each in enumerate(shots) if shot.is_before(each, is_listed_first=n < at)]
        known = tuple((frozenset(each.characters.values()), each.frames) for each in later)
        bakes.append(HeardBake(ground, shot.frames, shot.characters, known))
    return [each for each in bakes if each.is_heard] or [HeardBake(each, (0, 0), {}, ()) for each in grounds[:1]]


def baked_grounds(options: Any) -> list[bpy.types.Object]:
    """Grounds of the `heard_bakes` of a scene."""
    return [each.ground for each in heard_bakes(options)]


@dataclass(frozen=True)
class _BakedShot:
    """What a bake on a ground was of: that ground and all of the shot by name, its characters, its frames; and when."""

    ground: str = ""
    grounds: frozenset[str] = frozenset()
    characters: Mapping[str, str] = field(default_factory=dict)
    frames: tuple[int, int] = (0, 0)
    baked_at: float = 0.0

    def is_before(self, other: _BakedShot, *, is_listed_first: bool) -> bool:
        """True if another bake has steps of this one, and is later, or listed first where nothing tells.

        Each bake writes all grounds of its shot: what it was about and has not written was written since. That tells
        of bakes of earlier versions, which do not know when they were made.
        """
        (start, end), (first, last) = self.frames, other.frames
        if set(self.characters.values()).isdisjoint(other.characters.values()) or last < start or end < first:
            return False
        if self.baked_at != other.baked_at:
            return self.baked_at < other.baked_at
        if self.grounds == other.grounds:
            return False
        knows, is_known = other.ground in self.grounds, self.ground in other.grounds
        return knows if knows != is_known else is_listed_first


def _shot_on(ground: bpy.types.Object) -> _BakedShot:
    """The shot of the bake on a ground; one without characters where the record is damaged."""
    with suppress(AttributeError, InputError, KeyError, TypeError, ValueError, OverflowError):
        inputs = load_edits(bytes(baked_ground.stored_record(ground)))[0]["inputs"]
        grounds = [str(each["ground"]) for each in (inputs, *inputs.get("grounds", ()))]
        characters = {str(character["name"]): identity_of(character) for character in inputs["characters"]}
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
    present = {character.added_as or character.name for character in wanted.characters}
    return [
        Finding(
            "unlisted_prints",
            "note",
            f"'{ground.name}' keeps the prints of an earlier bake, and is not among the grounds any more.",
            "Clear them, or list it again, in the Ground panel.",
        )
        for ground in unlisted(options)
        if not (its := _shot_on(ground).characters) or not present.isdisjoint(its.values())
    ]


def ground_findings(ground: bpy.types.Object | None, frame: int) -> list[Finding]:
    """Findings about a ground that changes its shape over time, read at one frame."""
    by = still_ground.changes_shape(ground) if ground else ""
    if not (ground and by):
        return []
    return [
        Finding(
            "changing_ground",
            "warning",
            f"Ground '{ground.name}' changes its shape over time by {by}: it was taken as it is at frame {frame}, "
            "where the bake starts.",
            "Apply that at the frame you want, or switch it off.",
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
