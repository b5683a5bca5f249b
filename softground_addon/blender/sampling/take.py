"""A take: frames of a scene that are read, and what they are read in."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

from ...core.findings import Finding
from ...core.rig.recording import SceneUnits
from ...core.settings import ObjectName
from ..animation_layer.constraint_layer import LayerKind
from ..placement import units_about
from ..settings import name_of, scene_named
from .skin_sampling import Weights


@dataclass(frozen=True)
class Take:
    """Frames of the user's scene of a name, which is only read.

    They are read in units that may have the frame of a ground, and without the add-on's layers from `below` on. The
    findings take what the user should know of how that went, the weights those of meshes that several objects have.
    """

    name: ObjectName
    frames: range
    units: SceneUnits
    below: LayerKind = LayerKind.RESPONSE
    findings: list[Finding] = field(default_factory=list)
    weights: dict[str, Weights] = field(default_factory=dict)

    @classmethod
    def about(cls, obj: bpy.types.Object, scene: bpy.types.Scene, frames: range) -> Take:
        """Take of an object that is read for itself, with the units of its scene as they are now."""
        return cls(name_of(scene), frames, units_about(scene, obj))

    @property
    def scene(self) -> bpy.types.Scene:
        """The scene as it is now: an undo may replace it between two steps."""
        return scene_named(self.name)
