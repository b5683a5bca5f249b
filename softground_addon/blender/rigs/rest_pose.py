"""Feet and limbs of a rig whose names say nothing, from the shape of its rest pose.

Legs are the mirrored chains that reach lowest; left and right come from the way the feet point. Motion files may lay
all bones along one axis at rest: there the pose of the current frame counts, whose legs are the chains of equal bones
that reach lowest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import bpy
import numpy as np

from ...core.motion.ground_frame import upright
from ...core.numerics.arrays import Array
from ..placement import felt_gravity
from ..settings import gravity_direction_of
from .object_data import armature_of, pose_bones

Joints = dict[str, tuple[str, str]]
Feet = list[tuple[str, str, str, str]]

_Pair = tuple[list[int], list[int]]
"""Two mirrored chains of bones, from where they part down to the tips."""

_LOW = 0.2
"""A leaf counts as a foot when its lowest end is in this part of the rig's height."""

_RAISED = 0.35
"""The same in a pose, in which a foot may be lifted."""

_ANKLE_LEVEL = 0.3
"""The foot starts below this part of the hip's height (the ankle of a human is at 0.08, the knee at 0.54)."""

_WIDEST = 40
"""So many tips of bones, the farthest to the sides, are looked at for arms: fingers, in most rigs."""

_NO_DIRECTION = 0.01
"""Feet that point less far than this part of the rig's height do not show where it faces."""

_MIRROR_TOLERANCE = 0.06
"""Two points count as mirrored when they agree to this part of the rig's height."""


_HANGS_ON_THE_ROOT = 3
"""A foot with no more bones from the root down hangs on the root: thigh and shin would be among them, and the hips."""


@dataclass(frozen=True)
class _Skeleton:
    names: list[str]
    parents: list[int]
    heads: Array
    tails: Array
    is_posed: bool = False
    """True of a pose of the animation, in which limbs are not mirror images."""

    @property
    def height(self) -> float:
        points = np.concatenate([self.heads, self.tails])
        return float(np.ptp(points[:, 2])) or 1.0

    @property
    def leaves(self) -> list[int]:
        """Bones that nothing hangs from."""
        return sorted(set(range(len(self.names))) - set(self.parents))

    def lengths(self, chain: Sequence[int]) -> list[float]:
        """Distances from the head of each bone of a chain to that of the next; of the last, to its tail."""
        points = np.array([*self.heads[list(chain)], self.tails[chain[-1]]])
        return [float(length) for length in np.linalg.norm(np.diff(points, axis=0), axis=1)]

    def chain(self, bone: int) -> list[int]:
        """Bones from the root down to one."""
        path = [bone]
        while self.parents[path[-1]] >= 0:
            path.append(self.parents[path[-1]])
        return path[::-1]


def map_by_rest_pose(
    armature: bpy.types.Object, *, posed: bool = False, skinned: bool = True
) -> tuple[Joints, Feet] | None:
    """Joints and feet (name, side, bone, toe bone) from the rest pose, or None where no pair of legs shows.

    Steering bones are left out: where some bones deform, only those count. If `posed`, the current pose is looked at in
    place of the rest pose. Feet may hang elsewhere than on their legs where no skin shows what stands.
    """
    skeleton = _read_skeleton(armature, posed=posed)
    pairs = _mirrored_legs(skeleton)
    if not skinned:
        pairs = [
            _with_free_feet(skeleton, pair, {bone for legs in pairs for leg in legs for bone in leg}) for pair in pairs
        ]
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


def legs_of_feet(armature: bpy.types.Object, feet: Sequence[str]) -> Joints:
    """Hips, knees and ankles of feet that hang elsewhere than on their shins; empty if there are none.

    In game rigs whose IK was baked, feet hang on the root. The shin of such a foot is the end of another chain that is
    nearest to it; both feet of a pair, with their shins and thighs, are mirror images.
    """
    skeleton = _read_skeleton(armature)
    paths = [skeleton.chain(skeleton.names.index(foot)) for foot in feet if foot in skeleton.names]
    paths = [path for path in paths if len(path) <= _HANGS_ON_THE_ROOT]
    tops = {top for path in paths if (top := _highest_alone(path, paths)) is not None}
    chains = [chain for leaf in skeleton.leaves if not tops & {*(chain := skeleton.chain(leaf))} and len(chain) > 2]
    legs = []
    for top in sorted(tops) if chains else ():
        shin = min(chains, key=lambda chain: float(np.linalg.norm(skeleton.heads[chain[-1]] - skeleton.heads[top])))
        leg = [*shin[-2:], top]
        if (np.diff(skeleton.heads[leg, 2]) < 0).all():
            legs.append(leg)
    pairs = [(leg, other) for leg, other in combinations(legs, 2) if _are_mirrored(skeleton, leg, other)]
    return _joints_of(skeleton, pairs, ("hip", "knee", "ankle"))


