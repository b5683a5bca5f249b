"""Meaning of the names of bones: the side, the part of the body, the number in a series.

Names are compared whole, without the side and a family's prefixes and suffixes, so that a control, pole or
twist bone (`foot_ik.L`, `c_foot_roll.l`, `thigh_twist_01_l`) is never taken for the limb. Where several bones carry one
name (Rigify's DEF-, ORG- and control layers), the one that deforms the mesh wins.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass

from .bones import RigBones, above

LIMBS: Mapping[str, tuple[str, ...]] = {
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

TRUNK: Mapping[str, tuple[str, ...]] = {
    "hips": ("hips", "pelvis", "hip"),
    "spine": (
        "spine", "abdomen", "lowerback", "torso", "waist", "chest", "spinelower", "abdomenlower", "back", "upperbody",
    ),
    "neck": ("neck", "lowerneck", "necklower", "necktwist", "spine4"),
    "head": ("head", "skull", "spine6"),
}  # fmt: skip

_DECORATION = frozenset(
    (
        "def", "org", "mixamorig", "bip", "biped", "valve", "j", "bn", "jnt", "joint", "jt", "bone", "bind", "bnd",
        "deform", "skin", "sk", "cc", "base", "rig", "armature", "skel",
    )
)  # fmt: skip
"""Prefixes and suffixes of families that say nothing about a bone's role."""

_DISTRACTIONS = frozenset(
    (
        "ik", "fk", "pole", "ctrl", "control", "ctl", "controller", "cntrl", "target", "tgt", "mch", "tweak", "vis",
        "wgt", "ref", "helper", "offset", "parent", "master", "spin", "pivot", "heel", "roll", "snap", "switch",
        "socket", "end", "nub", "leaf", "effector", "locator", "track",
    )
)  # fmt: skip
"""Words of bones that steer a rig; none of them is ever part of the body."""

_MIDDLE = ("c", "x", "m", "center", "centre", "mid")
"""Sides of bones in the middle of the body, as families name them."""

_SIDES = {"l": "L", "left": "L", "r": "R", "right": "R"}

_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")

_COMMON_PREFIX_SHARE = 0.6
"""A first word that so many bones share is the character's name, not a body part."""

_HIGHEST_NUMBER = 9
"""Bones with larger numbers belong to series (fingers, toes, twists), not to the limb."""

_BODY_WORDS = frozenset(word for words in LIMBS.values() for word in words)


@dataclass(frozen=True)
class BoneName:
    """A bone's name, taken apart.

    Attributes
    ----------
    bone : str
        The whole name.
    side : str
        "L", "R" or "".
    word : str
        Part of the body, in lower case: the name without side, number and decoration.
    number : int
        -1 where there is none.
    decoration : int
        Number of the family's words around it.
    deforms : bool
        True if the bone moves the mesh.
    depth : int
        Number of its ancestors.
    """

    bone: str
    side: str
    word: str
    number: int
    decoration: int
    deforms: bool
    depth: int


def read_names(bones: RigBones, deforming: Set[str]) -> list[BoneName]:
    """The names that can name a part of the body; those of controls and helpers are left out.

    Parameters
    ----------
    deforming : set of str
        Names of those that move a mesh.
    """
    split = {name: _split(name) for name in bones}
    first = Counter(words[0] for words in split.values() if len(words) > 1)
    shared = {word for word, count in first.items() if count > _COMMON_PREFIX_SHARE * len(split) and len(split) > 4}
    names = []
    for bone, words in split.items():
        significant = words[1:] if words and words[0] in shared else words
        name = _read(bone, significant, deforms=bone in deforming, depth=len([*above(bones, bone)]))
        if name:
            names.append(name)
    return names


def best(names: Iterable[BoneName], words: Sequence[str], side: str) -> str:
    """The bone that fits best: deforming, most telling word, lowest number, least decoration; empty if there is none.

    Parameters
    ----------
    names : iterable of BoneName
        From `read_names`.
    words : sequence of str
        Possible names, the most telling first.
    side : str
        "L", "R" or "".
    """
    rank = {word: place for place, word in enumerate(words)}
    fits = []
    for name in names:
        numbered = f"{name.word}{name.number}"  # some words have a number of their own, such as `spine4`
        if name.side != side:
            continue
        if numbered in rank:
            place, number = rank[numbered], 0
        elif name.word in rank and name.number <= _HIGHEST_NUMBER:
            place, number = rank[name.word], max(name.number, 0)
        else:
            continue
        fits.append((not name.deforms, place, number, name.decoration, name.depth, name.bone))
    return min(fits)[-1] if fits else ""


def _split(name: str) -> list[str]:
    """Lower-case words and numbers of a name, without its namespace."""
    return [word.lower() for word in _WORDS.findall(name.rsplit(":", 1)[-1])]


def _read(bone: str, words: list[str], *, deforms: bool, depth: int) -> BoneName | None:
    if not words or bone.startswith("c_") or _DISTRACTIONS.intersection(words):
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
        elif word not in _MIDDLE:
            parts.append(word)
    word = "".join(parts)
    if not side:
        side, word = _glued_side(word)
    number = int("".join(map(str, numbers))) if numbers else -1
    return BoneName(bone, side, word, number, decoration, deforms, depth)


def _glued_side(word: str) -> tuple[str, str]:
    """Side and rest of a word such as `lhand` or `leftfoot`."""
    for prefix in ("left", "right", "l", "r"):
        if word.startswith(prefix) and word[len(prefix) :] in _BODY_WORDS:
            return _SIDES[prefix], word[len(prefix) :]
        if word.endswith(prefix) and word[: -len(prefix)] in _BODY_WORDS and len(prefix) > 1:
            return _SIDES[prefix], word[: -len(prefix)]
    return "", word
