"""Mass of a character by the volume of its skin, without capes and props, and where that volume is."""

from __future__ import annotations

from math import floor, log10

import numpy as np

from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from ..skin.volume import body_volume, welded
from .bones import RigBones
from .recording import Recording
from .rig_skin import RigSkin, of_body, skinned

DENSITY = 1000.0
"""Density of bodies [kg/m³]: people float, barely."""


@sliced
def skin_mass(skin: RigSkin, bones: RigBones, recording: Recording) -> Slices[float]:
    """Mass of a body of the volume of its skin [kg], to two digits, 0 where the skin encloses nothing.

    Parameters
    ----------
    recording : Recording
        Of all `skin.bones`; its first pose is looked at.
    """
    body = of_body(skin, bones, recording)[skin.triangles].all(axis=1)
    pose = recording.of(np.array([0]))
    points = (yield from skinned.slices(skin, bones, pose, np.arange(len(skin.vertices))))[0].astype(float)
    place = welded(skin.vertices)
    yield
    if not np.isfinite(points).all():
        return 0.0
    _, first = np.unique(place, return_index=True)
    mass = DENSITY * (yield from body_volume.slices(points[first], place[skin.triangles[body]]))
    return round(mass, 1 - floor(log10(mass))) if mass > 0 else 0.0


def centre_of_volume(skin: RigSkin, bones: RigBones, recording: Recording) -> Array:
    """Centre of a body's volume over time, (F, 3) [m].

    The skin of each bone encloses cones around its middle: what is missing where it goes on under the next bone is
    small, and as much is missing on the other side.

    Parameters
    ----------
    recording : Recording
        Of all `skin.bones`.
    """
    body = skin.triangles[of_body(skin, bones, recording)[skin.triangles].all(axis=1)]
    part, count = skin.part[body[:, 0]], len(skin.bones) + 1
    corners = skin.vertices[body]

    def sums(values: Array) -> Array:
        return np.stack([np.bincount(part, along, count) for along in values.T], axis=-1)

    size = np.bincount(part, minlength=count)
    apex = sums(corners.mean(axis=1)) / np.maximum(size, 1)[:, None]
    arms = corners - apex[part][:, None]
    cone = np.einsum("ti,ti->t", arms[:, 0], np.cross(arms[:, 1], arms[:, 2])) / 6
    volume = np.bincount(part, cone, count)
    # The middle of a cone is a quarter of the way from the middle of its base to its apex.
    middle = apex + 0.75 * sums(cone[:, None] * arms.mean(axis=1)) / np.where(volume > 0, volume, 1.0)[:, None]
    share = np.maximum(volume, 0.0)
    if not share.any():
        share = size.astype(float)
    path = np.zeros((len(recording.frames), 3))
    for number in np.flatnonzero(share):
        place = np.append(middle[number], 1.0)
        matrices = recording.armature
        if number < len(skin.bones):
            matrices = recording.bone(skin.bones[number]) @ np.linalg.inv(bones[skin.bones[number]].matrix)
        path += share[number] / share.sum() * (matrices[:, :3] @ place)
    return path
