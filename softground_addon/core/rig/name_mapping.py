"""Roles of bones by the names of the usual rigs; the hierarchy separates those with the same word."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence, Set

import numpy as np

from .bone_names import LIMBS, TRUNK, BoneName, best, read_names
from .bones import RigBones, above, extent
from .mapping import BoneEnd, RigMapping, SoleSource

_JOINT_HEADS = {
    "hip": "thigh",
    "knee": "shin",
    "ankle": "foot",
    "ball": "toe",
    "shoulder": "upper_arm",
    "elbow": "forearm",
    "wrist": "hand",
}
"""Joint to the segment whose head it is."""

_SEGMENTS = {"leg": ("thigh", "shin", "foot", "toe"), "arm": ("upper_arm", "forearm", "hand")}
"""Segments of legs and arms, from the body outward."""

_Limb = tuple[str, str]
"""A leg or an arm, and its side."""

_TOES_REACH = 0.2
"""Toes that hang elsewhere than on their foot begin this near to it, over the size of the rig."""

_HIPS_OF_SOME = ("root", "cog", "spine")
"""Words that mean the hips in some rigs and another place in others; where the thighs begin decides."""


def map_by_names(bones: RigBones, deforming: Set[str]) -> RigMapping | None:
    """The mapping that the names give, or None where they name no foot.

    Limbs that hang together as none do are left out. Where a leg is among them, so are both legs and all soles, as well
    as arms that are named in part and a trunk that hangs on a limb.

    Parameters
    ----------
    deforming : set of str
        Names of those that move a mesh.
    """
    names = read_names(bones, deforming)
    limbs: dict[_Limb, list[str]] = {}
    for side in "LR":
        limb = {segment: best(names, words, side) for segment, words in LIMBS.items()}
        _settle_ambiguities(limb, names, bones, side, deforming)
        _keep_to_one_leg(limb, names, bones, side)
        limbs |= {(part, side): [limb[segment] for segment in _SEGMENTS[part]] for part in _SEGMENTS}
    if not any(limbs["leg", side][2] or limbs["leg", side][3] for side in "LR"):
        return None
    misread = _misread(limbs, bones)
    shows_legs = not any(part == "leg" for part, _ in misread)
    if not shows_legs:
        misread |= {limb for limb, chain in limbs.items() if limb[0] == "leg" or not all(chain)}
    joints: dict[str, BoneEnd] = {}
    soles = []
    for (part, side), chain in limbs.items():
        if (part, side) in misread:
            continue
        suffix = f"_{side.lower()}"
        named = {segment: bone for segment, bone in zip(_SEGMENTS[part], chain, strict=True) if bone}
        joints |= {joint + suffix: (named[of], "head") for joint, of in _JOINT_HEADS.items() if of in named}
        if "forearm" in named and "hand" not in named:
            joints["wrist" + suffix] = (named["forearm"], "tail")
        if part == "leg" and (chain[2] or chain[3]):
            foot, toe = chain[2:]
            joints["toe" + suffix] = (toe or foot, "tail")
            soles.append(SoleSource(f"foot.{side}", side, foot or toe, toe if foot else ""))
    trunk = _map_trunk(names, bones, joints, deforming)
    on_limbs = {bone for chain in limbs.values() for bone in chain if bone}
    if shows_legs or not any(on_limbs.intersection((bone, *above(bones, bone))) for bone, _ in trunk.values()):
        joints |= trunk
    return RigMapping(joints=joints, soles=tuple(soles))


def _misread(limbs: Mapping[_Limb, Sequence[str]], bones: RigBones) -> set[_Limb]:
    """The limbs that hang on others, or of which a segment hangs on one farther out; empty names are no bones.

    Of two of which one hangs on the other, that is misread which is so to more of them; both where that is the same.
    """
    place = {bone: (limb, number) for limb, chain in limbs.items() for number, bone in enumerate(chain) if bone}
    pairs = [(place[bone], place[upper]) for bone in place for upper in above(bones, bone) if upper in place]
    wrong = [{limb, other} for (limb, number), (other, before) in pairs if limb != other or number <= before]
    misread: set[_Limb] = set()
    while wrong:
        counts = Counter(limb for pair in wrong for limb in pair)
        misread |= {limb for limb, count in counts.items() if count == max(counts.values())}
        wrong = [pair for pair in wrong if not pair & misread]
    return misread


def _settle_ambiguities(
    limb: dict[str, str], names: list[BoneName], bones: RigBones, side: str, deforming: Set[str]
) -> None:
    """Words that name different bones in different families: `leg` above `knee`, `ankle` above `foot`."""
    knee, leg = (best(names, (word,), side) for word in ("knee", "leg"))
    if knee and leg and leg in above(bones, knee):
        limb["shin"] = knee
        limb["thigh"] = limb["thigh"] if limb["thigh"] and limb["thigh"] in above(bones, leg) else leg
    ankle, foot = (best(names, (word,), side) for word in ("ankle", "foot"))
    if ankle and foot and ankle in above(bones, foot):
        limb["foot"] = ankle
        limb["toe"] = limb["toe"] if limb["toe"] and foot not in above(bones, limb["toe"]) else foot
    toe, foot = limb["toe"], limb["foot"]
    if toe and foot and (toe in above(bones, foot) or (foot in deforming and toe not in deforming)):
        limb["toe"] = ""


def _keep_to_one_leg(limb: dict[str, str], names: list[BoneName], bones: RigBones, side: str) -> None:
    """The toe that hangs on the foot, and the shin and thigh that it hangs on, where another leg has such names too."""
    foot, toe = limb["foot"], limb["toe"]
    if foot and toe and foot not in above(bones, toe):
        toes = [name for name in names if foot in above(bones, name.bone)]
        reach = _TOES_REACH * extent(np.array([bone.head for bone in bones.values()]), np.eye(4))
        is_near = np.linalg.norm(bones[toe].head - bones[foot].head) < reach
        limb["toe"] = best(toes, LIMBS["toe"], side) or (toe if is_near else "")
    chain = [*above(bones, foot)] if foot else []
    for segment in ("shin", "thigh"):
        if limb[segment] not in chain:
            limb[segment] = best([name for name in names if name.bone in chain], LIMBS[segment], side) or limb[segment]


def _map_trunk(
    names: list[BoneName], bones: RigBones, limbs: Mapping[str, BoneEnd], deforming: Set[str]
) -> dict[str, BoneEnd]:
    """Hips, spine, neck and head; the hips may also be where the thighs meet."""
    by_joint = {joint: best(names, words, "") for joint, words in TRUNK.items()}
    thighs = [limbs[joint][0] for joint in ("hip_l", "hip_r") if joint in limbs]
    if by_joint["hips"] not in deforming:
        candidates = [by_joint["hips"], *(best(names, (word,), "") for word in _HIPS_OF_SOME)]
        candidates.append(_common_ancestor(thighs, bones))
        by_joint["hips"] = _nearest_to_thighs([bone for bone in candidates if bone], thighs, bones, deforming)
    top = by_joint["neck"] or by_joint["head"]
    if by_joint["hips"] and top:
        chain = [*above(bones, top)]
        if by_joint["hips"] in chain:
            words = {name.bone: name.word for name in names}
            upward = chain[: chain.index(by_joint["hips"])]
            trunk = [bone for bone in upward if words.get(bone) not in TRUNK["neck"]]
            by_joint["spine"] = trunk[-1] if trunk else ""
    if by_joint["spine"] == by_joint["hips"]:
        spines = sorted(
            (name.number, name.bone)
            for name in names
            if name.word == "spine" and name.deforms and name.bone != by_joint["hips"]
        )
        by_joint["spine"] = spines[0][1] if spines else ""
    return {joint: (bone, "head") for joint, bone in by_joint.items() if bone}


def _common_ancestor(names: Sequence[str], bones: RigBones) -> str:
    """Nearest bone that all of the given ones hang from; empty if there is none."""
    if not names:
        return ""
    chains = [[*above(bones, name)] for name in names]
    return next((bone for bone in chains[0] if all(bone in chain for chain in chains)), "")


def _nearest_to_thighs(candidates: Sequence[str], thighs: Sequence[str], bones: RigBones, deforming: Set[str]) -> str:
    """The bone that starts nearest to the middle between the thighs, deforming ones first; empty without candidates."""
    if not thighs or not candidates:
        return candidates[0] if candidates else ""
    middle = np.mean([bones[thigh].head for thigh in thighs], axis=0)
    return min(candidates, key=lambda name: (name not in deforming, float(np.linalg.norm(bones[name].head - middle))))
