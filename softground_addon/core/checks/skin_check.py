"""Check of a bake by the skin: ground and prints must be where skin rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..findings import Finding
from ..ground.hard_ground import bare, up_to
from ..ground.heightfield import Terrain
from ..loads.contacts import LEAVE_HEIGHT
from ..loads.estimate import CharacterLoads
from ..loads.missing_ground import beyond_edge
from ..motion.motion import CharacterMotion, LowSkin
from ..numerics.arrays import Array, Mask
from ..numerics.slices import Slices
from ..record.footprints import Footprint
from ..skin.ground_level import SUNK
from ..skin.skin_motion import CALM_SPEED
from .contact_check import contact_check

OFF_SKIN = 0.012
"""Largest distance of the ground from resting skin, in body heights: 2 cm for an adult, the compliance of a shoe."""
NEAR = 0.015
"""Height over the resting skin up to which calm skin touches, in body heights (`skin.bearing.TOUCH`)."""
BESIDE = 0.15
"""Distance from touching skin within which a step is made by it, in body heights: a foot's length."""
DISAGREE = 0.15
"""Share of steps without skin, and of frames of rest without a step, that is no fault: brushes, ends of contacts."""
LEAST_REST = 3
"""Frames of rest without a step that are no fault: the ends of contacts are rounded. Of a step that an end of the shot
cuts, fewer frames do not tell whether its foot comes to rest."""
BIN = 0.004
"""Step of the levels that are tried, in body heights (`skin.ground_level.BIN`)."""
STANDING_PERCENTILE = 20.0
"""Percentile of the lowest skin that is on the ground: a walker has a foot there nearly always."""
FRAMES_AT_ONCE = 200
"""Frames whose skin is looked up on the ground in one go."""


def skin_check(
    character: CharacterLoads, skin: LowSkin, steps: Sequence[Footprint], terrain: Terrain, ground: str
) -> Slices[list[Finding]]:
    """Findings where ground, steps and resting skin disagree."""
    motion = character.motion
    extended, soft = beyond_edge(motion, terrain), bare(terrain)  # with the ground continued, and without hard objects
    height, has_ground = np.empty(skin.rise.shape), np.empty(skin.rise.shape, dtype=bool)
    for start in range(0, len(height), FRAMES_AT_ONCE):
        now = slice(start, start + FRAMES_AT_ONCE)
        x, y, z = np.moveaxis(skin.position[now], -1, 0)
        height[now] = z - up_to(extended, z + LEAVE_HEIGHT * motion.leg_length).heights(x, y)
        has_ground[now] = np.isfinite(soft.heights(x, y))
        yield
    height[~np.isfinite(height)] = np.inf
    resting_height = _resting(height, skin)
    if resting_height is None:
        return []
    findings: list[Finding] = []
    if abs(resting_height) > OFF_SKIN * skin.height:
        if level := level_on_slope(character, steps, terrain, ground, abs(resting_height)):
            return level
        side, ground_way, body_way = ("above", "up", "down") if resting_height > 0 else ("below", "down", "up")
        findings.append(
            Finding(
                "ground_off_skin",
                "error",
                f"The skin of '{motion.name}' rests {abs(resting_height) * 100:.1f} cm {side} '{ground}'",
                f"move the ground {ground_way} by as much, or the character {body_way}.",
                {"character": motion.name, "height": round(resting_height, 4)},
            )
        )
    else:
        resting_height = 0.0  # what presses is the ground itself, and the feet may rest a little apart
    rise = (height - resting_height) / skin.height
    touching = _Touching(skin, (np.abs(rise) < NEAR) & has_ground, (rise < NEAR) & (rise > -SUNK))
    if steps:
        findings += yield from _skin_and_steps(motion, touching, steps)
    named = yield from contact_check(character, skin, rise, has_ground)
    known = {finding.code for finding in findings}
    return findings + [finding for finding in named if finding.code not in known]


