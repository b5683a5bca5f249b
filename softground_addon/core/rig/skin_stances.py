"""Times at which the skin of a character's contacts bears, and the attitude of its feet then."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import LowSkin
from ..numerics.slices import Slices
from ..skin.contacts import find_contacts
from .bones import RigBones
from .mapping import RigMapping, SoleSource
from .recording import Recording
from .rig_skin import FollowedSkin, RigSkin, followed_skin, skinned
from .sole_extraction import FootMesh, bone_families, limb_family

UNDERSIDE = 0.02
"""Skin this near to the ground is the underside of a contact that stands, in body heights."""

SOLE_BAND = 0.06
"""Faces that reach down to this over the ground are looked at for the sole, in body heights."""


@dataclass(frozen=True)
class SkinStances:
    """Contacts of a character as its skin shows them.

    Attributes
    ----------
    level : float
        Height of the ground [m].
    bears : mapping of str to (F,) bool array
        True while each contact bears, by name of the sole.
    standing : mapping of str to int
        The sample at which most of a foot's underside is on the ground.
    meshes : mapping of str to FootMesh
        The foot's skin as it is then.
    low : mapping of str to (F,) float array
        Height of the lowest skin of each limb [m].
    skin : LowSkin
        Its lowest places.
    """

    level: float
    bears: Mapping[str, NDArray[np.bool_]]
    standing: Mapping[str, int]
    meshes: Mapping[str, FootMesh]
    low: Mapping[str, NDArray[np.float64]]
    skin: LowSkin


def skin_stances(
    skin: RigSkin,
    bones: RigBones,
    mapping: RigMapping,
    recording: Recording,
    rate: float,
    *,
    mass: float,
) -> Slices[SkinStances | None]:
    """Bearing of a character's contacts and attitude of its feet, or None where their skin never comes down.

    Parameters
    ----------
    mapping : RigMapping
        Only its soles on bones count.
    recording : Recording
        Of all `skin.bones` and those of the soles.
    rate : float
        Samples per second [Hz].
    mass : float
        Suggested by its volume [kg], 0 where unknown.
    """
    followed = yield from followed_skin.slices(skin, bones, recording, rate)
    if followed is None:
        return None
    yield
    sources = [source for source in mapping.soles if source.bone and not source.object]
    bones_of_sole = {source.name: _bones_of(bones, source, mapping) for source in sources}
    numbers: dict[str, int] = {}
    for number, source in enumerate(sources):
        numbers = dict.fromkeys(bones_of_sole[source.name], number) | numbers
    group = np.array([numbers.get(bone, -1) for bone in followed.bones])
    present = np.unique(group[group >= 0])
    if not len(present):
        return None
    place = np.full(len(sources) + 1, -1)
    place[present] = np.arange(len(present))
    contacts = yield from find_contacts.slices(followed.motion, place[group])
    yield
    never = np.zeros(len(recording.frames), dtype=bool)
    bears = {source.name: never for source in sources}
    bears |= {sources[number].name: contacts.bears[:, contact] for contact, number in enumerate(present)}
    floor = {sources[number].name: contacts.floor[:, contact] for contact, number in enumerate(present)}
    feet = [source for source in sources if not source.limb and bears[source.name].any()]
    standing = {
        source.name: _standing(followed, group == sources.index(source), bears[source.name], floor[source.name])
        for source in feet
    }
    meshes = {}
    for source in feet:
        at = standing[source.name]
        band = floor[source.name][at] + SOLE_BAND * followed.motion.height
        mesh = _mesh(skin, bones, source, bones_of_sole[source.name], recording.of(np.array([at])), band)
        if mesh is not None:
            meshes[source.name] = mesh
    height, tracks = followed.motion.height, contacts.tracks
    low = {
        source.name: tracks.low[:, group == number].min(axis=1) * height
        for number, source in enumerate(sources)
        if source.limb and number in present
    }
    lowest = np.concatenate([tracks.place, tracks.low[..., None]], axis=-1) * height
    rise, calm, on_the_spot = tracks.rise * height, tracks.calm * height, bool(contacts.drift.any())
    of_part = tuple(sources[number].name if number >= 0 else "" for number in group)
    lowest_skin = LowSkin(recording.frames, lowest, rise, calm, height, mass, on_the_spot, followed.bones, of_part)
    return SkinStances(contacts.level, bears, {name: standing[name] for name in meshes}, meshes, low, lowest_skin)


def _bones_of(bones: RigBones, source: SoleSource, mapping: RigMapping) -> frozenset[str]:
    """The bones whose skin is a contact's."""
    if source.parts:
        return frozenset(source.parts)
    return limb_family(bones, source, mapping) if source.limb else bone_families(bones, source)[0]


def _standing(
    followed: FollowedSkin, parts: NDArray[np.bool_], bears: NDArray[np.bool_], floor: NDArray[np.float64]
) -> int:
    """The sample at which most of some parts' points are nearest to the ground while they bear: a foot that leans on an
    edge has more of them about as low, and none flat on it."""
    height = followed.motion.positions[:, parts[followed.motion.part], 2] - floor[:, None]
    near = np.clip(1.0 - np.abs(height) / (UNDERSIDE * followed.motion.height), 0.0, None).sum(axis=1)
    return int(np.where(bears, near, -1).argmax())


def _mesh(
    skin: RigSkin,
    bones: RigBones,
    source: SoleSource,
    names: frozenset[str],
    standing: Recording,
    highest: float,
) -> FootMesh | None:
    """The skin of a foot as it stands, where its faces reach down to a height; None without any face."""
    _, toes = bone_families(bones, source)
    of_foot = np.array([name in names for name in skin.bones] + [False])[skin.part]
    candidates = np.flatnonzero(of_foot[skin.triangles].all(axis=1))
    used, triangles = np.unique(skin.triangles[candidates], return_inverse=True)
    if not len(used):
        return None
    vertices = skinned(skin, bones, standing, used)[0].astype(float)
    triangles = triangles.reshape(-1, 3)
    low = vertices[triangles, 2].min(axis=1) < highest
    if not low.any():
        return None
    return FootMesh(vertices, np.clip(skin.weight_of(toes)[used], 0.0, 1.0), triangles[low])
