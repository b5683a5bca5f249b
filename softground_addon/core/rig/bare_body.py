"""A body that no armature moves, as a rig: what moves together rigidly is a bone, with the skin that it moves."""

from __future__ import annotations

from collections.abc import Collection, Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import CENTRE, CharacterMotion
from ..numerics.arrays import Array, Indices
from ..numerics.rigid import unit
from ..numerics.slices import Slices, sliced
from ..skin.rigid_parts import moves_as_one, rigid_motions, rigid_parts
from ..skin.skin_motion import MOST_SAMPLES
from .bones import RestBone, RigBones
from .mapping import RigMapping, SoleSource
from .motion_assembly import assemble_motion
from .recording import Recording, SceneUnits
from .rig_skin import RigSkin
from .skin_mass import centre_of_volume
from .skin_stances import skin_stances

MOST_FOLLOWED = 100
"""Points of a part by which it is followed."""

JOINT = 0.15
"""Vertices of toes at which they bend are by so much of their length farther from the foot than the nearest."""

STIFF = 1e-4
"""Squared turn between foot and toes [rad²] below which their motion does not tell where they bend."""

TRAVELS = 0.1
"""A body that goes farther than this over its size shows where its front is; else that is Blender's."""


@dataclass(frozen=True)
class BareBody:
    """A body as a rig; its armature is the world.

    Attributes
    ----------
    skin : RigSkin
        In the first pose.
    bones : RigBones
        A bone for each part.
    followed : (N,) int array
        Vertices by which the parts are followed, those of each part together.
    is_rigid : bool
        True if no part moves against the others.
    """

    skin: RigSkin
    bones: RigBones
    followed: Indices
    is_rigid: bool


@sliced
def bare_body(
    positions: NDArray[np.floating], triangles: Indices, objects: Sequence[tuple[str, int]], known: Collection[str] = ()
) -> Slices[BareBody]:
    """The parts of a body.

    Parameters
    ----------
    positions : (F, V, 3) float array
        World positions in some poses [Blender units].
    triangles : (T, 3) int array
    objects : sequence of (str, int)
        Name and number of vertices of each object.
    known : collection of str
        Names that parts had: what a vertex is in keeps its name, though other vertices may have joined it or left.
    """
    positions = positions.astype(float)
    part = yield from rigid_parts.slices(positions, triangles)
    rest = positions[0]
    names = _names(part, objects, known)
    ahead = (positions[-1].mean(axis=0) - rest.mean(axis=0)) * (1, 1, 0)
    goes = np.linalg.norm(ahead) > TRAVELS * np.ptp(rest, axis=0).max()
    front = unit(ahead) if goes else np.array((0.0, -1.0, 0.0))
    up = np.array((0.0, 0.0, 1.0))
    frame = np.eye(4)
    frame[:3, :3] = np.stack([np.cross(front, up), front, up], axis=-1)
    bones, weights, followed = {}, [], []
    for number, name in enumerate(names):
        moved = np.flatnonzero(part == number)
        low, high = rest[moved].min(axis=0), rest[moved].max(axis=0)
        middle, matrix = (low + high) / 2, frame.copy()
        matrix[:3, 3] = middle
        foot, top = (np.array((*middle[:2], height)) for height in (low[2], high[2]))
        bones[name] = RestBone("", matrix, foot, top, float(np.ptp(rest[moved] @ front)) / 2)
        weights.append((moved, np.ones(len(moved))))
        followed.append(moved[np.unique(np.linspace(0, len(moved) - 1, MOST_FOLLOWED).astype(int))])
    skin = RigSkin(rest, triangles, tuple(names), tuple(weights), part, np.zeros(len(part), dtype=bool))
    return BareBody(skin, bones, np.concatenate(followed), moves_as_one(positions))


def _names(part: Indices, objects: Sequence[tuple[str, int]], known: Collection[str]) -> list[str]:
    """Names of the parts: that of the object whose only part it is, or with the number of its first vertex."""
    start = dict(zip([name for name, _ in objects], np.cumsum([0, *(count for _, count in objects)]), strict=False))
    names = [""] * (int(part.max()) + 1)
    for name, count in objects:
        of_object, first = np.unique(part[start[name] : start[name] + count], return_index=True)
        for number, vertex in zip(of_object.tolist(), first.tolist(), strict=True):
            names[number] = names[number] or (name if len(of_object) == 1 else f"{name} {vertex}")
    for name in known:
        owner, _, vertex = name.rpartition(" ")
        if name not in names and owner in start and vertex.isdecimal() and int(vertex) < dict(objects)[owner]:
            names[part[start[owner] + int(vertex)]] = name
    return names


