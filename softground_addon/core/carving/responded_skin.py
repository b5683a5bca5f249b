"""The skin of a character as the response moves it, in the parts that go with each of its soles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Terrain
from ..legs.grounding import Response, leg_soles
from ..motion.motion import CharacterMotion
from ..numerics.arrays import Array, Indices, Mask
from ..rig.bones import RigBones, above, family
from ..rig.mapping import RigMapping
from ..rig.recording import Recording
from ..rig.rig_skin import RigSkin, of_body, skinned

NO_SOLE = -1
"""In place of the sole of skin that belongs to several, as a trunk does, or to none."""


@dataclass(frozen=True)
class WornSkin:
    """The skin of a rig as it was recorded.

    Attributes
    ----------
    character : str
        Its name.
    recording : Recording
        Of all `skin.bones`.
    """

    character: str
    skin: RigSkin
    bones: RigBones
    mapping: RigMapping
    recording: Recording


@dataclass(frozen=True)
class _Responding(Recording):
    """A recording whose bones are displaced in the world: `parts` (F, 4, 4) by name, all others as the `body`."""

    parts: Mapping[str, Array] = field(default_factory=dict)
    body: Array = field(default_factory=lambda: np.eye(4)[None])

    @property
    def armature(self) -> Array:
        """World matrices of the armature, (F, 4, 4) [m]."""
        return np.asarray(self.body @ super().armature)

    def bone(self, name: str) -> Array:
        """World matrices of a bone, (F, 4, 4) [m]."""
        return np.asarray(self.parts.get(name, self.body) @ super().bone(name))

    def of(self, samples: NDArray[np.intp]) -> _Responding:
        """Some of the samples."""
        parts = {name: part[samples] for name, part in self.parts.items()}
        return replace(cast("_Responding", super().of(samples)), parts=parts, body=self.body[samples])


class RespondedSkin:
    """The skin of a character that responds.

    Parameters
    ----------
    motion : CharacterMotion
        At the frames of its recording.

    Attributes
    ----------
    frames : (F,) float array
        Scene frames.
    frame_rate : float
        Frames per second [Hz].
    jumps : tuple of int
        Samples at which the body is elsewhere than before, as at a cut.
    triangles : mapping of int to (T, 3) int array
        By the number of the sole that they go with, or `NO_SOLE`, as of what is carried or dragged.
    """

    def __init__(self, worn: WornSkin, motion: CharacterMotion, response: Response) -> None:
        self._worn = worn
        self.frames, self.frame_rate = motion.frames, motion.frame_rate
        self.jumps = tuple(motion.starts[1:].tolist())
        recorded = vars(worn.recording)
        self._recording = _Responding(**recorded, parts=_parts_of_bones(worn, motion, response), body=response.body)
        triangles = worn.skin.triangles
        sole = np.append(_soles_of_bones(worn), NO_SOLE)[worn.skin.part[triangles[:, 0]]]
        sole[~of_body(worn.skin, worn.bones, worn.recording)[triangles].all(axis=1)] = NO_SOLE
        self.triangles = {int(number): triangles[sole == number] for number in np.unique(sole)}

    def at(self, samples: Indices, vertices: Indices | None = None) -> Array:
        """World positions of vertices (V,), or all of them, at some samples (K,), (K, V, 3) [m]."""
        chosen = np.arange(len(self._worn.skin.vertices)) if vertices is None else vertices
        recording = self._recording.of(samples)
        return skinned(self._worn.skin, self._worn.bones, recording, chosen).astype(float)

    @property
    def bones(self) -> Indices:
        """The bone that moves each vertex most, (V,)."""
        return self._worn.skin.part

    def near(self, terrain: Terrain, distance: float) -> Mask:
        """Vertices (V,) of bones that come within a distance of a terrain [m], and of shapes or no bones.

        The terrain is looked up at the corners and the middle of a box around each bone's vertices.
        """
        skin, bones = self._worn.skin, self._worn.bones
        near = np.ones(len(skin.vertices), dtype=bool)
        for vertices, _ in skin.weights:
            near[vertices] = False
        for name, (vertices, _) in zip(skin.bones, skin.weights, strict=True):
            rest = skin.vertices[vertices]
            if not len(rest):
                continue
            box = np.stack(np.meshgrid(*zip(rest.min(axis=0), rest.max(axis=0), strict=True), 1.0)).reshape(4, -1)
            box = np.column_stack([box, box.mean(axis=1)])
            x, y, z, _ = (self._recording.bone(name) @ np.linalg.inv(bones[name].matrix) @ box).swapaxes(0, 1)
            if not (z.min(axis=-1) >= terrain.heights(x, y).max(axis=-1) + distance).all():
                near[vertices] = True
        for shape in skin.shapes:
            near[shape.vertices] = True
        return near


def thinned(points: Array, parts: Mapping[int, Indices], bones: Indices, size: float) -> dict[int, Indices]:
    """Triangles (T, 3) of parts between fewer vertices: of each bone, the outermost in a cube of a size.

    Those that are left between fewer than three vertices are gone. No vertex is moved by more than the cube's diagonal.

    Parameters
    ----------
    points : (V, 3) float array
        In one pose [m].
    bones : (V,) int array
        The bone that each vertex goes with.
    """
    cubes = np.floor(points / size).astype(np.int64)
    cubes -= cubes.min(axis=0)
    cube = np.ravel_multi_index((bones, *cubes.T), (int(bones.max()) + 1, *(cubes.max(axis=0) + 1).tolist()))
    sums = np.stack([np.bincount(bones, along) for along in points.T], axis=-1)
    middle = sums / np.maximum(np.bincount(bones), 1)[:, None]
    order = np.lexsort((-((points - middle[bones]) ** 2).sum(axis=1), cube))
    first = np.append(True, np.diff(cube[order]) > 0)
    stands_for = np.empty(len(points), dtype=np.intp)
    stands_for[order] = order[first][np.cumsum(first) - 1]
    corners = {number: stands_for[triangles] for number, triangles in parts.items()}
    return {number: part[(part != part[:, [1, 2, 0]]).all(axis=1)] for number, part in corners.items()}


def _parts_of_bones(worn: WornSkin, motion: CharacterMotion, response: Response) -> dict[str, Array]:
    """Displacement of the skin's bones that do not go with the body, (F, 4, 4) each."""
    moved: dict[str, Array] = {}
    joints, sources = worn.mapping.joints, {source.name: source for source in worn.mapping.soles}
    soles = leg_soles(motion)
    for side, leg in response.legs.items():
        of_joints = (("hip", leg.thigh), ("knee", leg.shank), ("ankle", leg.foot), ("ball", leg.foot))
        moved |= {joints[f"{joint}_{side}"][0]: part for joint, part in of_joints if f"{joint}_{side}" in joints}
        source = sources[motion.soles[soles[side]].sole.name]
        moved |= dict.fromkeys((bone for bone in (source.bone, source.toe_bone) if bone), leg.foot)
    for side, arm in response.arms.items():
        moved[joints[f"shoulder_{side}"][0]] = response.body @ arm
    names = worn.skin.bones
    nearest = {name: next((b for b in (name, *above(worn.bones, name)) if b in moved), "") for name in names}
    return {name: moved[bone] for name, bone in nearest.items() if bone}


def _soles_of_bones(worn: WornSkin) -> Indices:
    """Number of the sole that each bone of the skin goes with, (B,)."""
    owners: dict[str, set[int]] = {}
    for number, source in enumerate(worn.mapping.soles):
        for bone in (source.bone, source.toe_bone):
            if bone:
                for name in {*family(worn.bones, bone), *above(worn.bones, bone)}:
                    owners.setdefault(name, set()).add(number)
    soles = []
    for name in worn.skin.bones:
        owned = next((owners[bone] for bone in (name, *above(worn.bones, name)) if bone in owners), set[int]())
        soles.append(next(iter(owned)) if len(owned) == 1 else NO_SOLE)
    return np.array(soles, dtype=np.intp)