def level_on_slope(
    character: CharacterLoads, steps: Sequence[Footprint], terrain: Terrain, ground: str, off: float
) -> list[Finding]:
    """Finding that soles lie level on ground that slopes; none where the slope explains less than a distance `off` [m].

    `off` is that of the resting skin from the ground, or 0 without a skin.
    """
    motion, contacts = character.motion, character.contacts
    if not _stands_level(motion, steps, terrain, off):
        return []
    slope = float(np.median(contacts.normal[contacts.touching][:, 2]))
    return [
        Finding(
            "level_on_slope",
            "error",
            f"The feet of '{motion.name}' stand level where '{ground}' slopes by {np.degrees(np.arccos(slope)):.0f}°",
            "on stairs, take a mesh of them for the ground; on a hill, turn the feet to the slope.",
            {"character": motion.name, "slope": round(float(np.arccos(slope)), 4)},
        )
    ]


def _stands_level(motion: CharacterMotion, steps: Sequence[Footprint], terrain: Terrain, off: float) -> bool:
    """True if soles lie level on ground that slopes by more than `off` [m] under them: moving it then mends nothing."""
    soles = {sole.sole.name: sole for sole in motion.soles if sole.sole.prop is None}
    spans = [np.zeros((0, 2))]
    for step in steps:
        if step.sole in soles:
            x, y, z = soles[step.sole].landmark_positions()[step.middle(motion.frames)].T
            spans.append(np.ptp([z, z - terrain.heights(x, y)], axis=1)[None])
    known = np.concatenate(spans)
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return False
    of_sole, over_ground = np.median(known, axis=0)
    return bool(over_ground > max(off, 2 * of_sole))


@dataclass(frozen=True)
class _Touching:
    """Contacts of the skin with the ground."""

    skin: LowSkin
    on: Mask
    """True for parts (F, P) that rest on the ground."""
    down: Mask
    """The same, with parts beyond its edge and those that have sunk into it, whose skin is partly at its level."""

    def near(self, step: Footprint, frames: slice, reach: float) -> Mask:
        """True for those of the frames (N,) at which skin touches within reach of a step [m]."""
        apart = np.linalg.norm(self.skin.position[frames, :, :2] - step.position[:2], axis=-1)
        calm = self.skin.rise[frames] < self.skin.calm
        return np.asarray((self.down[frames] & calm & (apart < reach)).any(axis=1))

    @property
    def rests(self) -> Mask:
        """True while some skin touches and is calm however fast the body is, (F,)."""
        return np.asarray((self.on & (self.skin.rise < CALM_SPEED * self.skin.height)).any(axis=1))


def _resting(height: Array, skin: LowSkin) -> float | None:
    """Height over the ground of resting skin [m], by the low envelope or where calm skin is lowest most often."""
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
    checked, without_skin = 0, []
    for step in steps:
        yield
        sole = soles[step.sole]
        reach = max(BESIDE * height, sole.sole.length)
        first, last = np.searchsorted(frames, [step.start_frame - 1, step.end_frame + 1 + 1e-6])
        covered[first:last] |= touching.near(step, slice(first, last), reach)
        is_cut = (first == 0) != (last == len(frames))  # its middle may be beyond that end of the shot
        if sole.bears is not None and not (is_cut and step.end_frame - step.start_frame < LEAST_REST):
            middle = step.middle(frames)
            checked += 1
            if not touching.near(step, slice(first, last) if is_cut else slice(middle, middle + 1), reach).any():
                without_skin.append(step.start_frame)
    findings = []
    if len(without_skin) > DISAGREE * checked:
        findings.append(
            Finding(
                "step_without_skin",
                "error",
                f"{len(without_skin)} of {checked} steps of '{motion.name}' print where no skin rests, from frame "
                f"{without_skin[0]:.0f} on",
                "check that its contacts are the parts that touch the ground.",
                {"character": motion.name, "frames": without_skin, "steps": checked},
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
                "add what rests there to its contacts.",
                {"character": motion.name, "frames": len(missed), "frame": float(frames[missed[0]])},
            )
        )
    return findings
