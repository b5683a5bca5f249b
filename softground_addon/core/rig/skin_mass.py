"""How heavy a character is by the volume of its skin, without capes and what it carries."""

from __future__ import annotations

from math import floor, log10

import numpy as np

from ..numerics.slices import Slices, sliced
from ..skin.volume import body_volume, welded
from .bones import RigBones
from .recording import Recording
from .rig_skin import RigSkin, carried, skinned

DENSITY = 1000.0
"""Of bodies [kg/m³]: people float, barely."""


@sliced
def skin_mass(skin: RigSkin, bones: RigBones, pose: Recording) -> Slices[float]:
    """Mass of a body of the volume of its skin [kg], to two digits, 0 where the skin encloses nothing.

    Parameters
    ----------
    skin : RigSkin
    bones : RigBones
    pose : Recording
        Of all `skin.bones`, at one frame.
    """
    body = ~carried(skin, bones)[skin.triangles].any(axis=1)
    points = (yield from skinned.slices(skin, bones, pose, np.arange(len(skin.vertices))))[0].astype(float)
    place = welded(skin.vertices)
    yield
    if not np.isfinite(points).all():
        return 0.0
    _, first = np.unique(place, return_index=True)
    mass = DENSITY * (yield from body_volume.slices(points[first], place[skin.triangles[body]]))
    return round(mass, 1 - floor(log10(mass))) if mass > 0 else 0.0
