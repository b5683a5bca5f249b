"""What steps throw: crumbs and drops with closed-form flights, from where and how hard soles land, push off and leave.

References
----------
Deboeuf, Gondret and Rabaud 2009, "Dynamics of grain ejection by sphere impact on a granular bed", Phys. Rev. E 79,
041306: a corona of constant angle. Housen and Holsapple 2011, "Ejecta from impact craters", Icarus 211: speed against
distance from the middle.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..loads.estimate import CharacterLoads
from ..record.edits import step_id
from ..record.footprints import Footprint
from . import flight, phases
from .phases import Phase
from .thrown_matter import MATTER, ThrownMatter

Array = NDArray[np.float64]
Height = Callable[[Array, Array], Array]
_Part = TypeVar("_Part")

THROWN_SHARE = 0.05
"""Share of the displaced ground that a landing throws, for each unit of v²/(g·R) above 1."""
MOST_THROWN = 0.3
"""Largest share of it."""
SPEED, SPEED_FALL = 0.7, -1 / 0.55
"""Speed of what is thrown, over sqrt(g·R), at the edge of the contact, and its exponent over the distance."""
NEAREST, FARTHEST = 0.5, 1.2
"""Distance from the middle from which it is thrown, over R."""
CORONA, SPREAD = 45.0, 10.0
"""Angle of the corona, and how far it varies [deg]."""
CARRIED_ALONG = 0.5
"""Share of the sole's speed that what it throws takes along."""
PUSH_DEPTH = 2e-3
"""Thickness of the ground that a sliding sole drags off [m]."""
PUSH_SPEED, PUSH_ANGLES = 0.7, (30.0, 50.0)
"""Speed of what it throws over its own, and between which angles [deg]."""
SHEDDING = 0.2
"""Time in which a sole sheds what it carries, but for 1/e [s]."""
LONGEST_SHED = 0.6
"""After that it is clean [s]."""
SIZE_FALL = 2.5
"""Exponent with which the number of pieces falls over their size."""
MOST_PIECES = 4000
"""Of a step: what is more is drawn as larger ones."""
LANDING_TIME = 0.1
"""What is displaced within this time after the strike is displaced by the landing [s, of an adult]."""

KINDS = ("landing", "push", "shed")
"""Where a piece comes from."""


@dataclass(frozen=True)
class Debris:
    """Pieces in the order of their birth.

    Attributes
    ----------
    birth : (N,) float array
        Scene frame from which each flies.
    start, velocity : (N, 3) float arrays
        Where from [m] and how fast [m/s].
    drag_time : (N,) float array
        See `flight` [s].
    time : (N,) float array
        In the air [s]; then it lies where it came down.
    radius : (N,) float array
        [m]
    kind : (N,) int array
        Number in `KINDS`.
    step : (N,) int array
        Number of the footprint.
    volume : (F,) float array
        What each footprint threw [m³].
    masses : dict of (str, str) to float
        What was thrown, by step id and phase [kg].
    """

    birth: Array
    start: Array
    velocity: Array
    drag_time: Array
    time: Array
    radius: Array
    kind: NDArray[np.int32]
    step: NDArray[np.int32]
    volume: Array
    masses: dict[tuple[str, str], float]


def thrown_share(speed: float, radius: float, gravity: float) -> float:
    """Share of what a landing displaces that it throws.

    Parameters
    ----------
    speed : float
        Into the ground [m/s].
    radius : float
        Of the part of the sole that lands [m].
    gravity : float
        [m/s²]

    Examples
    --------
    >>> [round(thrown_share(speed, 0.05, 9.81), 3) for speed in (0.4, 1.5, 4.0)]  # a walk, a run, a jump
    [0.0, 0.179, 0.3]
    """
    return float(np.clip(THROWN_SHARE * (speed**2 / (gravity * radius) - 1.0), 0.0, MOST_THROWN))


