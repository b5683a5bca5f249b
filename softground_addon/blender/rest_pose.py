"""Feet and limbs of a rig whose names say nothing, from the shape of its rest pose.

Legs are the mirrored chains that reach lowest; left and right come from the way the feet point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.motion import Array

Joints = dict[str, tuple[str, str]]
Feet = list[tuple[str, str, str, str]]

_Pair = tuple[list[int], list[int]]
"""Two mirrored chains of bones, from where they part down to the tips."""

_LOW = 0.2
"""A leaf counts as a foot when its lowest end is in this part of the rig's height."""

_ANKLE_LEVEL = 0.3
"""The foot starts below this part of the hip's height (the ankle of a human is at 0.08, the knee at 0.54)."""

_WIDEST = 40
"""So many tips of bones, the farthest to the sides, are looked at for arms: fingers, in most rigs."""

_NO_DIRECTION = 0.01
"""Feet that point less far than this part of the rig's height do not tell where it faces."""

_MIRROR_TOLERANCE = 0.06
"""Two points count as mirrored when they agree to this part of the rig's height."""


@dataclass(frozen=True)
class _Skeleton:
    names: list[str]
    parents: list[int]
    heads: Array
    tails: Array

    @property
    def height(self) -> float:
        points = np.concatenate([self.heads, self.tails])
        return float(np.ptp(points[:, 2])) or 1.0

    @property
    def leaves(self) -> list[int]:
        """Bones that nothing hangs from."""
        return sorted(set(range(len(self.names))) - set(self.parents))

    def lengths(self, chain: Sequence[int]) -> list[float]:
        """From the head of each bone of a chain to that of the next; of the last, to its tail."""
        points = np.array([*self.heads[list(chain)], self.tails[chain[-1]]])
        return [float(length) for length in np.linalg.norm(np.diff(points, axis=0), axis=1)]

    def chain(self, bone: int) -> list[int]:
        """From the root down to a bone."""
        path = [bone]
        while self.parents[path[-1]] >= 0:
            path.append(self.parents[path[-1]])
        return path[::-1]


def map_by_rest_pose(armature: bpy.types.Object) -> tuple[Joints, Feet] | None:
    """Joints and feet (name, side, bone, toe bone) from the rest pose, or None where no pair of legs shows.

    Steering bones are left out: where some bones deform, only those count.
    """
    skeleton = _read_skeleton(armature)
    pairs = _mirrored_legs(skeleton)
    if not pairs:
        return None
    forward = _forward(skeleton, pairs)
    left = np.cross((0.0, 0.0, 1.0), forward)
    pairs.sort(key=lambda pair: float(skeleton.heads[pair[0][0]] @ forward))
    joints: Joints = {}
    feet: Feet = []
    for index, pair in enumerate(pairs):
        limb = ("hip", "knee", "ankle", "ball", "toe") if index == 0 else ("shoulder", "elbow", "wrist", "", "")
        stem = "foot" if index == 0 else "forefoot" if index == len(pairs) - 1 else f"midfoot{index}"
        sides = sorted(pair, key=lambda leg: -float(skeleton.heads[leg[-1]] @ left))
        for leg, side in zip(sides, "LR", strict=True):
            thigh, shin, foot, toe = _segments(skeleton, leg)
            for joint, bone in zip(limb, (thigh, shin, foot, toe), strict=False):
                if joint and bone is not None:
                    joints[f"{joint}_{side.lower()}"] = (skeleton.names[bone], "head")
            if limb[4]:
                joints[f"toe_{side.lower()}"] = (skeleton.names[foot if toe is None else toe], "tail")
            feet.append((f"{stem}.{side}", side, skeleton.names[foot], "" if toe is None else skeleton.names[toe]))
    hips = skeleton.parents[pairs[0][0][0]]
    if hips >= 0:
        joints["hips"] = (skeleton.names[hips], "head")
        if len(pairs) == 1:
            joints |= _upper_body(skeleton, hips, left)
    return joints, feet


