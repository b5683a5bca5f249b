"""Roles of the parts of a rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

BoneEnd = tuple[str, str]
"""A bone's name, and "head" or "tail"."""


@dataclass(frozen=True)
class SoleSource:
    """Sources of one sole.

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
        True if the bone prints by whatever side of it faces down, as a hand, a knee or a back, and not by a sole.
    parts : tuple of str
        The bones whose skin it is, where the skin has shown them; empty for the bone, its toes and what hangs on them.
    """

    name: str
    side: str = ""
    bone: str = ""
    toe_bone: str = ""
    object: str = ""
    limb: bool = False
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class RigMapping:
    """Roles of the parts of a rig.

    Attributes
    ----------
    joints : mapping of str to BoneEnd
        Canonical joint (`core.motion.motion.JOINTS`) to the end of a bone.
    soles : tuple of SoleSource
        Sources of prints, feet first.
    method : str
        Their source: "names", "rest pose" or "settings".
    mass : float
        Suggested by its skin [kg], 0 where none does.
    """

    joints: Mapping[str, BoneEnd] = field(default_factory=dict)
    soles: tuple[SoleSource, ...] = ()
    method: str = "names"
    mass: float = 0.0

    @property
    def legs(self) -> int:
        """Number of contacts of legs: no objects, and no limbs on bones that have a joint, such as hands and knees."""
        jointed = {bone for bone, _ in self.joints.values()}
        return sum(not (sole.object or (sole.limb and sole.bone in jointed)) for sole in self.soles)


def bones_of(mapping: RigMapping) -> list[str]:
    """The bones of a mapping's soles and joints."""
    return [*(bone for sole in mapping.soles for bone in _bones(sole)), *(bone for bone, _ in mapping.joints.values())]


def _bones(source: SoleSource) -> list[str]:
    return [bone for bone in (source.bone, source.toe_bone) if bone]
