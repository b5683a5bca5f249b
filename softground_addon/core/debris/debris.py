"""Crumbs and drops that steps throw: closed-form flights, from where and how hard soles land, push off and leave.

References
----------
Deboeuf, Gondret and Rabaud 2009, "Dynamics of grain ejection by sphere impact on a granular bed", Phys. Rev. E 79,
041306: a corona of constant angle. Housen and Holsapple 2011, "Ejecta from impact craters", Icarus 211: speed against
distance from the middle.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground import surfaces
from ..ground.surfaces import ThrownMatter
from ..meshing import crumbs
from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from ..record.record import EditableStep
from ..record.throws import AIM, WADE, WEIGHT, Throw, ThrowKind
from . import flight

Height = Callable[[Array, Array], Array]

GRAINS = (0.2e-3, 0.6e-3)
"""Smallest and largest diameter of single grains [m]: medium dune sand; fine powder."""
THROWN_SHARE = 0.05
"""Share of the ground that a landing drives down which it throws, for each unit of v²/(g·R) above 1."""
MOST_THROWN = 0.3
"""Largest share of it. What the ground swallows as it is compacted cannot fly: nothing is thrown beyond the rim."""
SPEED, SPEED_FALL = 0.7, -1 / 0.55
"""Speed of what is thrown, over sqrt(g·R), at the edge of the contact, and its exponent over the distance."""
NEAREST, FARTHEST = 0.5, 1.2
"""Distance from the middle from which it is thrown, over R."""
CORONA, SPREAD = 45.0, 10.0
"""Angle of the corona, and how far it varies [deg]."""
CARRIED_ALONG = 0.5
"""Share of the sole's speed that what it throws takes along."""
PUSH_DEPTH = 2e-3
"""Thickness of the ground that a sole drags off which pushes or slides harder than the ground can bear [m]."""
PUSH_SPEED, PUSH_ANGLES = 0.7, (30.0, 50.0)
"""Speed of what it throws over its own, and between which angles [deg]."""
SHED_SCATTER = 0.15
"""How much the speed of what is shed varies in each direction, over that of the sole."""
LUMP = 0.01
"""How far from the middle of a lump its pieces are at most, along each axis [m]."""
LARGEST_SHARE = 0.25
"""Of what a step throws in one phase, in its largest piece."""
ALL_PIECES = 250_000
"""That all landings and pushes of a bake throw together: what is more is drawn as larger ones."""
TOGETHER = 100_000
"""Whose landings are computed in one slice at most."""
MOST_SHED = 1000
"""That a sole sheds."""
BREADTH = 0.3
"""Breadth of what a foot sheds from, over the length between its landmarks: these lie along its middle."""


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
        See `core.record.throws.ThrowKind`.
    step : (N,) int array
        Number of the step (see `record.edits`).
    """

    birth: Array
    start: Array
    velocity: Array
    drag_time: Array
    time: Array
    radius: Array
    kind: NDArray[np.int32]
    step: NDArray[np.int32]


@dataclass(frozen=True)
class Source:
    """Source of debris at a step after the artist's edits, with its volume [m³]."""

    throw: Throw
    step: EditableStep
    volume: float