def throw(
    loads: Sequence[CharacterLoads],
    footprints: Sequence[Footprint],
    *,
    surface: str,
    height: Height,
    without: Collection[int] = (),
) -> Debris:
    """All that the steps of a bake throw.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    footprints : sequence of Footprint
    surface : str
        See `core.ground.presets.SURFACES`.
    height : callable
        The baked ground's heights at places x, y [m].
    without : collection of int
        Numbers of footprints that throw nothing.
    """
    matter, sources = MATTER[surface], []
    for character in loads:
        found = phases.phases(character)
        for phase in found:
            there = _sources(character, phase, footprints, matter)
            sources += [one for one in there if one.volume > 0 and one.number not in without]
    volume = np.zeros(len(footprints))
    for one in sources:
        volume[one.number] += one.volume
    budget = MOST_THROWN * np.array([one.rim_m3 for one in footprints])
    scale = np.minimum(1.0, np.divide(budget, volume, out=np.zeros_like(volume), where=volume > 0))
    sources = [replace(one, volume=one.volume * float(scale[one.number])) for one in sources]
    masses: dict[tuple[str, str], float] = {}
    for one in sources:
        key = step_id(footprints[one.number]), one.phase.kind
        masses[key] = masses.get(key, 0.0) + one.volume * matter.density
    parts = [_pieces(one, matter, footprints[one.number]) for one in sources if one.volume > 1e-12]
    return _landed(parts, height, volume * scale, masses, loads[0].motion.gravity if loads else 9.81)


def booked(footprint: Footprint, volume: float) -> Footprint:
    """A footprint whose rim lacks what was thrown [m³]."""
    if not volume > 0 or not footprint.rim_m3 > 0:
        return footprint
    left = 1.0 - volume / footprint.rim_m3
    amounts = np.asarray(footprint.rim.amounts)
    order = np.argsort(np.asarray(footprint.rim.cells), kind="stable")
    # Rounded along each cell's sums, so that no cell loses more than a quantum whatever it went through.
    total = np.cumsum(amounts[order].astype(np.int64))
    rounded = np.diff(np.rint(total * left), prepend=0.0)
    scaled = np.empty(len(amounts), np.int32)
    scaled[order] = rounded.astype(np.int32)
    return _changed(footprint, rim=_changed(footprint.rim, amounts=scaled), rim_m3=footprint.rim_m3 - volume)


def _changed(one: _Part, **values: Any) -> _Part:
    """As `dataclasses.replace`, which would pack anew what stays as it is."""
    twin = copy(one)
    for name, value in values.items():
        object.__setattr__(twin, name, value)
    return twin


@dataclass(frozen=True)
class _Source:
    """What throws at a step of the loads: of which footprint, how much, and from which states of the sole."""

    loads: CharacterLoads
    phase: Phase
    number: int
    kind: int
    volume: float
    steps: NDArray[np.intp]
    weights: Array


def _sources(
    loads: CharacterLoads, phase: Phase, footprints: Sequence[Footprint], matter: ThrownMatter
) -> Iterator[_Source]:
    number = _footprint_of(loads, phase, footprints)
    if number is None:
        return
    footprint, step = footprints[number], loads.motion.time_step
    if phase.kind in ("heel_strike", "land"):
        speed = phases.landing_speed(loads, phase.sole, phase.at)
        share = thrown_share(speed, _radius(loads, phase, footprint), loads.motion.gravity)
        volume = share * footprint.rim_m3 * _landing_part(footprint, loads, phase)
        yield _Source(loads, phase, number, 0, volume, np.array([phase.at]), np.ones(1))
    if phase.kind == "toe_off":
        yield from _pushed(loads, phase, number, footprint, matter)
        last = min(len(loads.motion.frames) - 1, phase.at + round(LONGEST_SHED / step))
        steps = np.arange(phase.at, last)
        weights = np.exp(-(steps - phase.at) * step / SHEDDING)
        if len(steps):
            volume = matter.film * footprint.area_m2 * float(weights.sum() * step / SHEDDING)
            yield _Source(loads, phase, number, 2, volume, steps, weights)