def with_toes(sources: Sequence[SoleSource], recording: Recording) -> tuple[SoleSource, ...]:
    """Contacts of several parts as feet whose foremost part are the toes; limbs stay as they are."""

    def ahead(part: str, source: SoleSource) -> float:
        """Distance of a part before the main one, along its front."""
        main, other = recording.bone(source.bone), recording.bone(part)
        return float(np.median(((other[:, :3, 3] - main[:, :3, 3]) * main[:, :3, 1]).sum(axis=1)))

    feet = []
    for source in sources:
        order = sorted(source.parts, key=partial(ahead, source=source))
        is_foot = len(order) > 1 and not source.limb
        feet.append(replace(source, name=order[0], bone=order[0], toe_bone=order[-1]) if is_foot else source)
    return tuple(feet)


def recorded(body: BareBody, positions: NDArray[np.floating], frames: range, units: SceneUnits) -> Recording:
    """Poses of the parts over time, from world positions (F, N, 3) of the `followed` vertices [Blender units]."""
    start, part = body.skin.vertices[body.followed], body.skin.part[body.followed]
    poses = np.empty((len(frames), len(body.bones), 4, 4), dtype=np.float32)
    for number, bone in enumerate(body.bones.values()):
        here = part == number
        moved = rigid_motions(start[here], positions[:, here].astype(float)) @ bone.matrix
        poses[:, number] = np.swapaxes(moved, -1, -2)
    world = np.tile(np.eye(4), (len(frames), 1, 1))
    return Recording(np.array(frames, dtype=float), body.skin.bones, poses, world, {}, units)


def _jointed(body: BareBody, mapping: RigMapping, recording: Recording) -> tuple[RigBones, Recording]:
    """Bones and poses with the frames of toes where they bend."""
    bones, poses = dict(body.bones), recording.poses.copy()
    for source in mapping.soles:
        if source.toe_bone:
            number, matrix = recording.bones.index(source.toe_bone), bones[source.toe_bone].matrix.copy()
            matrix[:3, 3] = _joint(body, source.bone, source.toe_bone, recording)
            shift = np.linalg.inv(bones[source.toe_bone].matrix) @ matrix
            poses[:, number] = shift.T @ poses[:, number]
            bones[source.toe_bone] = replace(bones[source.toe_bone], matrix=matrix)
    return bones, replace(recording, poses=poses)


def _joint(body: BareBody, foot: str, toes: str, recording: Recording) -> Array:
    """The place at which two parts move alike, in the first pose; along the axis of their hinge, between them."""
    numbers = [recording.bones.index(name) for name in (foot, toes)]
    near, far = (body.skin.vertices[body.followed[body.skin.part[body.followed] == number]] for number in numbers)
    gap = np.linalg.norm(far[:, None] - near, axis=-1)
    touching = gap.min(axis=1) <= gap.min() + JOINT * np.ptp(far, axis=0).max()
    start = far[touching].mean(axis=0)
    first, other = (
        np.swapaxes(recording.poses[:, number], 1, 2) @ np.linalg.inv(body.bones[name].matrix)
        for number, name in zip(numbers, (foot, toes), strict=True)
    )
    apart = first - other
    turns, gaps = apart[:, :3, :3].reshape(-1, 3), (apart[:, :3, :3] @ start + apart[:, :3, 3]).ravel()
    return np.asarray(start - np.linalg.solve(turns.T @ turns + STIFF * len(apart) * np.eye(3), turns.T @ gaps))


def body_motion(
    name: str, body: BareBody, mapping: RigMapping, recording: Recording, *, mass: float, skin_mass: float = 0.0
) -> Generator[int | None, None, CharacterMotion]:
    """The motion of such a body, whose mass is where its volume is.

    Yields the number of frames read, None where it is as before.

    Parameters
    ----------
    name : str
        The character's.
    mapping : RigMapping
        Its soles are on parts.
    mass : float
        [kg]
    skin_mass : float
        That its volume suggests [kg], 0 where unknown.

    Raises
    ------
    InputError
        If a part that should print has no underside.
    """
    bones, recording = _jointed(body, mapping, recording)
    count, stances = len(recording.frames), None
    if count <= MOST_SAMPLES:
        step = float(recording.frames[1] - recording.frames[0]) if count > 1 else 1.0
        rate = recording.units.frame_rate / step
        stances = yield from skin_stances(body.skin, bones, mapping, recording, rate, mass=skin_mass)
    motion = yield from assemble_motion(
        name, bones, mapping, recording, body.skin, mass=mass, carried={}, stances=stances
    )
    height = float(np.ptp(body.skin.vertices[:, 2])) * recording.units.unit_scale_m
    centre = centre_of_volume(body.skin, bones, recording)
    return replace(motion, joints={CENTRE: centre}, stature=height)
