"""A bake judged by what it was made from: the skin, the ground, the body's size and pace."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from ..findings import Finding
from ..ground.heightfield import Terrain
from ..ground.material import GroundMaterial
from ..imprints.sole_points import places, sole_points
from ..loads.estimate import CharacterLoads
from ..loads.hovering import hovering
from ..loads.missed_steps import advice, missed_steps
from ..loads.sliding import treadmill_speed
from ..motion.motion import CharacterMotion
from ..motion.people import MASS_RANGE, PERSON_MASS, likely_mass
from ..motion.sole_motion import shortest_length
from ..motion.units import scale_to_metres, wrong_unit
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from .skin_check import OFF_SKIN, level_on_slope, skin_check
from .uneven_slides import uneven_slides

PERSON_LEG = 0.87
"""A person of 1.78 m, hip to ground [m] (0.491 of stature; Drillis and Contini 1966)."""
APART = 0.02
"""Difference of the offsets of one character's feet that is no error of a pose, up to an adult's size [m]; of a larger
one, it grows with the legs."""
FEW_CELLS, ENOUGH_CELLS = 8, 27
"""Cells along a sole below which its outline is lost, and those that an adult's has at the default cell size."""
BEARS = 0.25
"""A sole that bears more than this bears the body, in body weights."""
ON_GROUND = 0.9
"""A sole with less of it over the ground stands on the edge: its print is cut off there."""
WALK_RATIO = 0.384 / (PERSON_LEG * np.sqrt(PERSON_LEG / 9.81))
"""Step length over step frequency, in leg·sqrt(leg/gravity): 0.0064 m/(steps/min) at any free speed (Sekiya et al.
1997, doi:10.2519/jospt.1997.26.5.266). Played k times slower, it is k times as large."""
SLOW_MOTION = 3.0
"""That factor from which a motion is in slow motion, whatever its swings; a creeping walk comes to 2."""
SLOW_STRIDES, SLOW_SWINGS = 1.6, 2.4
"""That factor, and the time of a swing in sqrt(leg/gravity), that only slow motion passes together: a leg swings in 1.4
at free speed, and in 2 in a creeping walk, as the leg's own pendulum sets it."""
LEAST_STRIDE = 0.8
"""Shorter strides are shuffles, which have no pace, in leg lengths."""
AT_BOTTOM = 0.02
"""A print is as deep as the ground gives way if it lacks no more than this part of it."""
MANY_AT_BOTTOM = 0.25
"""Share of such prints that is said."""


@sliced
def self_check(
    loads: Sequence[CharacterLoads], footprints: Sequence[Footprint], terrain: Terrain, cell_size: float, ground: str
) -> Slices[list[Finding]]:
    """Findings about a bake that is wrong, or may be.

    Parameters
    ----------
    footprints : sequence of Footprint
        All that they left.
    terrain : Terrain
        The undisturbed ground.
    cell_size : float
        [m]
    ground : str
        Its name.
    """
    findings: list[Finding] = []
    for character in loads:
        yield
        motion = character.motion
        if character.hovers:
            findings += [hovering(motion.name, character.hovers), *_size(motion, cell_size)]
            continue
        steps = [footprint for footprint in footprints if footprint.character == motion.name]
        findings += _prints(character, steps, ground)
        findings += _size(motion, cell_size)
        findings += _feet_apart(character)
        findings += _pace(character, steps)
        findings += yield from _edge(motion, steps, terrain, ground)
        if motion.skin is not None:
            findings += yield from skin_check(character, motion.skin, steps, terrain, ground)
        elif motion.stature > 0:
            findings += level_on_slope(character, steps, terrain, ground, OFF_SKIN * motion.stature)
    unplaced = sum(footprint.unplaced_rim_m3 for footprint in footprints)
    if unplaced > 0:
        message = f"{unplaced * 1e6:.0f} cm³ of displaced ground did not fit at the edge of the ground"
        findings.append(Finding("rim_off_ground", "note", message, "make the ground larger.", {"volume": unplaced}))
    return findings


def no_motion(motion: CharacterMotion) -> Finding | None:
    """Finding about a character that stands still."""
    if motion.centre is not None or not motion.stands_still:
        return None
    remedy = "check that its action has keys in them, is assigned with its slot, and is not muted."
    said = f"'{motion.name}' does not move in these frames"
    return Finding("no_motion", "warning", said, remedy, {"character": motion.name})