def _upper_body(skeleton: _Skeleton, hips: int, left: Array) -> Joints:
    """Spine, neck, head and arms of a figure on two legs: the mirrored limbs that part highest, and what is above."""
    leaves = [
        leaf
        for leaf in skeleton.leaves
        if hips in (chain := skeleton.chain(leaf))
        and leaf != hips
        and skeleton.heads[chain, 2].max() > skeleton.heads[hips, 2] + _LOW * skeleton.height
    ]
    leaves.sort(key=lambda leaf: -abs(float((skeleton.heads[leaf] - skeleton.heads[hips]) @ left)))
    chains = [skeleton.chain(leaf) for leaf in leaves[:_WIDEST]]
    arms: list[tuple[float, int, _Pair]] = []
    for i, first in enumerate(chains):
        for second in chains[i + 1 :]:
            fork = _shared_length(first, second)
            pair = first[fork:], second[fork:]
            if fork and len(pair[0]) == len(pair[1]) >= 2 and _are_mirrored(skeleton, *pair):
                arms.append((float(sum(skeleton.lengths(pair[0]))), fork, pair))
    if not arms:
        return {}
    _, fork, pair = max(arms)
    joints: Joints = {}
    chest = skeleton.chain(pair[0][0])[:-1]
    for arm, side in zip(sorted(pair, key=lambda arm: -float(skeleton.heads[arm[-1]] @ left)), "lr", strict=True):
        lengths = skeleton.lengths(arm)
        upper = max(range(len(arm) - 1), key=lambda place: min(lengths[place], lengths[place + 1]))
        joints[f"shoulder_{side}"] = (skeleton.names[arm[upper]], "head")
        joints[f"elbow_{side}"] = (skeleton.names[arm[upper + 1]], "head")
        wrist = (arm[upper + 2], "head") if upper + 2 < len(arm) else (arm[upper + 1], "tail")
        joints[f"wrist_{side}"] = (skeleton.names[wrist[0]], wrist[1])
    above = [
        leaf
        for leaf in skeleton.leaves
        if chest[-1] in skeleton.chain(leaf) and not {leaf, *skeleton.chain(leaf)} & {*pair[0], *pair[1]}
    ]
    if above:
        top = skeleton.chain(max(above, key=lambda leaf: max(skeleton.heads[leaf, 2], skeleton.tails[leaf, 2])))
        neck = top[len(chest) :]
        joints["neck"] = (skeleton.names[neck[0]], "head")
        if len(neck) > 1:
            lengths = skeleton.lengths(neck)
            head = max(range(1, len(neck)), key=lambda place: lengths[place])
            joints["head"] = (skeleton.names[neck[head]], "head")
    if hips in chest and chest[-1] != hips:
        joints["spine"] = (skeleton.names[chest[chest.index(hips) + 1]], "head")
    return joints


def _read_skeleton(armature: bpy.types.Object) -> _Skeleton:
    """The deforming bones in world axes, each hung from its nearest ancestor that deforms."""
    bones = list(armature.data.bones)
    deforming = [bone for bone in bones if bone.use_deform] or bones
    index = {bone.name: place for place, bone in enumerate(deforming)}
    parents = [next((index[p.name] for p in bone.parent_recursive if p.name in index), -1) for bone in deforming]
    turn = np.array(armature.matrix_world.to_3x3())
    if np.linalg.det(turn) < 0:
        turn = turn * (-1, 1, 1)  # sides are those of the character, not of its mirror image
    return _Skeleton(
        names=[bone.name for bone in deforming],
        parents=parents,
        heads=np.array([bone.head_local for bone in deforming]) @ turn.T,
        tails=np.array([bone.tail_local for bone in deforming]) @ turn.T,
    )