def _pushed(
    loads: CharacterLoads, phase: Phase, number: int, footprint: Footprint, matter: ThrownMatter
) -> Iterator[_Source]:
    """What a sole drags off where it pushes along the ground harder than that can bear."""
    steps = np.arange(phase.at - max(1, round(0.25 / loads.motion.time_step)), phase.at)
    steps = steps[steps >= 0]
    normal = loads.contacts.normal[steps, phase.sole]
    force = loads.forces.forces[steps, phase.sole]
    pressing = np.einsum("ni,ni->n", force, normal)
    along = np.linalg.norm(force - pressing[:, None] * normal, axis=1)
    slips = (pressing > 0) & (along > np.tan(np.radians(matter.repose)) * pressing)
    speed = phases.slide_speed(loads, phase.sole)[steps] * slips
    width = np.sqrt(footprint.area_m2) / 2
    rate = width * PUSH_DEPTH * speed
    if rate.any():
        yield _Source(loads, phase, number, 1, float(rate.sum()) * loads.motion.time_step, steps, rate)


def _footprint_of(loads: CharacterLoads, phase: Phase, footprints: Sequence[Footprint]) -> int | None:
    """The footprint that a landing begins or a leaving ends."""
    name, sole = loads.motion.name, loads.motion.soles[phase.sole].sole.name
    frame = float(loads.motion.frames[min(phase.at, len(loads.motion.frames) - 1)])
    near = [
        (abs((one.end_frame if phase.kind == "toe_off" else one.start_frame) - frame), number)
        for number, one in enumerate(footprints)
        if (one.character, one.sole) == (name, sole) and one.start_frame - 2 <= frame <= one.end_frame + 2
    ]
    return min(near)[1] if near else None


def _radius(loads: CharacterLoads, phase: Phase, footprint: Footprint) -> float:
    """Of the part of the sole that lands [m]: half a foot, the whole of all else."""
    foot = phases.is_foot(loads.motion.soles[phase.sole])
    return float(np.sqrt(max(footprint.area_m2, 1e-8) * (0.5 if foot else 1.0) / np.pi))


def _landing_part(footprint: Footprint, loads: CharacterLoads, phase: Phase) -> float:
    """Share of what a step compacts that it compacts as it lands."""
    changes = footprint.pressing
    total = np.concatenate([[0.0], np.cumsum(np.asarray(changes.amounts), dtype=np.float64)])
    volumes = np.maximum(np.diff(total[np.asarray(changes.first)]), 0.0)
    until = loads.motion.frames[phase.at] + LANDING_TIME * loads.motion.adult_second
    early = np.asarray(changes.frames) <= until + 1e-6
    return float(volumes[early].sum() / max(volumes.sum(), 1e-300))


_Pieces = dict[str, Array]


def _pieces(source: _Source, matter: ThrownMatter, footprint: Footprint) -> _Pieces:
    """The pieces of a source, before their flight is known."""
    digest = hashlib.sha256(f"{step_id(footprint)} {source.kind}".encode()).digest()
    random = np.random.default_rng(int.from_bytes(digest[:8], "big"))
    radius = _radii(source.volume, matter, random)
    count = len(radius)
    which = random.choice(len(source.steps), count, p=source.weights / source.weights.sum())
    steps = source.steps[which]
    motion = source.loads.motion
    at = np.minimum(steps + random.random(count), len(motion.frames) - 1.0)
    if source.kind == 0:
        start, velocity = _corona(source, footprint, random, count)
    else:
        start, velocity = _from_sole(source, steps, random)
        if source.kind == 1:
            velocity = _backward(source, steps, velocity, random)
    low, high = matter.settling
    part = np.sqrt(np.clip((2 * radius - matter.sizes[0]) / np.ptp(matter.sizes), 0.0, 1.0))
    settling = (low + (high - low) * part) * (0.8 + 0.4 * random.random(count))
    frames = np.interp(at, np.arange(len(motion.frames)), motion.frames)
    return {
        "birth": frames,
        "start": start,
        "velocity": velocity,
        "drag_time": settling / motion.gravity,
        "radius": radius,
        "kind": np.full(count, source.kind, float),
        "step": np.full(count, source.number, float),
    }


def _radii(volume: float, matter: ThrownMatter, random: np.random.Generator) -> Array:
    """Radii of pieces whose spheres have a volume together [m]: their number falls as d^-2.5."""
    low, high = matter.sizes
    power = 1.0 - SIZE_FALL
    # mean of d³ over the distribution
    mean = power / (power + 3) * (high ** (power + 3) - low ** (power + 3)) / (high**power - low**power)
    count = int(np.clip(np.ceil(volume / (np.pi / 6 * mean)), 1, MOST_PIECES))
    part = random.random(count)
    diameter = (low**power + part * (high**power - low**power)) ** (1 / power)
    scale = (volume / (np.pi / 6 * (diameter**3).sum())) ** (1 / 3)
    return np.asarray(diameter * scale / 2)