def legs_on_shins(armature: bpy.types.Object, soles: Sequence[str]) -> Joints:
    """Hips and knees of legs that stand on the ends of their shins, as of figures made of blocks; empty if there are
    none.

    Such a leg is the last two bones below where it parts from its mirror image; where arms are too, legs begin lower.
    """
    skeleton = _read_skeleton(armature)
    chains = [skeleton.chain(leaf) for leaf in skeleton.leaves]
    pairs = []
    for leg_chain in (chain for chain in chains if skeleton.names[chain[-1]] in soles):
        for other in (chain for chain in chains if len(chain) == len(leg_chain)):
            fork = _shared_length(leg_chain, other)
            if len(leg_chain) - fork == 2 and _are_mirrored(skeleton, leg_chain[fork:], other[fork:]):
                pairs.append((leg_chain[fork:], other[fork:]))
    level = min((float(skeleton.heads[leg[0], 2]) for leg, _ in pairs), default=0.0) + _LOW * skeleton.height
    return _joints_of(skeleton, [pair for pair in pairs if skeleton.heads[pair[0][0], 2] <= level], ("hip", "knee"))


def _joints_of(skeleton: _Skeleton, pairs: Sequence[_Pair], joints: Sequence[str]) -> Joints:
    """The joints at which the bones of pairs of legs begin, the hindmost first: `leg_sides`."""
    if not pairs:
        return {}
    forward = _forward(skeleton, pairs)
    left = np.cross((0.0, 0.0, 1.0), forward)
    found: Joints = {}
    number, taken = 1, set[int]()
    for pair in sorted(pairs, key=lambda pair: float(skeleton.heads[pair[0][0]] @ forward)):
        if taken & {*pair[0], *pair[1]}:
            continue
        taken |= {*pair[0], *pair[1]}
        for side, leg in zip("lr", sorted(pair, key=lambda leg: -float(skeleton.heads[leg[-1]] @ left)), strict=True):
            named = (f"{joint}_{side}{number if number > 1 else ''}" for joint in joints)
            found |= {joint: (skeleton.names[bone], "head") for joint, bone in zip(named, leg, strict=True)}
        number += 1
    return found


def _highest_alone(path: Sequence[int], paths: Sequence[Sequence[int]]) -> int | None:
    """The highest bone on the way from the root to a foot that carries no other; None where the foot itself does."""
    others = {bone for other in paths if other != path for bone in other}
    return next((bone for bone in path if bone not in others), None)


def _upper_body(skeleton: _Skeleton, hips: int, left: Array) -> Joints:
    """Spine, neck, head and arms of a biped: the longest mirrored limbs above the hips, and the chain on top."""
    pairs = _mirrored_pairs(skeleton, _reaching_up(skeleton, hips, left))
    if not pairs:
        return {}
    arms = max(pairs, key=lambda pair: sum(skeleton.lengths(pair[0])))
    joints: Joints = {}
    for arm, side in zip(sorted(arms, key=lambda arm: -float(skeleton.heads[arm[-1]] @ left)), "lr", strict=True):
        joints |= _arm_joints(skeleton, arm, side)
    chest = skeleton.chain(arms[0][0])[:-1]
    above = [chain for leaf in skeleton.leaves if chest[-1] in (chain := skeleton.chain(leaf))]
    above = [chain for chain in above if not {*chain} & {*arms[0], *arms[1]}]
    if above:
        top = max(above, key=lambda chain: max(skeleton.heads[chain[-1], 2], skeleton.tails[chain[-1], 2]))
        joints |= _neck_joints(skeleton, top[len(chest) :])
    if hips in chest and chest[-1] != hips:
        joints["spine"] = (skeleton.names[chest[chest.index(hips) + 1]], "head")
    return joints


def _reaching_up(skeleton: _Skeleton, hips: int, left: Array) -> list[list[int]]:
    """Chains from the root through the hips to well above them, those first that end the farthest to the sides."""
    chains = [chain for leaf in skeleton.leaves if leaf != hips and hips in (chain := skeleton.chain(leaf))]
    level = skeleton.heads[hips, 2] + _LOW * skeleton.height
    chains = [chain for chain in chains if skeleton.heads[chain, 2].max() > level]
    chains.sort(key=lambda chain: -abs(float((skeleton.heads[chain[-1]] - skeleton.heads[hips]) @ left)))
    return chains[:_WIDEST]


