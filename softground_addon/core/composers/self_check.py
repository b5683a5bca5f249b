"""A bake judged by what it was made from: the skin, the ground, the body's size and pace."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import BakeError
from ..findings import Finding
from ..ground.hard_ground import bare, up_to
from ..ground.heightfield import Terrain
from ..ground.material import GroundMaterial
from ..loads.contacts import LEAVE_HEIGHT
from ..loads.estimate import CharacterLoads
from ..loads.missed_steps import advice, missed_steps
from ..loads.missing_ground import beyond_edge
from ..loads.sliding import treadmill_speed
from ..motion.motion import CharacterMotion, LowSkin
from ..motion.people import MASS_RANGE, PERSON_MASS, likely_mass
from ..motion.sole_motion import shortest_length
from ..motion.units import scale_to_metres, wrong_unit
from ..numerics.slices import Slices, sliced
from ..pressing.sole_points import places, sole_points
from ..record.footprints import QUANTUM, Footprint
from ..skin.ground_level import SUNK
from ..skin.skin_motion import CALM_SPEED

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

OFF_SKIN = 0.012
"""The ground may be this far from where the skin rests, in body heights: 2 cm for an adult, the give of a shoe."""
NEAR = 0.015
"""Calm skin this near to where it rests touches, in body heights (`skin.bearing.TOUCH`)."""
BESIDE = 0.15
"""A step within this of touching skin is that skin's, in body heights: a foot's length."""
DISAGREE = 0.15
"""Share of steps, and of moments of rest, that may go without the other: brushes, and the ends of contacts."""
LEAST_REST = 3
"""Frames of rest without a step that may be the rounding of a contact's ends."""
BIN = 0.004
"""Step of the levels that are tried, in body heights (`skin.ground_level.BIN`)."""
STANDING_PERCENTILE = 20.0
"""Percentile of the lowest skin that is on the ground: a walker has a foot there nearly always."""
SOME_FRAMES = 200
"""Frames whose skin is looked up on the ground in one go."""

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
    """What is wrong with a bake, or may be.

    Parameters
    ----------
    loads : sequence of CharacterLoads
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
        steps = [footprint for footprint in footprints if footprint.character == motion.name]
        findings += _prints(character, steps, ground)
        findings += _size(motion, cell_size)
        findings += _feet_apart(character)
        findings += _pace(character, steps)
        findings += yield from _edge(motion, steps, terrain, ground)
        if motion.skin is not None:
            findings += yield from _skin(character, motion.skin, steps, terrain, ground)
        elif motion.stature > 0:
            findings += _level_on_slope(character, steps, terrain, ground, OFF_SKIN * motion.stature)
    unplaced = sum(footprint.unplaced_rim_m3 for footprint in footprints)
    if unplaced > 0:
        message = f"{unplaced * 1e6:.0f} cm³ of displaced ground did not fit at the edge of the ground"
        findings.append(Finding("rim_off_ground", "note", message, "make the ground larger."))
    return findings


def no_motion(motion: CharacterMotion) -> Finding | None:
    """What to say of a character that stands still."""
    if motion.centre is not None or not motion.stands_still:
        return None
    remedy = "check that its action has keys in them, is assigned with its slot, and is not muted."
    return Finding("no_motion", "warning", f"'{motion.name}' does not move in these frames", remedy)


def _prints(character: CharacterLoads, steps: Sequence[Footprint], ground: str) -> Iterator[Finding]:
    """Return whether it moves, prints and gets along."""
    motion, hard = character.motion, character.contacts.hard
    hard = np.zeros(1, dtype=bool) if hard is None else hard
    if still := no_motion(motion):
        yield still
    elif not steps and not np.any(hard):
        yield Finding(
            "no_print",
            "error",
            f"'{motion.name}' leaves no print in these frames",
            "check in Advanced > Contacts that its soles are what touches the ground, and in the viewport "
            "that they face down.",
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
                "check that its sole faces down, and that its bone in Contacts is right.",
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
            "Press Walk Ahead, or use the animation with its root motion.",
        )


def _size(motion: CharacterMotion, cell_size: float) -> Iterator[Finding]:
    """Return whether the body, its mass and the cells suit each other."""
    length = shortest_length(sole.sole.length for sole in motion.soles)
    if length < FEW_CELLS * cell_size:
        yield Finding(
            "few_cells",
            "warning",
            f"The soles of '{motion.name}' are only {length / cell_size:.0f} cells long",
            f"set the cell size to {length / ENOUGH_CELLS * 100:.2g} cm to see their shape.",
        )
    if motion.centre is not None:
        return  # a prop has no legs to go by
    captured = motion.two_legs and all(sole.sole.underside is None for sole in motion.soles)
    if unit := wrong_unit(motion.stature, captured=captured):
        size = f"{motion.stature:.0f} m" if motion.stature > 1 else f"{motion.stature * 100:.2g} cm"
        yield Finding(
            "unit_scale",
            "error" if wrong_unit(motion.stature) else "warning",
            f"'{motion.name}' is {size} tall: its file is in {unit}.",
            f"Press Scale by {scale_to_metres(motion.stature, captured=captured):g}, or leave it if the size is "
            "intended.",
        )
        return  # with its size, the mass that suits it changes
    likely, by = likely_mass(motion.skin.mass if motion.skin else 0.0, motion.size, two_legs=motion.two_legs)
    if not likely:
        likely, by = PERSON_MASS * (motion.leg_length / PERSON_LEG) ** 3, "the length of its legs"
    if not 1 / MASS_RANGE < motion.mass / likely < MASS_RANGE:
        yield Finding(
            "mass_of_size",
            "warning",
            f"'{motion.name}' weighs {motion.mass:g} kg, but {by} suggests about {float(f'{likely:.2g}'):g} kg.",
            "Set Mass.",
        )


def _feet_apart(character: CharacterLoads) -> Iterator[Finding]:
    """Return whether some feet float higher than others."""
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
        )


def _pace(character: CharacterLoads, steps: Sequence[Footprint]) -> Iterator[Finding]:
    """Return whether it walks as fast as legs of its length swing."""
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
        now = _middle(step, motion.frames)
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
        )
    ]


def _middle(step: Footprint, frames: Array) -> int:
    """The sample nearest to the middle of a step."""
    return int(np.abs(frames - (step.start_frame + step.end_frame) / 2).argmin())


@dataclass(frozen=True)
class _Touching:
    """Where skin rests on the ground."""

    skin: LowSkin
    on: Mask
    """Which parts are where they rest on the ground, (F, P)."""
    down: Mask
    """The same, also beyond its edge, and of parts that have sunk into it: some of their skin is at its level."""

    def near(self, step: Footprint, frames: slice, reach: float) -> Mask:
        """At which of some frames skin touches within reach of a step."""
        apart = np.linalg.norm(self.skin.position[frames, :, :2] - step.position[:2], axis=-1)
        calm = self.skin.rise[frames] < self.skin.calm
        return np.asarray((self.down[frames] & calm & (apart < reach)).any(axis=1))

    @property
    def rests(self) -> Mask:
        """When some skin touches and is calm however fast the body is, (F,)."""
        return np.asarray((self.on & (self.skin.rise < CALM_SPEED * self.skin.height)).any(axis=1))


def _skin(
    character: CharacterLoads, skin: LowSkin, steps: Sequence[Footprint], terrain: Terrain, ground: str
) -> Slices[list[Finding]]:
    """Return whether ground, steps and resting skin agree."""
    motion = character.motion
    beyond, soft = beyond_edge(motion, terrain), bare(terrain)
    height, has_ground = np.empty(skin.rise.shape), np.empty(skin.rise.shape, dtype=bool)
    for start in range(0, len(height), SOME_FRAMES):
        now = slice(start, start + SOME_FRAMES)
        x, y, z = np.moveaxis(skin.position[now], -1, 0)
        height[now] = z - up_to(beyond, z + LEAVE_HEIGHT * motion.leg_length).heights(x, y)
        has_ground[now] = np.isfinite(soft.heights(x, y))
        yield
    height[~np.isfinite(height)] = np.inf
    over = _resting(height, skin)
    if over is None:
        return []
    findings: list[Finding] = []
    if abs(over) > OFF_SKIN * skin.height:
        if level := _level_on_slope(character, steps, terrain, ground, abs(over)):
            return level
        side, ground_way, body_way = ("above", "up", "down") if over > 0 else ("below", "down", "up")
        findings.append(
            Finding(
                "ground_off_skin",
                "error",
                f"The skin of '{motion.name}' rests {abs(over) * 100:.1f} cm {side} '{ground}'",
                f"move the ground {ground_way} by as much, or the character {body_way}.",
            )
        )
    else:
        over = 0.0  # what presses is the ground itself, and the feet may rest a little apart
    rise = (height - over) / skin.height
    touching = _Touching(skin, (np.abs(rise) < NEAR) & has_ground, (rise < NEAR) & (rise > -SUNK))
    if steps:
        findings += yield from _skin_and_steps(motion, touching, steps)
    return findings


def _level_on_slope(
    character: CharacterLoads, steps: Sequence[Footprint], terrain: Terrain, ground: str, off: float
) -> list[Finding]:
    """Soles that lie level on ground that slopes, where they are `off` it [m], or without a skin may be."""
    motion, contacts = character.motion, character.contacts
    if not _stands_level_on_slope(motion, steps, terrain, off):
        return []
    slope = float(np.median(contacts.normal[contacts.touching][:, 2]))
    return [
        Finding(
            "level_on_slope",
            "error",
            f"The feet of '{motion.name}' stand level where '{ground}' slopes by {np.degrees(np.arccos(slope)):.0f}°",
            "on stairs, select a mesh of them and press Use Selected; on a hill, turn the feet to the slope.",
        )
    ]


def _stands_level_on_slope(motion: CharacterMotion, steps: Sequence[Footprint], terrain: Terrain, off: float) -> bool:
    """Return whether soles lie level on ground that slopes, so that no move of it mends that skin is `off` it [m]."""
    soles = {sole.sole.name: sole for sole in motion.soles if sole.sole.prop is None}
    spans = [np.zeros((0, 2))]
    for step in steps:
        if step.sole in soles:
            x, y, z = soles[step.sole].landmark_positions()[_middle(step, motion.frames)].T
            spans.append(np.ptp([z, z - terrain.heights(x, y)], axis=1)[None])
    known = np.concatenate(spans)
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return False
    of_sole, over_ground = np.median(known, axis=0)
    return bool(over_ground > max(off, 2 * of_sole))


def _resting(height: Array, skin: LowSkin) -> float | None:
    """How far over the ground the skin rests [m], by the low envelope or where calm skin is lowest most often."""
    lowest = height.min(axis=1)
    lowest = lowest[np.isfinite(lowest)]
    if not len(lowest):
        return None
    levels = [float(np.percentile(lowest, STANDING_PERCENTILE))]
    calm = np.where(skin.rise < CALM_SPEED * skin.height, height, np.inf).min(axis=1)
    calm = calm[np.isfinite(calm)]
    if len(calm):
        number = np.round(calm / (BIN * skin.height)).astype(np.int64)
        values, counts = np.unique(number, return_counts=True)
        votes = [counts[np.abs(values - value) <= 1].sum() for value in values]
        levels.append(float(calm[np.abs(number - values[int(np.argmax(votes))]) <= 1].mean()))
    return min(levels, key=abs)


def _skin_and_steps(motion: CharacterMotion, touching: _Touching, steps: Sequence[Footprint]) -> Slices[list[Finding]]:
    """Steps without skin, and skin that rests without a step."""
    frames, height = touching.skin.frames, touching.skin.height
    soles = {sole.sole.name: sole for sole in motion.soles}
    covered = np.zeros(len(frames), dtype=bool)
    seen, alone = 0, []
    for step in steps:
        yield
        sole = soles[step.sole]
        reach = max(BESIDE * height, sole.sole.length)
        first, last = np.searchsorted(frames, [step.start_frame - 1, step.end_frame + 1 + 1e-6])
        covered[first:last] |= touching.near(step, slice(first, last), reach)
        if sole.bears is not None:
            middle = _middle(step, frames)
            seen += 1
            if not touching.near(step, slice(middle, middle + 1), reach).any():
                alone.append(step.start_frame)
    findings = []
    if len(alone) > DISAGREE * seen:
        findings.append(
            Finding(
                "step_without_skin",
                "error",
                f"{len(alone)} of {seen} steps of '{motion.name}' print where no skin rests, from frame {alone[0]:.0f} "
                "on",
                "check in Advanced > Contacts that its contacts are the parts that touch the ground.",
            )
        )
    rests = touching.rests
    missed = np.flatnonzero(rests & ~covered)
    if len(missed) > max(DISAGREE * rests.sum(), LEAST_REST):
        findings.append(
            Finding(
                "skin_without_step",
                "error",
                f"Skin of '{motion.name}' rests on the ground without a print in {len(missed)} frames, from frame "
                f"{frames[missed[0]]:.0f} on",
                "add what rests there with Add Contact in Advanced > Contacts.",
            )
        )
    return findings


def bottomed_out(footprints: Sequence[Footprint], material: GroundMaterial, ground: str) -> list[Finding]:
    """What to say where steps end at the bottom of the layer, whose floors are then flat."""
    count = sum(footprint.max_depth_m > (1.0 - AT_BOTTOM) * material.deepest for footprint in footprints)
    if not count or count < MANY_AT_BOTTOM * len(footprints):
        return []
    message = f"{count} of {len(footprints)} steps press '{ground}' as far as it goes, {material.deepest * 100:.3g} cm"
    return [Finding("bottomed_out", "warning", message, "make the layer deeper, or choose a firmer ground.")]


RIM_TOLERANCE = 1e-6
"""Largest relative error of the rim's volume that passes (docs/model.md section 4)."""