def _prints(character: CharacterLoads, steps: Sequence[Footprint], ground: str) -> Iterator[Finding]:
    """Findings where it stands still, leaves no prints, or walks on the spot."""
    motion, hard = character.motion, character.contacts.hard
    hard = np.zeros(1, dtype=bool) if hard is None else hard
    if still := no_motion(motion):
        yield still
    elif not steps and not np.any(hard):
        yield Finding(
            "no_print",
            "error",
            f"'{motion.name}' leaves no print in these frames",
            "check that its soles are what touches the ground, and that they face down.",
            {"character": motion.name},
        )
    else:
        pressing = np.where(hard, 0.0, character.forces.forces[..., 2])
        load = pressing.max(axis=0) / (motion.mass * motion.gravity)
        bearing = {sole.sole.name for sole, most in zip(motion.soles, load, strict=True) if most > BEARS}
        mute = sorted(bearing - {step.sole for step in steps})
        if mute:
            yield Finding(
                "sole_without_print",
                "warning",
                f"{', '.join(map(repr, mute))} of '{motion.name}' bears load and leaves no print",
                "check that its sole faces down, and that its bone is the right one.",
                {"character": motion.name, "soles": mute},
            )
    missed = missed_steps(motion, character.contacts)
    if missed:
        yield advice(motion.name, missed, f"'{ground}'")
    belt = treadmill_speed(motion, character.contacts)
    if belt > 0:
        yield Finding(
            "walks_in_place",
            "warning",
            f"'{motion.name}' walks on the spot: its feet slide at {belt:.1f} m/s while planted, and print over "
            "each other.",
            "Use the animation with its root motion.",
            {"character": motion.name, "speed": round(belt, 3)},
        )
    if uneven := uneven_slides(motion, character.contacts):
        yield uneven


def _size(motion: CharacterMotion, cell_size: float) -> Iterator[Finding]:
    """Findings where the body, its mass and the cells do not suit each other."""
    length = shortest_length(sole.sole.length for sole in motion.soles)
    if length < FEW_CELLS * cell_size:
        yield Finding(
            "few_cells",
            "warning",
            f"The soles of '{motion.name}' are only {length / cell_size:.0f} cells long",
            f"set the cell size to {length / ENOUGH_CELLS * 100:.2g} cm to see their shape.",
            {"character": motion.name, "cell_size": float(f"{length / ENOUGH_CELLS:.2g}")},
        )
    if motion.centre is not None:
        return  # a prop has no legs to go by
    captured = motion.two_legs and all(sole.sole.underside is None for sole in motion.soles if sole.sole.prop is None)
    if unit := wrong_unit(motion.stature, captured=captured):
        size = f"{motion.stature:.0f} m" if motion.stature > 1 else f"{motion.stature * 100:.2g} cm"
        yield Finding(
            "unit_scale",
            "error" if wrong_unit(motion.stature) else "warning",
            f"'{motion.name}' is {size} tall: its file is in {unit}.",
            f"Scale it by {(factor := scale_to_metres(motion.stature, captured=captured)):g}, or leave it if that is "
            "intended.",
            {"character": motion.name, "factor": factor},
        )
        return  # with its size, the mass that suits it changes
    likely, by = likely_mass(motion.skin.mass if motion.skin else 0.0, motion.size, two_legs=motion.two_legs)
    if not likely:
        likely, by = PERSON_MASS * (motion.leg_length / PERSON_LEG) ** 3, "the length of its legs"
    if not 1 / MASS_RANGE < motion.mass / likely < MASS_RANGE:
        size = f"is {motion.size:.2g} m in size and " if motion.size > 0 else ""
        yield Finding(
            "mass_of_size",
            "warning",
            f"'{motion.name}' {size}weighs {motion.mass:g} kg, but {by} suggests about {float(f'{likely:.2g}'):g} kg.",
            "Give it its mass, or scale it if that is not its size.",
            {"character": motion.name, "mass": motion.mass, "likely": float(f"{likely:.2g}")},
        )


def _feet_apart(character: CharacterLoads) -> Iterator[Finding]:
    """A finding where some feet are planted higher than others."""
    motion, contacts = character.motion, character.contacts
    feet = [number for number, sole in enumerate(motion.soles) if sole.sole.prop is None]
    offset = {motion.soles[n].sole.name: float(contacts.offset[n]) for n in feet if contacts.touching[:, n].any()}
    if motion.centre is not None or len(offset) < 2:
        return
    high, low = max(offset, key=offset.__getitem__), min(offset, key=offset.__getitem__)
    apart = offset[high] - offset[low]
    if apart > APART * max(motion.leg_length / PERSON_LEG, 1.0):
        yield Finding(
            "feet_apart",
            "warning",
            f"'{high}' of '{motion.name}' is planted {apart * 100:.1f} cm higher above the ground than '{low}'",
            "check that both soles have the right bones, and the ground level under them.",
            {"character": motion.name, "high": high, "low": low, "apart": round(apart, 4)},
        )