def _arm_joints(skeleton: _Skeleton, arm: Sequence[int], side: str) -> Joints:
    """Shoulder, elbow and wrist: its two longest bones that follow each other are the upper arm and the forearm."""
    lengths = skeleton.lengths(arm)
    upper = max(range(len(arm) - 1), key=lambda place: min(lengths[place], lengths[place + 1]))
    wrist = (arm[upper + 2], "head") if upper + 2 < len(arm) else (arm[upper + 1], "tail")
    return {
        f"shoulder_{side}": (skeleton.names[arm[upper]], "head"),
        f"elbow_{side}": (skeleton.names[arm[upper + 1]], "head"),
        f"wrist_{side}": (skeleton.names[wrist[0]], wrist[1]),
    }


def _neck_joints(skeleton: _Skeleton, neck: Sequence[int]) -> Joints:
    """Neck and head: the head is the longest bone after the first."""
    joints: Joints = {"neck": (skeleton.names[neck[0]], "head")}
    if len(neck) > 1:
        lengths = skeleton.lengths(neck)
        head = max(range(1, len(neck)), key=lambda place: lengths[place])
        joints["head"] = (skeleton.names[neck[head]], "head")
    return joints


def _read_skeleton(armature: bpy.types.Object, *, posed: bool = False) -> _Skeleton:
    """The deforming bones in world axes, at rest or posed, each hung from its nearest ancestor that deforms."""
    bones = list(armature_of(armature).bones)
    deforming = [bone for bone in bones if bone.use_deform] or bones
    index = {bone.name: place for place, bone in enumerate(deforming)}
    parents = [next((index[p.name] for p in bone.parent_recursive if p.name in index), -1) for bone in deforming]
    turn = np.array(armature.matrix_world.to_3x3())
    for scene in armature.users_scene[:1]:
        turn = upright(-np.array(felt_gravity(gravity_direction_of(scene), [armature]))) @ turn
    if np.linalg.det(turn) < 0:
        turn = turn * (-1, 1, 1)  # sides are those of the character, not of its mirror image
    names = [bone.name for bone in deforming]
    ends = [(bone.head_local, bone.tail_local) for bone in deforming]
    if posed:
        ends = [(bone.head, bone.tail) for bone in map(pose_bones(armature).__getitem__, names)]
    heads, tails = np.moveaxis(np.array(ends), 1, 0) @ turn.T
    return _Skeleton(names, parents, heads, tails, posed)


def _mirrored_legs(skeleton: _Skeleton) -> list[_Pair]:
    """Pairs of chains, from below where they part to the lowest bones; the lowest and longest pair first."""
    floor = min(skeleton.heads[:, 2].min(), skeleton.tails[:, 2].min())
    limit = floor + (_RAISED if skeleton.is_posed else _LOW) * skeleton.height
    lowest = np.minimum(skeleton.heads[:, 2], skeleton.tails[:, 2])
    chains = [skeleton.chain(leaf) for leaf in skeleton.leaves if lowest[leaf] < limit]
    return _one_per_limb(skeleton, _mirrored_pairs(skeleton, chains))


def _with_free_feet(skeleton: _Skeleton, pair: _Pair, taken: set[int]) -> _Pair:
    """Legs with the bones that begin where they end, and reach lower; themselves where not both have one."""
    feet = []
    for leg in pair:
        end = skeleton.tails[leg[-1]]
        gap = np.linalg.norm(skeleton.heads - end, axis=1)
        gap[[*taken]] = np.inf
        gap[skeleton.tails[:, 2] >= end[2]] = np.inf
        feet += [int(gap.argmin())] if gap.min() < _MIRROR_TOLERANCE * skeleton.height else []
    return ([*pair[0], feet[0]], [*pair[1], feet[1]]) if len({*feet}) == 2 else pair


def _mirrored_pairs(skeleton: _Skeleton, chains: Sequence[list[int]]) -> list[_Pair]:
    """Pairs of chains that are mirror images below the bone where they part."""
    pairs: list[_Pair] = []
    for first, second in combinations(chains, 2):
        fork = _shared_length(first, second)
        left, right = first[fork:], second[fork:]
        if fork and len(left) == len(right) >= 2 and _are_mirrored(skeleton, left, right):
            pairs.append((left, right))
    return pairs


def _shared_length(first: Sequence[int], second: Sequence[int]) -> int:
    count = 0
    while count < min(len(first), len(second)) and first[count] == second[count]:
        count += 1
    return count


def _are_mirrored(skeleton: _Skeleton, left: Sequence[int], right: Sequence[int]) -> bool:
    """True if two chains mirror each other in a vertical plane; in a pose, if their bones are as long."""
    tolerance = _MIRROR_TOLERANCE * skeleton.height
    if skeleton.is_posed:
        lengths, others = (np.array(skeleton.lengths(chain)[:-1]) for chain in (left, right))  # tips end anywhere
        return bool(np.abs(lengths - others).max() < tolerance)
    a, b = skeleton.heads[list(left)], skeleton.heads[list(right)]
    normal = (a - b).mean(axis=0) * (1, 1, 0)
    gap = float(np.linalg.norm(normal))
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