def thrown_share(speed: float, radius: float, gravity: float) -> float:
    """Share of what a landing drives down that it throws.

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


@sliced
def sources(
    thrown: Sequence[Throw],
    steps: Sequence[EditableStep],
    *,
    surface: str,
    gravity: float,
    carves: Mapping[int, Footprint] | None = None,
) -> Slices[list[Source]]:
    """All that the steps of a record throw, at most the rim of each: that is what compaction leaves of what they press.

    Parameters
    ----------
    steps : sequence of EditableStep
        With all of their rims.
    carves : mapping of int to Footprint, optional
        What bodies carved with them, by their numbers: what ploughs throws of what is loose there.
    gravity : float
        [m/s²]
    """
    of_steps: dict[int, list[Throw]] = {}
    for throw_of_step in thrown:
        of_steps.setdefault(throw_of_step.number, []).append(throw_of_step)
    count, of_all = sum(not step.is_copy for step in steps), []
    for step in steps:
        yield
        if step.footprint is None:
            continue
        ways = [
            throw_of_step.placed(step.baked, step.footprint, step.edit)
            for throw_of_step in of_steps.get(step.index % count, ())
        ]
        matter = surfaces.find(step.footprint.surface or surface).thrown
        volumes = [_volume(way, step.footprint, matter, gravity) for way in ways]
        carve = (carves or {}).get(step.index)
        for ploughs, most in ((False, step.footprint.rim_m3), (True, carve.rim_m3 if carve else 0.0)):
            both = zip(ways, volumes, strict=True)
            parts = [(way, volume) for way, volume in both if volume > 0 and (way.phase == WADE) == ploughs]
            scale = min(1.0, max(most, 0.0) / max(sum(volume for _, volume in parts), 1e-300))
            of_all += [Source(way, step, volume * scale) for way, volume in parts]
    return of_all


def volumes(sources: Sequence[Source]) -> dict[int, dict[str, float]]:
    """Volumes that steps throw, by their numbers and by phase [m³]: see `BakeRecord.thrown`."""
    thrown: dict[int, dict[str, float]] = {}
    for source in sources:
        of_step = thrown.setdefault(source.step.index, {})
        of_step[source.throw.phase] = of_step.get(source.throw.phase, 0.0) + source.volume
    return thrown


def shed_volumes(debris: Debris) -> dict[int, float]:
    """Volume that soles shed in the air after each step, by its number [m³]."""
    shed = debris.kind == ThrowKind.SHED
    volume = np.bincount(debris.step[shed], 4 / 3 * np.pi * debris.radius[shed] ** 3)
    return {int(step): float(volume[step]) for step in np.flatnonzero(volume)}


@sliced
def throw(
    sources: Sequence[Source],
    *,
    surface: str,
    gravity: float,
    height: Height,
    height_at: Callable[[float], Height] | None = None,
) -> Slices[Debris]:
    """The pieces of all that is thrown.

    Parameters
    ----------
    sources : sequence of Source
        Result of the function of that name.
    gravity : float
        [m/s²]
    height : callable
        The baked ground's heights at places x, y [m].
    height_at : callable, optional
        The same at a scene frame, where they change over time: pieces land on the ground of the frame they fly from.
    """
    throwing = [source for source in sources if source.volume > 1e-12]
    kinds = 2 * sum(source.throw.kind != ThrowKind.SHED for source in throwing)  # pieces and grains
    parts = []
    for source in throwing:
        footprint = source.step.footprint
        matter = surfaces.find((footprint and footprint.surface) or surface).thrown
        parts.append(_pieces(source, matter, gravity, ALL_PIECES // max(kinds, 1)))
        yield
    return (yield from _landed(parts, height_at or (lambda _: height), gravity, moves=height_at is not None))


def _volume(throw: Throw, footprint: Footprint, matter: ThrownMatter, gravity: float) -> float:
    """Volume thrown by a step that left a print [m³]."""
    amount = float(throw.samples[:, WEIGHT].astype(np.float64).sum())
    if throw.kind == ThrowKind.LANDING:
        share = thrown_share(throw.speed, _radius(throw, footprint), gravity)
        return share * footprint.compressed_m3 * _landing_part(footprint, throw.landed_by) if share else 0.0
    if throw.kind == ThrowKind.PLOUGH:  # as much as becomes single grains: none of what sticks together
        return matter.fine * amount
    if throw.kind == ThrowKind.PUSH:
        return np.sqrt(footprint.area_m2) / 2 * PUSH_DEPTH * amount
    return matter.film * footprint.area_m2 * amount


def _radius(throw: Throw, footprint: Footprint) -> float:
    """Of the part of the sole that lands [m]: half a foot, the whole of all else."""
    return float(np.sqrt(max(footprint.area_m2, 1e-8) * (0.5 if throw.is_foot else 1.0) / np.pi))


def _landing_part(footprint: Footprint, until: float) -> float:
    """Share of what a step compacts that it compacts until a scene frame."""
    changes = footprint.pressing
    total = np.concatenate([[0.0], np.cumsum(np.asarray(changes.amounts), dtype=np.float64)])
    volumes = np.maximum(np.diff(total[np.asarray(changes.first)]), 0.0)
    early = np.asarray(changes.frames) <= until + 1e-6
    return float(volumes[early].sum() / max(volumes.sum(), 1e-300))


_Pieces = dict[str, Array]


def _pieces(source: Source, matter: ThrownMatter, gravity: float, most: int) -> _Pieces:
    """The pieces of a source, before their flight is known; of each kind at most so many."""
    throw = source.throw
    digest = hashlib.sha256(f"{source.step.name} {throw.kind}".encode()).digest()
    random = np.random.default_rng(int.from_bytes(digest[:8], "big"))
    fine = matter.fine * source.volume * (throw.kind != ThrowKind.SHED)  # what a sole carries sticks together
    most = max(min(most, MOST_SHED if throw.kind == ThrowKind.SHED else matter.most), 1)
    radius = _radii(source.volume - fine, matter.sizes, most, random)
    if fine:
        radius = np.append(radius, _radii(fine, GRAINS, most, random))
    count, weights = len(radius), throw.samples[:, WEIGHT].astype(np.float64)
    lumps = matter.lumps if throw.kind == ThrowKind.SHED else 0
    which = random.choice(len(weights), lumps or count, p=weights / weights.sum())
    of_lump = random.choice(lumps, count, p=random.dirichlet(np.ones(lumps))) if lumps else np.arange(count)
    which, wholes = which[of_lump], which
    frames = throw.first + (which + random.random(count)) * throw.spacing
    if throw.kind == ThrowKind.LANDING:
        start, velocity = _corona(source, random, count, gravity)
    else:
        start, velocity = (part[of_lump] for part in _from_sole(throw, wholes, random))
        if throw.kind in (ThrowKind.PUSH, ThrowKind.PLOUGH):
            velocity = _backward(throw.samples[which, AIM].astype(np.float64), velocity, random)
        else:
            start += (LUMP if lumps else 0.0) * (2 * random.random(start.shape) - 1)
            velocity = _scattered(velocity, random)
    low, high = matter.settling
    part = np.sqrt(np.clip((2 * radius - matter.sizes[0]) / np.ptp(matter.sizes), 0.0, 1.0))
    settling = (low + (high - low) * part) * (0.8 + 0.4 * random.random(count))
    settling *= np.minimum(2 * radius / matter.sizes[0], 1.0)  # of grains it rises with their size
    return {
        "birth": frames,
        "start": start,
        "velocity": velocity,
        "drag_time": settling / gravity,
        "radius": radius,
        "kind": np.full(count, throw.kind, float),
        "step": np.full(count, source.step.index, float),
    }


def _radii(volume: float, sizes: tuple[float, float], most: int, random: np.random.Generator) -> Array:
    """Radii of pieces whose spheres have a volume together [m]."""
    low, high = sizes
    high = max(min(high, (6 / np.pi * LARGEST_SHARE * volume) ** (1 / 3)), 2 * low)
    count = int(np.clip(np.ceil(volume / (np.pi / 6 * crumbs.mean_cube((low, high)))), 1, most))
    diameter = crumbs.diameters((low, high), random.random(count))
    scale = (volume / (np.pi / 6 * (diameter**3).sum())) ** (1 / 3)
    return np.asarray(diameter * scale / 2)


def _corona(source: Source, random: np.random.Generator, count: int, gravity: float) -> tuple[Array, Array]:
    """Start and speed of the ring around a landing."""
    throw, footprint = source.throw, source.step.footprint
    assert footprint is not None
    radius = _radius(throw, footprint)
    (((middle,),), ((along,),)) = throw.followed()
    direction = 2 * np.pi * random.random(count)
    distance = np.sqrt(NEAREST**2 + random.random(count) * (FARTHEST**2 - NEAREST**2))
    speed = np.minimum(SPEED * np.sqrt(gravity * radius) * distance**SPEED_FALL, throw.speed)
    angle = np.radians(CORONA + SPREAD * (2 * random.random(count) - 1))
    outward = np.stack([np.cos(direction), np.sin(direction)], -1)
    start = np.column_stack([middle[:2] + outward * (radius * distance)[:, None], np.full(count, middle[2])])
    velocity = np.column_stack([outward * (speed * np.cos(angle))[:, None], speed * np.sin(angle)])
    velocity[:, :2] += CARRIED_ALONG * along[:2]
    return start, velocity


def _from_sole(throw: Throw, which: NDArray[np.intp], random: np.random.Generator) -> tuple[Array, Array]:
    """Places under a sole at samples, and its speed there: all over a foot; of all else, on its lower half."""
    points, velocities = (part[which] for part in throw.followed())
    if throw.is_foot:
        weights = random.dirichlet(np.ones(points.shape[1]), len(which))
    else:
        is_low = points[..., 2] <= points[..., 2].mean(axis=1, keepdims=True) + 1e-9
        picked = np.where(is_low, random.random(is_low.shape), -1.0).argmax(axis=1)
        weights = np.eye(points.shape[1])[picked]
    start = np.einsum("nl,nli->ni", weights, points)
    if throw.is_foot:
        length = np.linalg.norm(np.ptp(points, axis=1), axis=1)
        start[:, :2] += BREADTH * length[:, None] * (random.random((len(which), 2)) - 0.5)
    velocity = np.einsum("nl,nli->ni", weights, velocities)
    velocity = velocity * (0.7 + 0.5 * random.random(len(which)))[:, None]
    return start, _scattered(velocity, random) if throw.kind == ThrowKind.SHED else velocity


def _scattered(velocity: Array, random: np.random.Generator) -> Array:
    """Velocities that vary by `SHED_SCATTER`."""
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    return np.asarray(velocity + SHED_SCATTER * speed * random.standard_normal(velocity.shape))


def _backward(aim: Array, slide: Array, random: np.random.Generator) -> Array:
    """Speeds of what a sole throws as it pushes off, or a leg that ploughs: along the aim, and up."""
    speed = PUSH_SPEED * np.linalg.norm(slide, axis=1)
    low, high = np.radians(PUSH_ANGLES)
    angle = low + (high - low) * random.random(len(aim))
    turn = 0.3 * random.standard_normal(len(aim))
    sideways = np.stack([-aim[:, 1], aim[:, 0]], -1)
    way = aim[:, :2] * np.cos(turn)[:, None] + sideways * np.sin(turn)[:, None]
    return np.column_stack([way * (speed * np.cos(angle))[:, None], speed * np.sin(angle)])


def _landed(
    parts: Sequence[_Pieces], height_at: Callable[[float], Height], gravity: float, *, moves: bool
) -> Slices[Debris]:
    """All pieces with their flights, in the order of their birth."""
    keys = ("birth", "start", "velocity", "drag_time", "radius", "kind", "step")
    shapes = {"start": (0, 3), "velocity": (0, 3)}
    nothing: _Pieces = {key: np.zeros(shapes.get(key, 0)) for key in keys}
    whole = {key: np.concatenate([part[key] for part in (nothing, *parts)]) for key in keys}
    order = np.argsort(whole["birth"], kind="stable")
    birth, start, velocity, drag_time, radius, kind, step = (whole[key][order] for key in keys)
    frames, time = np.floor(birth) if moves else np.zeros(len(birth)), np.zeros(len(birth))
    for frame, first, count in zip(*np.unique(frames, return_index=True, return_counts=True), strict=True):
        height = height_at(float(frame))
        for begin in range(first, first + count, TOGETHER):
            part = slice(begin, min(begin + TOGETHER, first + count))
            ground = np.nan_to_num(height(start[part, 0], start[part, 1]), nan=-np.inf)
            start[part, 2] = np.maximum(start[part, 2], ground)
            falling = flight.landing_times.slices(start[part], velocity[part], drag_time[part], gravity, height)
            time[part] = yield from falling
    return Debris(birth, start, velocity, drag_time, time, radius, kind.astype(np.int32), step.astype(np.int32))
