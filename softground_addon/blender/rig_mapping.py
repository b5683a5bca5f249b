"""Which bone is what: joints and feet of an armature, from the names of the usual rigs, else from its rest pose.

Names are compared whole, after taking off the side and what a family puts around the words, so that a control, pole or
twist bone (`foot_ik.L`, `c_foot_roll.l`, `thigh_twist_01_l`) is never taken for the limb. Where several bones carry one
name (Rigify's DEF-, ORG- and control layers), the one that deforms the mesh wins.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import bpy
from mathutils import Vector

from ..core.errors import InputError
from .rest_pose import map_by_rest_pose


@dataclass(frozen=True)
class SoleSource:
    """What one sole is made from.

    Attributes
    ----------
    name : str
        What the user sees, e.g. "foot.L".
    side : str
        "L", "R" or "".
    bone : str
        Bone of the armature that carries the sole; empty if an object does.
    toe_bone : str
        Bone of the toes; empty for a sole of one piece.
    object : str
        Name of an object that prints with its own mesh instead; empty if a bone does.
    limb : bool
        Whether the bone prints by whatever side of it faces down, as a hand, a knee or a back, and not by a sole.
    """

    name: str
    side: str = ""
    bone: str = ""
    toe_bone: str = ""
    object: str = ""
    limb: bool = False


@dataclass(frozen=True)
class RigMapping:
    """What the parts of a rig are.

    Attributes
    ----------
    joints : mapping of str to (str, str)
        Canonical joint (`core.motion.JOINTS`) to bone name and end, "head" or "tail".
    soles : tuple of SoleSource
        What prints, feet first.
    method : str
        "names" or "rest pose", for the report.
    """

    joints: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    soles: tuple[SoleSource, ...] = ()
    method: str = "names"


_LIMBS: Mapping[str, tuple[str, ...]] = {
    "thigh": (
        "thigh", "upleg", "upperleg", "thighbend", "thightwist", "thighstretch", "femur", "upperthigh", "legupper",
        "hip", "hipjoint",
    ),
    "shin": (
        "shin", "calf", "lowerleg", "loleg", "lowleg", "leg", "knee", "legstretch", "crus", "tibia", "leglower",
        "kneejoint",
    ),
    "foot": ("foot", "ankle", "feet", "footjoint", "anklejoint"),
    "toe": (
        "toe11", "toe", "toes", "toebase", "ball", "football", "toesbase", "foottoe", "foottoes", "toebig", "bigtoe",
        "toejoint",
    ),
    "upper_arm": (
        "upperarm", "uparm", "arm", "upperarmbend", "shldrbend", "armtwist", "armstretch", "humerus", "armupper",
        "shldr", "shoulder",
    ),
    "forearm": (
        "forearm", "lowerarm", "loarm", "lowarm", "elbow", "forearmstretch", "forearmbend", "armlower", "radius",
    ),
    "hand": ("hand", "wrist", "palm"),
}  # fmt: skip
"""Words for the segments of a limb, most telling first, as they read without side, number and decoration."""

_TRUNK: Mapping[str, tuple[str, ...]] = {
    "hips": ("hips", "pelvis", "hip"),
    "spine": (
        "spine", "abdomen", "lowerback", "torso", "waist", "chest", "spinelower", "abdomenlower", "back", "upperbody",
    ),
    "neck": ("neck", "lowerneck", "necklower", "necktwist", "spine4"),
    "head": ("head", "skull", "spine6"),
}  # fmt: skip

_HIPS_OF_SOME = ("root", "cog", "spine")
"""Words that mean the hips in some rigs and another place in others; where the thighs begin decides."""

_DECORATION = frozenset(
    (
        "def", "org", "mixamorig", "bip", "biped", "valve", "j", "bn", "jnt", "joint", "jt", "bone", "bind", "bnd",
        "deform", "skin", "sk", "cc", "base", "rig", "armature", "skel",
    )
)  # fmt: skip
"""Words that families put around a bone's name and that say nothing about what it is."""

_DISTRACTIONS = frozenset(
    (
        "ik", "fk", "pole", "ctrl", "control", "ctl", "controller", "cntrl", "target", "tgt", "mch", "tweak", "vis",
        "wgt", "ref", "helper", "offset", "parent", "master", "spin", "pivot", "heel", "roll", "snap", "switch",
        "socket", "end", "nub", "leaf", "effector", "locator", "track",
    )
)  # fmt: skip
"""Words of bones that steer a rig; none of them is ever part of the body."""

