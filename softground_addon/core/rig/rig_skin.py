"""The skin of a rig over time: its meshes as their bones move them, by weights and matrices alone.

No mesh is evaluated: linear blend skinning of a few thousand vertices is exact for what the Armature modifier does and
takes milliseconds, while Blender evaluates every mesh of a scene at every frame.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Indices
from ..numerics.slices import Slices, sliced
from ..skin.skin_motion import SkinMotion
from ..skin.twins import twins
from ..skin.volume import welded
from .bones import RigBones, above
from .recording import Recording

_AGAINST = 0.01
"""Boxes around parts that are nearer than this over the size of the mesh touch."""


@dataclass(frozen=True)
class Shape:
    """Offsets that a keyed shape adds to a skin at a value of 1.

    Attributes
    ----------
    key : (object, shape key)
        Names, by which its values are recorded.
    vertices : (N,) int array
        Those that it moves.
    offset : (N, 3) float array
        In the armature's space, before bones move them [Blender units].
    """

    key: tuple[str, str]
    vertices: Indices
    offset: Array


@dataclass(frozen=True)
class RigSkin:
    """The meshes of a rig in its rest pose, and the bones that move them.

    Attributes
    ----------
    vertices : (V, 3) float array
        In the armature's space [Blender units].
    triangles : (T, 3) int array
    bones : tuple of str
        Names of the bones that move some vertex; the armature itself is the last part, without a name here.
    weights : tuple of (vertices, weights) for each bone
        Vertices (N,) that a bone moves, and their weights (N,).
    part : (V,) int array
        The bone that moves each vertex most, as an index; that of the armature where none does.
    hung : (V,) bool array
        Of objects that hang on a bone instead of being deformed.
    shapes : tuple of Shape
        Those that are keyed.
    """

    vertices: Array
    triangles: Indices
    bones: tuple[str, ...]
    weights: tuple[tuple[Indices, Array], ...]
    part: Indices
    hung: NDArray[np.bool_]
    shapes: tuple[Shape, ...] = ()

    def weight_of(self, bones: Collection[str]) -> Array:
        """Share of each vertex that some bones move, (V,)."""
        total = np.zeros(len(self.vertices))
        for name, (vertex, weight) in zip(self.bones, self.weights, strict=True):
            if name in bones:
                total[vertex] += weight
        return total


@sliced
def skinned(
    skin: RigSkin, bones: RigBones, recording: Recording, chosen: Indices, *, axes: slice = slice(3)
) -> Slices[NDArray[np.float32]]:
    """World positions of the chosen vertices over time, (F, N, 3) [m], or some of their `axes`.

    Parameters
    ----------
    recording : Recording
        Of all `skin.bones`.
    chosen : (N,) int array
    """
    place = np.full(len(skin.vertices), -1, dtype=np.intp)
    place[chosen] = np.arange(len(chosen))
    backs = [np.linalg.inv(bones[name].matrix) for name in skin.bones]
    frames, rows = len(recording.frames), len(range(3)[axes])
    result = np.zeros((frames, rows, len(chosen)), dtype=np.float32)  # one product for all frames is the fastest
    held = np.zeros(len(chosen), dtype=bool)

    def add(matrices: Array, vertex: Indices, weight: Array) -> None:
        """Add what a bone with some matrices (F, 4, 4) moves."""
        moved = matrices[:, :3][:, axes].astype(np.float32)
        rest = np.append(skin.vertices[vertex], np.ones((len(vertex), 1)), axis=1)
        weighted = (weight[:, None] * rest).T.astype(np.float32)
        result[..., place[vertex]] += (moved.reshape(-1, 4) @ weighted).reshape(frames, rows, -1)
        for shape in skin.shapes:
            at = np.searchsorted(shape.vertices, vertex).clip(max=len(shape.vertices) - 1)
            shaped = shape.vertices[at] == vertex
            if shaped.any():
                mixed = moved[..., :3] * recording.shapes[shape.key].astype(np.float32)[:, None, None]
                offset = (weight[shaped, None] * shape.offset[at[shaped]]).T.astype(np.float32)
                result[..., place[vertex[shaped]]] += (mixed.reshape(-1, 3) @ offset).reshape(frames, rows, -1)

    for name, back, (moved_by, weights) in zip(skin.bones, backs, skin.weights, strict=True):
        here = place[moved_by] >= 0
        if not here.any():
            continue
        add(recording.bone(name) @ back, moved_by[here], weights[here])
        held[place[moved_by[here]]] = True
        yield
    if not held.all():
        add(recording.armature, chosen[~held], np.ones(np.count_nonzero(~held)))
    return np.swapaxes(result, 1, 2)


_PROBES = 8
"""Poses in which the vertices near the ground are looked for, and what a body leaves behind."""

_LEAVES, _STAYS = 0.5, 1e-3
"""Way that all moving parts go away from a part that is left behind, over the size of the body, and most that this part
itself moves, over that way."""

_NEAR = 0.15
"""Distance from the lowest vertex that a followed one comes within, in body heights."""

_MOST_POINTS = 1500
"""Vertices that are followed at most."""

_MOST_PLACES = 6_000_000
"""The same times the samples, so that long shots fit into memory."""


@dataclass(frozen=True)
class FollowedSkin:
    """The skin near the ground over time.

    Attributes
    ----------
    bones : tuple of str
        Bone of each part of the motion; empty where only the armature moves it.
    """

    motion: SkinMotion
    bones: tuple[str, ...]


@sliced
def followed_skin(
    skin: RigSkin, bones: RigBones, recording: Recording, rate: float, *, linked: bool = False
) -> Slices[FollowedSkin | None]:
    """Some vertices over time, by which the contacts of a rig are found, or None where it is flat or nowhere.

    Parameters
    ----------
    recording : Recording
        Of all `skin.bones`.
    rate : float
        Samples per second [Hz].
    linked : bool
        True to find parts that hang together, and mirror images.
    """
    body = np.flatnonzero(of_body(skin, bones, recording))
    probes = _probes(recording)
    height = (yield from skinned.slices(skin, bones, probes, body, axes=slice(2, 3)))[..., 0]
    size = float(np.median(np.ptp(height, axis=1)))
    if not 0 < size < np.inf:
        return None
    clearance = (height - height.min(axis=1, keepdims=True)).min(axis=0)
    chosen = body[clearance < _NEAR * size]
    chosen = chosen[np.argsort(skin.part[chosen], kind="stable")]
    most = min(_MOST_POINTS, max(_MOST_PLACES // len(recording.frames), 1))
    chosen = chosen[_thinned(np.unique(skin.part[chosen], return_counts=True)[1], most)]
    used, part = np.unique(skin.part[chosen], return_inverse=True)
    yield
    places = yield from skinned.slices(skin, bones, recording, chosen)
    if not np.isfinite(places).all():
        return None
    yield
    links = twin = beside = None
    if linked:
        links = _links(skin, bones)[np.ix_(used, used)]
        yield
        place = np.full(len(skin.bones) + 1, -1)
        place[used] = np.arange(len(used))
        beside = _beside(skin, used)
        twin = place[twins(skin.vertices[body], skin.part[body], len(place))[used]]
    motion = SkinMotion(places, part, links, rate, size, twin, beside)
    return FollowedSkin(motion, tuple((*skin.bones, "")[number] for number in used))


def _thinned(counts: Indices, most: int) -> NDArray[np.bool_]:
    """True for points to follow of parts with counts (P,): of large parts fewer, evenly, until `most` remain."""
    ordered = np.sort(counts)
    caps = (most - np.cumsum(ordered) + ordered) / np.arange(len(counts), 0, -1)
    cap = caps[(caps <= ordered).argmax()] if counts.sum() > most else ordered[-1]
    count = np.repeat(counts, counts)
    rank = np.arange(len(count)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = np.minimum(max(cap, 1) / count, 1.0)
    return np.asarray(np.floor((rank + 1) * share + 1e-9) > np.floor(rank * share + 1e-9))


def of_body(skin: RigSkin, bones: RigBones, recording: Recording) -> NDArray[np.bool_]:
    """Vertices (V,) of the body itself: not of props that it carries, nor of what it leaves behind."""
    parts = np.append([name in recording.bones for name in skin.bones], True)
    behind = _left_behind(skin, bones, _probes(recording)) if parts.all() else ~parts
    return ~(_carried(skin, bones) | behind[skin.part])


def _carried(skin: RigSkin, bones: RigBones) -> NDArray[np.bool_]:
    """Vertices of props that a character carries: hung on bones that hang from bones with a skin.

    A robot of rigid pieces has no such skin above them; there they are its body.
    """
    clothed = {skin.bones[number] for number in np.unique(skin.part[~skin.hung]) if number < len(skin.bones)}
    carries = [any(parent in clothed for parent in above(bones, name)) for name in skin.bones]
    return skin.hung & np.array([*carries, False])[skin.part]


def _left_behind(skin: RigSkin, bones: RigBones, poses: Recording) -> NDArray[np.bool_]:
    """Parts that stay where they are in all poses while the others, which are no fewer, go away from them.

    A floor on a root bone does; a figure that stands still while a ball of its rig flies off does not.
    """
    count = len(skin.bones) + 1
    size = np.bincount(skin.part, minlength=count)
    middle = np.stack([np.bincount(skin.part, along, count) for along in skin.vertices.T], axis=-1)
    middle = np.append(middle / np.maximum(size, 1)[:, None], np.ones((count, 1)), axis=1)
    backs = [poses.bone(name) @ np.linalg.inv(bones[name].matrix) for name in skin.bones]
    path = np.stack([matrices[:, :3] @ at for matrices, at in zip([*backs, poses.armature], middle, strict=True)])
    used = size > 0
    far = _LEAVES * np.ptp(path[used, 0], axis=0).max(initial=0.0)
    still = np.ptp(path, axis=1).max(axis=-1) < _STAYS * far
    moves = np.flatnonzero(used & ~still)
    behind = np.zeros(count, dtype=bool)
    for part in np.flatnonzero(used & still) if len(moves) else ():
        gap = np.linalg.norm(path[moves] - path[part], axis=-1).min(axis=0)
        behind[part] = np.ptp(gap) > far
    return behind & (np.count_nonzero(behind) <= len(moves))


def _probes(recording: Recording) -> Recording:
    """A few of the poses of a recording, from first to last."""
    return recording.of(np.unique(np.linspace(0, len(recording.frames) - 1, _PROBES).astype(int)))


def _beside(skin: RigSkin, parts: Indices) -> NDArray[np.bool_]:
    """Pairs of parts that lie against each other at rest: boxes around them touch."""
    corners = [(lie.min(axis=0), lie.max(axis=0)) for lie in (skin.vertices[skin.part == part] for part in parts)]
    low, high = np.swapaxes(corners, 0, 1)
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=-1)
    touching = gap < _AGAINST * np.ptp(skin.vertices, axis=0).max()
    return touching & ~np.eye(len(parts), dtype=bool)


def _links(skin: RigSkin, bones: RigBones) -> NDArray[np.bool_]:
    """Links between parts, by welded skin or as parent and child, (P, P) with the armature's own last."""
    count = len(skin.bones) + 1
    links = np.zeros((count, count), dtype=bool)
    corners = skin.part[skin.triangles]
    for start, end in ((0, 1), (1, 2), (2, 0)):
        links[corners[:, start], corners[:, end]] = True
    place = welded(skin.vertices)
    order = np.lexsort((skin.part, place))
    same = np.diff(place[order]) == 0
    links[skin.part[order[1:]][same], skin.part[order[:-1]][same]] = True
    number = {name: index for index, name in enumerate(skin.bones)}
    for name, index in number.items():
        parent = next((bone for bone in above(bones, name) if bone in number), None)
        if parent:
            links[index, number[parent]] = True
    return np.asarray(links | links.T)