def _pace(character: CharacterLoads, steps: Sequence[Footprint]) -> Iterator[Finding]:
    """A finding where it walks slower than legs of its length swing."""
    motion = character.motion
    if motion.centre is not None or motion.four_legged:
        return
    belt, hard = treadmill_speed(motion, character.contacts), character.contacts.hard
    slower, swings = [], []
    for number, sole in enumerate(motion.soles):
        of_sole = [step for step in steps if step.sole == sole.sole.name]
        on_hard = motion.frames[:0] if hard is None else motion.frames[hard[:, number]]
        for step, after in itertools.pairwise(of_sole):
            if ((on_hard > step.end_frame) & (on_hard < after.start_frame)).any():
                continue  # it has stepped between them
            seconds = (after.start_frame - step.start_frame) / motion.frame_rate
            stride = float(np.linalg.norm((after.position - step.position)[:2])) + belt * seconds
            if stride > LEAST_STRIDE * motion.leg_length:
                slower.append(stride * seconds / (4 * motion.leg_length * motion.pendulum_time) / WALK_RATIO)
                swings.append((after.start_frame - step.end_frame) / motion.frame_rate / motion.pendulum_time)
    factor = float(np.median(slower)) if slower else 0.0
    if factor > SLOW_MOTION or (factor > SLOW_STRIDES and np.median(swings) > SLOW_SWINGS):
        yield Finding(
            "slow_motion",
            "note",
            f"'{motion.name}' walks about {factor:.1f} times slower than the length of its legs suggests",
            "set the frame rate of the scene to that of the animation, or leave it if slow motion, or a model of a "
            "larger body, is intended.",
            {"character": motion.name, "factor": round(factor, 3)},
        )


def _edge(motion: CharacterMotion, steps: Sequence[Footprint], terrain: Terrain, ground: str) -> Slices[list[Finding]]:
    """Steps with a part of the sole beyond the edge of the ground, whose prints end there."""
    first, least, count = 0.0, 1.0, 0
    soles = {sole.sole.name: sole for sole in motion.soles if sole.sole.prop is None}
    angle = np.arange(16) / 16 * 2 * np.pi
    ring = np.stack([np.cos(angle), np.sin(angle)])
    for step in steps:
        yield
        sole = soles.get(step.sole)
        if sole is None:
            continue
        around = step.position[:2, None] + ring * sole.sole.length
        if np.isfinite(terrain.heights(*around)).all():
            continue
        now = step.middle(motion.frames)
        pose = sole.transforms[now : now + 1]
        points = sole_points(sole.sole, pose)
        area = np.concatenate([patch.area for patch in points.patches])
        share = float(area[np.isfinite(terrain.heights(*(at[0] for at in places(points, pose))))].sum() / area.sum())
        if share < ON_GROUND:
            first, least, count = first if count else step.start_frame, min(least, share), count + 1
    if not count:
        return []
    which = f"{count} steps of '{motion.name}' hang" if count > 1 else f"1 step of '{motion.name}' hangs"
    return [
        Finding(
            "edge_of_ground",
            "warning",
            f"{which} over the edge of '{ground}', from frame {first:.0f} on, with as little as {least * 100:.0f} % of "
            "the sole on it",
            "extend the ground beyond the steps.",
            {"character": motion.name, "steps": count, "frame": first, "share": round(least, 3)},
        )
    ]


def bottomed_out(footprints: Sequence[Footprint], material: GroundMaterial, ground: str) -> list[Finding]:
    """Finding about steps that end at the bottom of the layer, whose floors are then flat."""
    count = sum(footprint.max_depth_m > (1.0 - AT_BOTTOM) * material.deepest for footprint in footprints)
    if not count or count < MANY_AT_BOTTOM * len(footprints):
        return []
    message = f"{count} of {len(footprints)} steps press '{ground}' as far as it goes, {material.deepest * 100:.3g} cm"
    facts = {"steps": int(count), "deepest": material.deepest}
    return [Finding("bottomed_out", "warning", message, "make the layer deeper, or choose a firmer ground.", facts)]