def _corona(source: _Source, footprint: Footprint, random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Where and how fast the ring around a landing starts."""
    loads, phase = source.loads, source.phase
    radius = _radius(loads, phase, footprint)
    middle = phases.place_of(loads, phase.sole, phase.at)
    direction = 2 * np.pi * random.random(count)
    distance = np.sqrt(NEAREST**2 + random.random(count) * (FARTHEST**2 - NEAREST**2))
    landing = phases.landing_speed(loads, phase.sole, phase.at)
    speed = np.minimum(SPEED * np.sqrt(loads.motion.gravity * radius) * distance**SPEED_FALL, landing)
    angle = np.radians(CORONA + SPREAD * (2 * random.random(count) - 1))
    outward = np.stack([np.cos(direction), np.sin(direction)], -1)
    start = np.column_stack([middle[:2] + outward * (radius * distance)[:, None], np.full(count, middle[2])])
    velocity = np.column_stack([outward * (speed * np.cos(angle))[:, None], speed * np.sin(angle)])
    along = phases.sole_velocity(loads, phase.sole, max(phase.at - 1, 0))
    velocity[:, :2] += CARRIED_ALONG * along[:2]
    return start, velocity


def _from_sole(source: _Source, steps: NDArray[np.intp], random: np.random.Generator) -> tuple[Array, Array]:
    """Places under a sole at steps, and its speed there."""
    points, velocities = phases.sole_points_at(source.loads, source.phase.sole, steps)
    weights = random.dirichlet(np.ones(points.shape[1]), len(steps))
    start = np.einsum("nl,nli->ni", weights, points)
    start[:, :2] += 0.02 * (random.random((len(steps), 2)) - 0.5)
    velocity = np.einsum("nl,nli->ni", weights, velocities)
    return start, velocity * (0.7 + 0.5 * random.random(len(steps)))[:, None]


def _backward(source: _Source, steps: NDArray[np.intp], slide: Array, random: np.random.Generator) -> Array:
    """Speeds of what a sole throws as it pushes off: against the force that drives the body, and up."""
    force = source.loads.forces.forces[steps, source.phase.sole, :2]
    back = -force / np.maximum(np.linalg.norm(force, axis=1), 1e-9)[:, None]
    speed = PUSH_SPEED * np.linalg.norm(slide, axis=1)
    low, high = np.radians(PUSH_ANGLES)
    angle = low + (high - low) * random.random(len(steps))
    turn = 0.3 * random.standard_normal(len(steps))
    sideways = np.stack([-back[:, 1], back[:, 0]], -1)
    way = back * np.cos(turn)[:, None] + sideways * np.sin(turn)[:, None]
    return np.column_stack([way * (speed * np.cos(angle))[:, None], speed * np.sin(angle)])


def _landed(
    parts: Sequence[_Pieces], height: Height, volume: Array, masses: dict[tuple[str, str], float], gravity: float
) -> Debris:
    """All pieces with their flights, in the order of their birth."""
    keys = ("birth", "start", "velocity", "drag_time", "radius", "kind", "step")
    shapes = {"start": (0, 3), "velocity": (0, 3)}
    nothing: _Pieces = {key: np.zeros(shapes.get(key, 0)) for key in keys}
    whole = {key: np.concatenate([part[key] for part in (nothing, *parts)]) for key in keys}
    order = np.argsort(whole["birth"], kind="stable")
    birth, start, velocity, drag_time, radius, kind, step = (whole[key][order] for key in keys)
    start[:, 2] = np.maximum(start[:, 2], np.nan_to_num(height(start[:, 0], start[:, 1]), nan=-np.inf))
    time = flight.landing_times(start, velocity, drag_time, gravity, height)
    numbers = kind.astype(np.int32), step.astype(np.int32)
    return Debris(birth, start, velocity, drag_time, time, radius, *numbers, volume, masses)