def check_volumes(footprints: Sequence[Footprint], material: GroundMaterial, factors: Array | None = None) -> None:
    """Raise BakeError if a footprint breaks an invariant of docs/model.md section 4.

    Parameters
    ----------
    footprints : sequence of Footprint
    material : GroundMaterial
    factors : (V, 3) float array, optional
        What is painted on the ground: there, the rim's share lies between the least and the largest painted.
    """
    depth, rim = np.ones((2, 2)) if factors is None else (np.append(column, 1.0) for column in factors[:, 1:].T)
    least, most = np.clip(2.0 * material.poisson_ratio * np.array([rim.min(), rim.max()]), 0.0, 1.0)
    for footprint in footprints:
        raised = footprint.rim_m3 + footprint.unplaced_rim_m3
        rounding = QUANTUM * footprint.cell_size**2 * (len(footprint.rim.cells) + len(footprint.compression.cells))
        low, high = least * footprint.compressed_m3, most * footprint.compressed_m3
        if not low * (1 - RIM_TOLERANCE) - rounding <= raised <= high * (1 + RIM_TOLERANCE) + rounding:
            raise BakeError(
                f"The print of {footprint.sole} at frame {footprint.start_frame:.0f} raised {raised:.6g} m³ where "
                f"{high:.6g} m³ were displaced; nothing was written. Please report this as a bug."
            )
        fallen = np.max(footprint.tile(footprint.pressing) - footprint.tile(footprint.compression), initial=0.0)
        if footprint.max_depth_m > (material.deepest * depth.max() + fallen) * (1 + 1e-9):
            raise BakeError(
                f"The print of {footprint.sole} at frame {footprint.start_frame:.0f} is deeper than the layer; nothing "
                "was written. Please report this as a bug."
            )
