"""Throws of a step: the moments at which its sole lands, pushes off and sheds, from its motion and its loads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from ..events import phases
from ..events.phases import Phase
from ..ground import surfaces
from ..ground.surfaces import ThrownMatter
from ..loads.estimate import CharacterLoads
from ..numerics.arrays import Array, Mask
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from ..record.throws import Throw, ThrowKind

PUSHING = 0.25
"""Time before a sole leaves in which it pushes off [s]."""


PRESSED = 0.1
"""Below this load the direction of an estimated force tells nothing, in body weights: both its parts are what the
low-pass leaves."""


SHEDDING = 0.2
"""Time in which a sole sheds what it carries, but for 1/e [s]."""


LONGEST_SHED = 0.6
"""After that it is clean [s]."""


LANDING_TIME = 0.1
"""What is compressed within this time after the strike is compressed by the landing [s, of an adult]."""


@sliced
def throws_of(loads: Sequence[CharacterLoads], footprints: Sequence[Footprint], *, surface: str) -> Slices[list[Throw]]:
    """Throws of the steps of a bake.

    Parameters
    ----------
    footprints : sequence of Footprint
        Prints of the loads.
    """
    throws: list[Throw] = []
    for character in loads:
        of_character = [phase for phase in phases.phases(character) if not phase.hard]
        sliding = np.zeros(character.contacts.touching.shape, bool)
        speed = cache(partial(phases.slide_speed, character))
        for phase in of_character:
            if phase.kind == "slide_start":
                sliding[phase.first : phase.last, phase.sole] = True
        for phase in of_character:
            yield
            number = _footprint_of(character, phase, footprints)
            if number is not None:
                of_step = surfaces.find(footprints[number].surface or surface)
                throws += _throws(character, phase, number, of_step.thrown, sliding, speed(phase.sole))
    return throws


def _throws(
    loads: CharacterLoads, phase: Phase, number: int, matter: ThrownMatter, sliding: Mask, speed: Array
) -> Iterator[Throw]:
    motion, step = loads.motion, loads.motion.time_step
    if phase.kind in ("heel_strike", "land"):
        landing = phases.landing_speed(loads, phase.sole, phase.at)
        middle = phases.place_of(loads, phase.sole, phase.at)
        along = phases.sole_velocity(loads, phase.sole, max(phase.at - 1, 0))
        rows = np.concatenate([np.ones(1), np.zeros(3), middle, along])[None]
        yield _throw(loads, phase, number, ThrowKind.LANDING, np.array([phase.at]), rows, landing)
    if phase.kind == "slide_start":  # what slides under load has overcome what the ground can bear
        steps = np.arange(phase.first, phase.last)
        slid = speed[steps] * step
        _, velocities = phases.sole_points_at(loads, phase.sole, steps)
        aim = velocities.mean(axis=1) * (1.0, 1.0, 0.0)
        aim /= np.maximum(np.linalg.norm(aim, axis=1, keepdims=True), 1e-9)
        yield _throw(loads, phase, number, ThrowKind.PUSH, steps, _rows(loads, phase.sole, steps, slid, aim))
    if phase.kind == "toe_off":
        steps = np.arange(max(0, phase.at - max(1, round(PUSHING / step))), phase.at)
        slid = speed[steps] * _slips(loads, phase, steps, matter) * step * ~sliding[steps, phase.sole]
        if slid.any():
            force = loads.forces.forces[steps, phase.sole, :2]
            aim = np.zeros((len(steps), 3))
            aim[:, :2] = -force / np.maximum(np.linalg.norm(force, axis=1), 1e-9)[:, None]
            yield _throw(loads, phase, number, ThrowKind.PUSH, steps, _rows(loads, phase.sole, steps, slid, aim))
        steps = np.arange(phase.at, min(len(motion.frames) - 1, phase.at + round(LONGEST_SHED / step)))
        weights = np.exp(-(steps - phase.at) * step / SHEDDING) * step / SHEDDING
        if len(steps):
            rows = _rows(loads, phase.sole, steps, weights, np.zeros((len(steps), 3)))
            yield _throw(loads, phase, number, ThrowKind.SHED, steps, rows)


def _throw(
    loads: CharacterLoads,
    phase: Phase,
    number: int,
    kind: ThrowKind,
    steps: NDArray[np.intp],
    rows: Array,
    speed: float = 0.0,
) -> Throw:
    motion = loads.motion
    return Throw(
        number,
        phase.kind,
        kind,
        phases.is_foot(motion.soles[phase.sole]),
        first=float(motion.frames[min(steps[0], len(motion.frames) - 1)]),
        spacing=float(motion.frames[-1] - motion.frames[0]) / max(1, len(motion.frames) - 1),
        speed=speed,
        landed_by=float(motion.frames[min(phase.at, len(motion.frames) - 1)] + LANDING_TIME * motion.adult_second),
        samples=rows.astype(np.float32),
    )


def _rows(loads: CharacterLoads, sole: int, steps: NDArray[np.intp], weights: Array, aim: Array) -> Array:
    """Samples as `Throw` has them."""
    followed = phases.sole_points_at(loads, sole, steps)
    parts = (weights[:, None], aim, *(part.reshape(len(steps), -1) for part in followed))
    return np.concatenate(parts, axis=1)


def _slips(loads: CharacterLoads, phase: Phase, steps: NDArray[np.intp], matter: ThrownMatter) -> Mask:
    """True for steps in which a sole pushes along the ground harder than that can bear, (K,).

    Where it hardly presses, the direction of its force tells nothing.
    """
    normal, force = loads.contacts.normal[steps, phase.sole], loads.forces.forces[steps, phase.sole]
    pressing = np.einsum("ni,ni->n", force, normal)
    along = np.linalg.norm(force - pressing[:, None] * normal, axis=1)
    loaded = pressing > PRESSED * loads.motion.mass * loads.motion.gravity
    return np.asarray(loaded & (along > np.tan(np.radians(matter.repose)) * pressing))


def _footprint_of(loads: CharacterLoads, phase: Phase, footprints: Sequence[Footprint]) -> int | None:
    """The footprint that a landing begins or a leaving ends."""
    name, sole = loads.motion.name, loads.motion.soles[phase.sole].sole.name
    frame = float(loads.motion.frames[min(phase.at, len(loads.motion.frames) - 1)])
    near = [
        (abs((footprint.end_frame if phase.kind == "toe_off" else footprint.start_frame) - frame), number)
        for number, footprint in enumerate(footprints)
        if (footprint.character, footprint.sole) == (name, sole)
        and footprint.start_frame - 2 <= frame <= footprint.end_frame + 2
    ]
    return min(near)[1] if near else None