_SIDES = {"l": "L", "left": "L", "r": "R", "right": "R"}

_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")

_COMMON_PREFIX_SHARE = 0.6
"""A first word that so many bones share is the character's name, not a body part."""


@dataclass(frozen=True)
class _Reading:
    """A bone's name, taken apart."""

    bone: str
    side: str
    word: str
    number: int
    decoration: int
    deforms: bool
    depth: int


def map_rig(armature: bpy.types.Object) -> RigMapping:
    """Joints and feet of an armature.

    Parameters
    ----------
    armature : bpy.types.Object
        Only read; may be linked or overridden.

    Returns
    -------
    RigMapping

    Raises
    ------
    InputError
        If the object is no armature, or no feet are found by name or by rest pose.
    """
    require_armature(armature)
    bones = armature.data.bones
    mapping = _map_by_names(bones)
    if mapping is None or not mapping.joints.keys() >= _WHOLE_BODY:
        shape = map_by_rest_pose(armature)
        if shape is not None:
            joints, feet = shape
            by_shape = RigMapping(joints, tuple(SoleSource(*foot) for foot in feet), method="rest pose")
            mapping = by_shape if mapping is None else _completed(mapping, by_shape)
    if mapping is None:
        raise InputError(
            f"No feet found in armature '{armature.name}': neither by bone names nor as mirrored lowest chains of the "
            "rest pose. Choose the foot bones by hand in the character's list of soles."
        )
    return mapping


_LEG, _ARM = ("hip", "knee", "ankle", "ball", "toe"), ("shoulder", "elbow", "wrist")

_WHOLE_BODY = frozenset(("hips", "neck", "head", *(f"{joint}_{side}" for joint in (*_LEG[:3], *_ARM) for side in "lr")))
"""Joints without which the rest pose is asked."""


def _completed(named: RigMapping, shaped: RigMapping) -> RigMapping:
    """What the names say, with the limbs that they name in part read from the rest pose, where the two do not differ
    about where a limb ends."""
    joints, soles = dict(named.joints), list(named.soles)
    for side in "lr":
        leg, arm = ({joint: f"{joint}_{side}" for joint in limb} for limb in (_LEG, _ARM))
        found = shaped.joints
        ends = {found[leg[joint]] for joint in ("ankle", "ball") if leg[joint] in found}
        if not all(leg[joint] in joints for joint in _LEG[:3]) and joints.get(leg["ankle"]) in ends:
            joints = {joint: place for joint, place in joints.items() if joint not in leg.values()}
            joints |= {joint: found[joint] for joint in leg.values() if joint in found}
            for place, sole in enumerate(soles):
                if sole.side.lower() == side:
                    soles[place] = next(other for other in shaped.soles if other.name == sole.name)
        missing = [joint for joint in arm.values() if joint not in joints]
        if missing and joints.get(arm["shoulder"], found.get(arm["shoulder"])) == found.get(arm["shoulder"]):
            joints |= {joint: found[joint] for joint in missing if joint in found}
    joints |= {joint: place for joint, place in shaped.joints.items() if joint[-2] != "_" and joint not in joints}
    return RigMapping(joints, tuple(soles), named.method)


def instances_armature(thing: bpy.types.Object) -> bool:
    """Whether an object shows an armature of the collection that it instances, as linked characters are at first."""
    collection = thing.instance_collection
    return collection is not None and any(part.type == "ARMATURE" for part in collection.all_objects)


def require_armature(armature: bpy.types.Object | None) -> None:
    """Raise InputError unless the object is an armature with bones."""
    if armature is None:
        raise InputError("No armature is chosen: select the character's armature and add it again.")
    if armature.is_missing:
        raise InputError(
            f"'{armature.name}' is not in this file, and its library '{armature.library.filepath}' was not found: put "
            "the library back, or relocate it (File > External Data > Find Missing Files)."
        )
    if instances_armature(armature):
        raise InputError(
            f"The armature of '{armature.name}' is in a collection instance and cannot be read there: make it real "
            "(Object > Library Override > Make, or Object > Apply > Make Instances Real)."
        )
    if armature.type != "ARMATURE":
        raise InputError(
            f"'{armature.name}' is no armature but of type {armature.type.title()}: select the character's armature."
        )
    if not armature.data.bones:
        raise InputError(f"Armature '{armature.name}' has no bones: choose the armature that moves the character.")


