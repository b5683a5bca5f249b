"""The whole-body centre of mass from the joints that are mapped.

Mass fractions and segment centres are those of de Leva (1996), "Adjustments to Zatsiorsky-Seluyanov's segment inertia
parameters", J. Biomechanics 29(9), table 4, male.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .motion import CharacterMotion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodySegment:
    """A part of the body, its share of the mass, and its centre on the line through two joints.

    Attributes
    ----------
    mass_fraction : float
    proximal, distal : str
        Joints; `distal` may name the joint beyond which the segment lies (the hand lies beyond the wrist).
    centre : float
        Place of the centre of mass from proximal (0) to distal (1).
    """

    mass_fraction: float
    proximal: str
    distal: str
    centre: float


_HEAD_CENTRE = 0.20
"""Head and neck: centre above the neck joint in trunk lengths (de Leva: 0.5·243 mm of 603 mm). Where rigs put their
head joint varies too much to measure along it."""

_LIMBS = (
    BodySegment(0.0271, "shoulder", "elbow", 0.5772),
    BodySegment(0.0162, "elbow", "wrist", 0.4574),
    BodySegment(0.0061, "elbow", "wrist", 1.25),  # the hand: 0.79·86 mm beyond the wrist of a 269 mm forearm
    BodySegment(0.1416, "hip", "knee", 0.4095),
    BodySegment(0.0433, "knee", "ankle", 0.4395),
    BodySegment(0.0137, "ankle", "ball", 0.35),  # 44 % from heel to toe tip, seen from the ankle
)
_TRUNK = BodySegment(0.4346, "neck", "hips", 0.5138)
_HEAD_FRACTION = 0.0694

SEGMENTS = (
    _TRUNK,
    *(
        BodySegment(limb.mass_fraction, f"{limb.proximal}_{side}", f"{limb.distal}_{side}", limb.centre)
        for side in "lr"
        for limb in _LIMBS
    ),
)

_STAND_IN = {"neck": "spine", "spine": "hips", "head": "neck"} | {
    f"{joint}_{side}": parent if parent in ("neck", "hips") else f"{parent}_{side}"
    for side in "lr"
    for joint, parent in (
        ("shoulder", "neck"),
        ("elbow", "shoulder"),
        ("wrist", "elbow"),
        ("hip", "hips"),
        ("knee", "hip"),
        ("ankle", "knee"),
        ("ball", "ankle"),
    )
}
"""The joint that carries the mass of one that is not mapped: the next toward the hips."""


def centre_of_mass(motion: CharacterMotion) -> Array:
    """Path of the centre of mass, (N, 3) [m].

    A joint that is not mapped is replaced by the next mapped one toward the hips, so that with only the hips mapped
    the whole mass moves with them (the paper's choice). Without any joint, the mean of the soles stands in.
    """
    joints = _complete(motion)
    trunk_length = np.median(np.linalg.norm(joints["neck"] - joints["hips"], axis=-1))
    upward = joints["head"] - joints["neck"]
    length = np.linalg.norm(upward, axis=-1, keepdims=True)
    head = joints["neck"] + _HEAD_CENTRE * trunk_length * np.divide(
        upward, length, out=np.zeros_like(upward), where=length > 0
    )
    weighted = _HEAD_FRACTION * head
    for segment in SEGMENTS:
        proximal, distal = joints[segment.proximal], joints[segment.distal]
        weighted = weighted + segment.mass_fraction * (proximal + segment.centre * (distal - proximal))
    total_fraction = _HEAD_FRACTION + sum(segment.mass_fraction for segment in SEGMENTS)
    return weighted / total_fraction


def _complete(motion: CharacterMotion) -> dict[str, Array]:
    """The joints of the motion with stand-ins for those that are not mapped."""
    joints = dict(motion.joints)
    if "hips" not in joints:
        joints["hips"] = _hips(motion)
    for name in ("spine", "neck", "head"):
        joints.setdefault(name, joints[_STAND_IN[name]])
    for side in "lr":
        for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ball"):
            joints.setdefault(f"{name}_{side}", joints[_STAND_IN[f"{name}_{side}"]])
    return joints


def _hips(motion: CharacterMotion) -> Array:
    """The best stand-in for unmapped hips."""
    joints = motion.joints
    if {"hip_l", "hip_r"} <= joints.keys():
        return (joints["hip_l"] + joints["hip_r"]) / 2
    for name in ("spine", "neck"):
        if name in joints:
            return joints[name]
    if joints:
        return np.mean(list(joints.values()), axis=0)
    return np.mean([sole.landmark_positions().mean(axis=1) for sole in motion.soles], axis=0)
