"""The frame that a bake is solved in, where it is not the world's: on ground far from the origin, and where gravity
points elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import bpy
import numpy as np

from ...core.settings import BakeSettings
from .. import settings
from ..placement import felt_gravity, still_frame, world_matrix
from ..sampling.sampling_scene import object_named

MESH = 100.0
"""Where there is no ground, its frame lies on a grid of this width, wherever in it the character is [m]."""


def framed(wanted: BakeSettings) -> BakeSettings:
    """The settings, with the frame that the scene is to be read and solved in."""
    ground, bodies = np.eye(4), list(_bodies(wanted))
    if wanted.ground:
        ground = world_matrix(settings.found(wanted.ground))
    elif bodies:
        place = world_matrix(bodies[0])[:3, 3] * wanted.unit_scale_m
        ground[:3, 3] = np.round(place / MESH) * MESH / wanted.unit_scale_m
    frame = still_frame(ground, wanted, felt_gravity(wanted.gravity_direction, bodies))
    if frame is None:
        return wanted
    in_metres = np.array(frame.matrix)
    in_metres[:3, 3] *= wanted.unit_scale_m
    return replace(wanted, frame=frame, camera=wanted.camera and wanted.camera.moved(in_metres))


def _bodies(wanted: BakeSettings) -> Iterator[bpy.types.Object]:
    for character in wanted.characters:
        if owner := character.armature or character.body:
            yield settings.found(owner)
        yield from (object_named(sole.object) for sole in character.soles if sole.object)
