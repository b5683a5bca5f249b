"""What the parts of a rig are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..settings import SoleSource

BoneEnd = tuple[str, str]
"""A bone's name, and "head" or "tail"."""


@dataclass(frozen=True)
class RigMapping:
    """What the parts of a rig are.

    Attributes
    ----------
    joints : mapping of str to BoneEnd
        Canonical joint (`core.motion.motion.JOINTS`) to the end of a bone.
    soles : tuple of SoleSource
        What prints, feet first.
    method : str
        How they were found: by "names" or "rest pose", or as the "settings" have them.
    mass : float
        That its skin suggests [kg], 0 where none does.
    """

    joints: Mapping[str, BoneEnd] = field(default_factory=dict)
    soles: tuple[SoleSource, ...] = ()
    method: str = "names"
    mass: float = 0.0


def bones_of(mapping: RigMapping) -> list[str]:
    """The bones of a mapping's soles and joints."""
    return [*(bone for sole in mapping.soles for bone in _bones(sole)), *(bone for bone, _ in mapping.joints.values())]


def _bones(source: SoleSource) -> list[str]:
    return [bone for bone in (source.bone, source.toe_bone) if bone]