def _map_by_names(bones: Iterable[bpy.types.Bone]) -> RigMapping | None:
    """The mapping that the names give, or None where they name no foot."""
    readings = _read_names(bones)
    by_name = {bone.name: bone for bone in bones}
    joints: dict[str, tuple[str, str]] = {}
    soles = []
    for side, suffix in (("L", "_l"), ("R", "_r")):
        limb = {segment: _best(readings, words, side) for segment, words in _LIMBS.items()}
        _settle_ambiguities(limb, readings, by_name, side)
        foot, toe = limb["foot"], limb["toe"]
        for joint, segment in _JOINT_HEADS.items():
            if bone := limb[segment]:
                joints[joint + suffix] = (bone, "head")
        if "wrist" + suffix not in joints and limb["forearm"]:
            joints["wrist" + suffix] = (limb["forearm"], "tail")
        if foot or toe:
            joints["toe" + suffix] = (toe or foot, "tail")
            soles.append(SoleSource(f"foot.{side}", side, foot or toe, toe if foot else ""))
    if not soles:
        return None
    joints.update(_map_trunk(readings, by_name, joints))
    return RigMapping(joints=joints, soles=tuple(soles))


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


def _settle_ambiguities(
    limb: dict[str, str], readings: list[_Reading], bones: Mapping[str, bpy.types.Bone], side: str
) -> None:
    """Words that name different bones in different families: `leg` above `knee`, `ankle` above `foot`."""
    knee, leg = (_best(readings, (word,), side) for word in ("knee", "leg"))
    if knee and leg and _is_ancestor(bones, leg, knee):
        limb["shin"] = knee
        limb["thigh"] = limb["thigh"] if limb["thigh"] and _is_ancestor(bones, limb["thigh"], leg) else leg
    ankle, foot = (_best(readings, (word,), side) for word in ("ankle", "foot"))
    if ankle and foot and _is_ancestor(bones, ankle, foot):
        limb["foot"] = ankle
        limb["toe"] = limb["toe"] if limb["toe"] and not _is_ancestor(bones, foot, limb["toe"]) else foot
    toe, foot = limb["toe"], limb["foot"]
    if toe and foot and (_is_ancestor(bones, toe, foot) or bones[foot].use_deform > bones[toe].use_deform):
        limb["toe"] = ""


def _map_trunk(
    readings: list[_Reading], bones: Mapping[str, bpy.types.Bone], limbs: Mapping[str, tuple[str, str]]
) -> dict[str, tuple[str, str]]:
    """Hips, spine, neck and head; the hips may also be where the thighs meet."""
    found = {joint: _best(readings, words, "") for joint, words in _TRUNK.items()}
    thighs = [bones[limbs[joint][0]] for joint in ("hip_l", "hip_r") if joint in limbs]
    if not found["hips"] or not bones[found["hips"]].use_deform:
        candidates = [found["hips"], *(_best(readings, (word,), "") for word in _HIPS_OF_SOME)]
        candidates.append(_common_ancestor([thigh.name for thigh in thighs], bones))
        found["hips"] = _nearest_to_thighs([bone for bone in candidates if bone], thighs, bones)
    top = found["neck"] or found["head"]
    if found["hips"] and top:
        chain = _ancestors(bones, top)
        if found["hips"] in chain:
            above = chain[: chain.index(found["hips"])]
            words = {reading.bone: reading.word for reading in readings}
            trunk = [bone for bone in above if words.get(bone) not in _TRUNK["neck"]]
            found["spine"] = trunk[-1] if trunk else ""
    if found["spine"] == found["hips"]:
        spines = sorted(
            (r.number, r.bone) for r in readings if r.word == "spine" and r.deforms and r.bone != found["hips"]
        )
        found["spine"] = spines[0][1] if spines else ""
    return {joint: (bone, "head") for joint, bone in found.items() if bone}