def _mirrored_legs(skeleton: _Skeleton) -> list[_Pair]:
    """Pairs of chains, from below where they part to the lowest bones; the lowest and longest pair first."""
    has_child = {parent for parent in skeleton.parents if parent >= 0}
    floor = min(skeleton.heads[:, 2].min(), skeleton.tails[:, 2].min())
    limit = floor + _LOW * skeleton.height
    lowest = np.minimum(skeleton.heads[:, 2], skeleton.tails[:, 2])
    low_leaves = [b for b in range(len(skeleton.names)) if b not in has_child and lowest[b] < limit]
    chains = [skeleton.chain(leaf) for leaf in low_leaves]

    pairs: list[_Pair] = []
    for i, first in enumerate(chains):
        for second in chains[i + 1 :]:
            fork = _shared_length(first, second)
            left, right = first[fork:], second[fork:]
            if fork and len(left) == len(right) >= 2 and _are_mirrored(skeleton, left, right):
                pairs.append((left, right))
    return _one_per_limb(skeleton, pairs)


def _shared_length(first: Sequence[int], second: Sequence[int]) -> int:
    count = 0
    while count < min(len(first), len(second)) and first[count] == second[count]:
        count += 1
    return count


def _are_mirrored(skeleton: _Skeleton, left: Sequence[int], right: Sequence[int]) -> bool:
    """Whether two chains are images of each other in a vertical plane."""
    a, b = skeleton.heads[list(left)], skeleton.heads[list(right)]
    normal = (a - b).mean(axis=0) * (1, 1, 0)
    gap = float(np.linalg.norm(normal))
    tolerance = _MIRROR_TOLERANCE * skeleton.height
    if gap < tolerance:
        return False
    normal /= gap
    middle = (a + b).mean(axis=0) / 2
    image = b - 2 * ((b - middle) @ normal)[:, None] * normal
    return bool(np.abs(image - a).max() < tolerance)


def _one_per_limb(skeleton: _Skeleton, pairs: list[_Pair]) -> list[_Pair]:
    """The longest pair of each limb: toes of one foot share their leg, so they make many pairs."""

    def reach(pair: _Pair) -> float:
        return float(np.ptp(skeleton.heads[pair[0]][:, 2]))

    chosen: list[_Pair] = []
    taken: set[int] = set()
    for pair in sorted(pairs, key=reach, reverse=True):
        roots = {pair[0][0], pair[1][0]}
        if reach(pair) > _LOW * skeleton.height and not roots & taken:
            taken |= roots
            chosen.append(pair)
    return chosen


def _forward(skeleton: _Skeleton, pairs: Sequence[_Pair]) -> Array:
    """Horizontal direction in which most feet point, not normalised; Blender's front view where they do not."""
    total = np.zeros(3)
    for leg in (leg for pair in pairs for leg in pair):
        foot = _segments(skeleton, leg)[2]
        total += (skeleton.tails[leg[-1]] - skeleton.heads[foot]) * (1, 1, 0)
    across = _across(skeleton, pairs[0])
    ahead = total - (total @ across) * across
    if np.linalg.norm(ahead) > _NO_DIRECTION * skeleton.height:
        return ahead
    return np.array((0.0, -1.0, 0.0)) if abs(across[0]) > abs(across[1]) else np.array((1.0, 0.0, 0.0))


def _across(skeleton: _Skeleton, pair: _Pair) -> Array:
    """Horizontal unit vector from the second leg of a pair to the first."""
    across = (skeleton.heads[pair[0]] - skeleton.heads[pair[1]]).mean(axis=0) * (1, 1, 0)
    return np.asarray(across / np.linalg.norm(across), dtype=float)


def _segments(skeleton: _Skeleton, leg: Sequence[int]) -> tuple[int, int, int, int | None]:
    """Thigh, shin, foot and toe bone of a leg chain."""
    floor = min(skeleton.heads[leg[-1], 2], skeleton.tails[leg[-1], 2])
    level = (skeleton.heads[list(leg), 2] - floor) / max(skeleton.heads[leg[0], 2] - floor, 1e-9)
    low = [place for place in range(1, len(leg)) if level[place] < _ANKLE_LEVEL]
    ankle = low[0] if low else len(leg) - 1
    knee = min(range(1, ankle), key=lambda place: abs(level[place] - 0.54)) if ankle > 1 else 0
    toe = leg[ankle + 1] if ankle + 1 < len(leg) else None
    return leg[0], leg[knee], leg[ankle], toe
