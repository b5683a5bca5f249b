"""What is said of a bake: its inputs, tables for the report, and what no longer fits it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.loads.estimate import CharacterLoads
from ...core.loads.missed_steps import advice, missed_steps
from ...core.loads.sliding import treadmill_speed
from ...core.record.footprints import Footprint
from .. import properties, settings
from ..ground import ground_mesh, still_ground
from ..jobs import STAGES
from ..reading import staleness
from ..response import response_job
from .bake_checks import shortest_sole

Array = NDArray[np.float64]

FLOATING = "floating_mm"
"""Entry of a bake's summary: how far feet float above their prints [mm]."""

FEW_CELLS, ENOUGH_CELLS = 8, 27
"""Cells along a sole below which its outline is lost, and those that an adult's has at the default cell size."""

ADULT_LEG = 0.87
"""Length of the legs of a person of 77.5 kg and 1.78 m, hip to ground [m] (0.491 of stature; Drillis and Contini)."""

MASS_RANGE = 4.0
"""Ratio of mass to that of a person of the same leg length beyond which it is asked about."""


def warnings(
    footprints: Sequence[Footprint], loads: Sequence[CharacterLoads], cell_size: float, ground: str
) -> list[str]:
    """What the user should know of the footprints, with the remedy; the ground by its name."""
    found = []
    printed = {footprint.character for footprint in footprints}
    for character in loads:
        if character.motion.centre is None and character.motion.stands_still:
            found.append(
                f"'{character.motion.name}' does not move in these frames: look whether its action has keys in them, "
                "is assigned with its slot, and is not muted."
            )
        elif character.motion.name not in printed:
            found.append(
                f"'{character.motion.name}' leaves no print in these frames: look in the Character panel whether its "
                "soles are what touches the ground, and in the viewport whether they face down."
            )
        missed = missed_steps(character.motion, character.contacts)
        if missed:
            found.append(advice(character.motion.name, missed, f"'{ground}'"))
        belt = treadmill_speed(character.motion, character.contacts)
        if belt > 0:
            found.append(
                f"'{character.motion.name}' walks on the spot: its feet slide at {belt:.1f} m/s while they stand, and "
                "print over each other. Let the armature move ahead by as much, or use the animation with its root "
                "motion."
            )
    unplaced = sum(footprint.unplaced_rim_m3 for footprint in footprints)
    if unplaced > 0:
        found.append(
            f"{unplaced * 1e6:.0f} cm³ of displaced ground found no room at the edge of the ground: make it larger."
        )
    for motion in (character.motion for character in loads):
        length = shortest_sole([motion])
        if length < FEW_CELLS * cell_size:
            found.append(
                f"The soles of '{motion.name}' are only {length / cell_size:.0f} cells long: set the cell size to "
                f"{length / ENOUGH_CELLS * 100:.2g} cm to see their shape."
            )
        if motion.centre is not None:
            continue  # a thing has no legs to go by
        likely = properties.DEFAULT_MASS * (motion.leg_length / ADULT_LEG) ** 3
        if not 1 / MASS_RANGE < motion.mass / likely < MASS_RANGE:
            found.append(
                f"'{motion.name}' weighs {motion.mass:g} kg on legs of {motion.leg_length:.2g} m: a person of that "
                f"size weighs about {float(f'{likely:.2g}'):g} kg. Set Mass in the Character panel."
            )
    return found


def ground_warnings(ground: bpy.types.Object | None, frame: int) -> list[str]:
    """What the user should know of a ground that changes its shape over time, taken at a frame, with the remedy."""
    modifier = still_ground.changes_with_time(ground) if ground else ""
    if not (ground and modifier):
        return []
    return [
        f"Ground '{ground.name}' changes its shape over time by its modifier '{modifier}': it was taken as it is at "
        f"frame {frame}, where the bake starts. Apply the modifier at the frame that is wanted, or switch it off."
    ]


def summary(result: dict[str, Any]) -> dict[str, float]:
    """What the panel shows of a bake."""
    totals, timings = result["totals"], result["timings"]
    seconds = sum(timings[stage] for stage in STAGES)
    shown = {key: totals[key] for key in ground_mesh.SHOWN}
    return shown | {"seconds": seconds, FLOATING: response_job.floating_mm(result["gaps_mm"])}


def summary_of_prints(footprints: Sequence[Footprint]) -> dict[str, float]:
    """What the panel shows of prints that no bake reported, such as those kept of live mode."""
    return {
        "steps": len(footprints),
        "max_depth_m": max((footprint.max_depth_m for footprint in footprints), default=0.0),
        "peak_force_n": max((float(footprint.peak_force_n) for footprint in footprints), default=0.0),
    }


def offsets_mm(loads: Sequence[CharacterLoads]) -> dict[str, dict[str, float]]:
    """Constant float (positive) or sink of the source animation, by character and sole [mm]."""
    return {
        character.motion.name: {
            sole.sole.name: round(float(offset) * 1e3, 3)
            for sole, offset in zip(character.motion.soles, character.contacts.offset, strict=True)
        }
        for character in loads
    }


def stale_reasons(scene: bpy.types.Scene) -> tuple[str, ...]:
    """What has changed since the bake on the scene's ground, for the user to read; nothing if it is up to date."""
    return staleness.reasons(scene, settings.snapshot(scene))


def force_table(
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