def _best(readings: list[_Reading], words: tuple[str, ...], side: str) -> str:
    """Name of the bone that fits best: deforming, most telling word, lowest number, least decoration; empty if none."""
    rank = {word: place for place, word in enumerate(words)}
    fits = []
    for reading in readings:
        if reading.side != side:
            continue
        numbered = f"{reading.word}{reading.number}"
        if numbered in rank:
            fits.append((not reading.deforms, rank[numbered], 0, reading.decoration, reading.depth, reading.bone))
        elif reading.word in rank and reading.number <= _HIGHEST_NUMBER:
            number = max(reading.number, 0)
            fits.append(
                (not reading.deforms, rank[reading.word], number, reading.decoration, reading.depth, reading.bone)
            )
    return min(fits)[-1] if fits else ""


def _read_names(bones: Iterable[bpy.types.Bone]) -> list[_Reading]:
    """The bones whose names can name a part of the body."""
    split = {bone.name: _split(bone.name) for bone in bones}
    first = Counter(words[0] for words in split.values() if len(words) > 1)
    shared = {word for word, count in first.items() if count > _COMMON_PREFIX_SHARE * len(split) and len(split) > 4}
    readings = []
    for bone in bones:
        words = split[bone.name]
        if words and words[0] in shared:
            words = words[1:]
        reading = _read(bone, words)
        if reading:
            readings.append(reading)
    return readings


def _split(name: str) -> list[str]:
    """Lower-case words and numbers of a name, without its namespace."""
    return [word.lower() for word in _WORDS.findall(name.rsplit(":", 1)[-1])]


def _read(bone: bpy.types.Bone, words: list[str]) -> _Reading | None:
    if not words or bone.name.startswith("c_") or _DISTRACTIONS.intersection(words):
        return None
    side, decoration = "", 0
    parts: list[str] = []
    numbers: list[int] = []
    for word in words:
        if word in _SIDES and not side:
            side = _SIDES[word]
        elif word.isdigit():
            if parts:
                numbers.append(int(word))
        elif word in _DECORATION:
            decoration += 1
        elif word not in ("c", "x", "m", "center", "centre", "mid"):
            parts.append(word)
    word = "".join(parts)
    if not side:
        side, word = _glued_side(word)
    number = int("".join(map(str, numbers))) if numbers else -1
    return _Reading(bone.name, side, word, number, decoration, bone.use_deform, len(bone.parent_recursive))


_HIGHEST_NUMBER = 9
"""Bones with larger numbers belong to series (fingers, toes, twists), not to the limb."""

_BODY_WORDS = frozenset(word for words in _LIMBS.values() for word in words)


def _glued_side(word: str) -> tuple[str, str]:
    """Side and rest of a word such as `lhand` or `leftfoot`."""
    for prefix in ("left", "right", "l", "r"):
        if word.startswith(prefix) and word[len(prefix) :] in _BODY_WORDS:
            return _SIDES[prefix], word[len(prefix) :]
        if word.endswith(prefix) and word[: -len(prefix)] in _BODY_WORDS and len(prefix) > 1:
            return _SIDES[prefix], word[: -len(prefix)]
    return "", word


def _ancestors(bones: Mapping[str, bpy.types.Bone], name: str) -> list[str]:
    """Names of a bone's parents, nearest first."""
    return [bone.name for bone in bones[name].parent_recursive]


def _is_ancestor(bones: Mapping[str, bpy.types.Bone], ancestor: str, descendant: str) -> bool:
    return ancestor in _ancestors(bones, descendant)


def _common_ancestor(names: list[str], bones: Mapping[str, bpy.types.Bone]) -> str:
    """Nearest bone that all of the given ones hang from; empty if there is none."""
    if not names:
        return ""
    chains = [_ancestors(bones, name) for name in names]
    return next((bone for bone in chains[0] if all(bone in chain for chain in chains)), "")


def _nearest_to_thighs(candidates: list[str], thighs: list[bpy.types.Bone], bones: Mapping[str, bpy.types.Bone]) -> str:
    """The bone that starts nearest to the middle between the thighs, deforming ones first; empty without candidates."""
    if not thighs or not candidates:
        return candidates[0] if candidates else ""
    middle = sum((thigh.head_local for thigh in thighs), start=Vector()) / len(thighs)
    return min(candidates, key=lambda name: (not bones[name].use_deform, (bones[name].head_local - middle).length))
