"""Feet that neither slide, float nor sink, as a layer: no soft ground is needed, and nothing is pressed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.composers.responses import CharacterResponse, standing_on
from ...core.errors import InputError
from ...core.legs.grounding import leg_soles, responding
from ...core.legs.sole_rim import posed_rim
from ...core.loads.estimate import CharacterLoads
from ...core.loads.sliding import treadmill_speed
from ...core.motion.motion import CharacterMotion
from ...core.numerics.intervals import runs
from ...core.record.ground_history import GroundHistory
from ...core.response.clean_feet import FootFaults, clean, foot_faults, missed_holds, resting, standing
from ...core.response.response import at_scene_frames, gaps
from ...core.settings import BakeSettings
from ..animation_layer.constraint_layer import LayerKind
from ..characters.character_setup import characters_of
from ..jobs import Job, Progress, meanwhile
from ..reading.shots import Shot, estimate_shot, read_shot, settings_of
from ..response import response_job
from ..response.character_keys import ReadRig
from ..translation import translated

EXACT = 0.1
"""Keys are left out where straight lines stay within this part of the tolerance of other layers."""

Faults = dict[str, dict[str, dict[str, dict[str, float]]]]
"""Before and after: by character, slide, float and penetration, p95 and max [mm]."""


@dataclass(frozen=True)
class CleanFeet:
    """Result of Clean Feet, apart from the layers.

    Attributes
    ----------
    feet : dict
        "before" and "after": by character "slide", "float" and "penetration", each "p95" and "max" [mm].
    """

    feet: Faults
    warnings: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"schema_version": 1, "feet": self.feet, "warnings": list(self.warnings)}

    @property
    def summary(self) -> str:
        """In a line."""
        largest = {
            when: max(kind["slide"]["max"] for kind in of_one.values()) for when, of_one in self.feet.items() if of_one
        }
        gap = max(max(kind[of]["max"] for of in ("float", "penetration")) for kind in self.feet["after"].values())
        return translated(
            "Feet slid by up to {before} mm, now by {after} mm; the largest gap left is {gap} mm",
            before=f"{largest['before']:.0f}",
            after=f"{largest['after']:.1f}",
            gap=f"{gap:.1f}",
        )


def clean_feet(scene: bpy.types.Scene) -> Job[CleanFeet]:
    """Put each character's feet where they stand, on the scene's ground as a hard floor, or else a flat one.

    Raises
    ------
    SoftGroundError
        If a shot cannot be read, or a rig cannot take the layer; nothing is changed then.
    """
    if not any(character.armature for character in characters_of(scene.softground)):
        raise InputError("No character here has feet to clean: add a character with an animated armature.")
    wanted = replace(settings_of(scene, grounded=True), output="RESPONSE")
    assert wanted.response is not None
    wanted = replace(wanted, response=replace(wanted.response, tilt=None))
    response_job.check_characters(wanted.characters)
    shot = yield from read_shot(wanted, LayerKind.CLEAN_FEET)
    shot = replace(shot, motions=shot.responding)
    stood = standing_on.slices(shot.motions, shot.terrain, wanted.response)
    standing = yield from meanwhile(Progress("sample", 1.0), stood)
    loads = yield from estimate_shot(wanted, replace(shot, motions=standing))
    cleaned, feet, missed = yield from _cleaned(wanted, shot, loads)
    layers = yield from response_job.layers_of(wanted, shot.rigs, cleaned, accuracy=EXACT)
    response_job.put_layers(scene.softground, wanted, layers, LayerKind.CLEAN_FEET)
    yield Progress("write", 1.0)
    return CleanFeet(feet, (*missed, *_left_out(wanted, shot)))


def _cleaned(
    wanted: BakeSettings, shot: Shot, loads: Sequence[CharacterLoads]
) -> Job[tuple[list[CharacterResponse], Faults, list[str]]]:
    """Each rigged character's response, what its feet did before and do after, and which foot locks hold nothing."""
    responses: list[CharacterResponse] = []
    missed: list[str] = []
    feet: Faults = {"before": {}, "after": {}}
    now, floor = Progress("simulate", 1.0), GroundHistory(shot.terrain)
    each = zip(shot.motions, loads, wanted.characters, strict=True)
    rigged = [entry for entry in each if entry[2].armature]
    for (motion, of_character, asked), rig in zip(rigged, shot.rigs, strict=True):
        _check(motion, of_character, rig)
        touching = at_scene_frames(of_character.contacts.standing, of_character.motion.frames, motion)
        touching = resting(motion, touching, shot.terrain)
        stands = yield from meanwhile(now, standing.slices(motion, touching, shot.terrain, asked.holds))
        response = yield from meanwhile(now, clean.slices(motion, touching, shot.terrain, asked.holds, stands))
        missed += [
            f"'{hold.foot}' of '{motion.name}' is not planted at frame {hold.frame:g}: its foot lock was ignored."
            for hold in missed_holds(motion, touching, asked.holds)
        ]
        missed += _travels(motion, touching & ~stands)
        after = responding(motion, response)
        for when, moved in (("before", motion), ("after", after)):
            faults = yield from meanwhile(now, foot_faults.slices(moved, touching, shot.terrain, stands))
            feet[when][motion.name] = _statistics(faults)
        made = yield from meanwhile(now, gaps.slices(motion, touching, floor, posed_rim))
        remaining = yield from meanwhile(now, gaps.slices(after, touching, floor, posed_rim))
        responses.append(CharacterResponse(motion, response, made, remaining, 0.0))
    return responses, feet, missed


def _check(motion: CharacterMotion, loads: CharacterLoads, rig: ReadRig) -> None:
    """Raise InputError, naming the remedy, where feet cannot be cleaned."""
    legs = leg_soles(motion)
    if not legs:
        raise InputError(
            f"'{motion.name}' has no leg with hip, knee and foot to clean: complete its joints in Properties > "
            "Physics > Body Bones. A leg needs two bones at least, and a foot: a bone of its own, or the shin's end."
        )
    parts = {control.part for control in rig.controls}
    if not all({f"shank_{side}", f"foot_{side}"} & parts for side in legs):
        raise InputError(
            f"The legs of '{motion.name}' cannot take a layer, as their IK depends on another object or ends at the "
            "shin, or other bones drive them: bake its action to FK bones (Animation > Bake Action) and clean its feet "
            "then."
        )
    if treadmill_speed(loads.motion, loads.contacts) > 0:
        raise InputError(
            f"'{motion.name}' walks on the spot, and planted feet would overstretch its legs: press Root Motion "
            "first, or key its travel."
        )


def _travels(motion: CharacterMotion, travels: NDArray[np.bool_]) -> list[str]:
    """Summary of feet that travel (F, S) along the floor."""
    said = []
    for sole, during in zip(motion.soles, travels.T, strict=True):
        ways = ", ".join(f"{motion.frames[a]:g}-{motion.frames[b - 1]:g}" for a, b in zip(*runs(during), strict=True))
        if ways:
            said.append(
                f"'{sole.sole.name}' of '{motion.name}' travels along the floor at frames {ways}, and was not held "
                "there: add a foot lock if it should stand still."
            )
    return said


def _left_out(wanted: BakeSettings, shot: Shot) -> tuple[str, ...]:
    """Note on soles that are not feet."""
    names: list[str] = []
    for motion, character in zip(shot.motions, wanted.characters, strict=True):
        if character.armature:
            feet = set(leg_soles(motion).values())
            names += [f"{sole.sole.name} of {motion.name}" for i, sole in enumerate(motion.soles) if i not in feet]
    return (f"Only feet with legs are cleaned; these stay as they are: {', '.join(names)}.",) if names else ()


def _statistics(faults: FootFaults) -> dict[str, dict[str, float]]:
    sizes: Mapping[str, NDArray[np.float64]] = {
        "slide": faults.slide,
        "float": faults.float_,
        "penetration": faults.penetration,
    }
    return {
        name: {
            "p95": round(float(np.percentile(size, 95)) * 1e3 if len(size) else 0.0, 3),
            "max": round(float(size.max(initial=0.0)) * 1e3, 3),
        }
        for name, size in sizes.items()
    }
