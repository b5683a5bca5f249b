"""Poses of the bones of a rig over time, as they were read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..motion.ground_frame import GroundFrame
from ..numerics.arrays import Array
from ..numerics.rigid import displacement, rotation

_STILL = 1e-4
"""Poses that differ by less are one, over their largest entry."""


_ALIKE = 2.0**-20
"""Turns and places that differ by less may be one, over the armature's scale: Blender's own rounding."""


@dataclass(frozen=True)
class SceneUnits:
    """Frames and lengths of a scene.

    Attributes
    ----------
    frame_rate : float
        Scene frames per second [Hz].
    time_stretch : float
        Frames of the animation per frame of the scene.
    frame : GroundFrame or None
        In which a bake is read and solved; None where that is the world's.
    """

    frame_rate: float
    time_stretch: float
    gravity_m_s2: float
    unit_scale_m: float
    frame: GroundFrame | None = field(default=None, kw_only=True, metadata={"said_if_on": True, "acts": 5})

    @property
    def units(self) -> SceneUnits:
        """These alone, without the settings that they are part of."""
        return SceneUnits(self.frame_rate, self.time_stretch, self.gravity_m_s2, self.unit_scale_m, frame=self.frame)


@dataclass(frozen=True)
class Timeline:
    """First and last frame of a scene, frames per second [Hz], and frames of the animation per frame of the scene.

    The last is 1 unless time is remapped: keys, strips, nodes and caches count the animation's frames; the timeline,
    and with it a bake, the scene's.
    """

    start: int
    end: int
    frame_rate: float
    stretch: float


@dataclass(frozen=True)
class Recording:
    """Poses of bones and objects over time, as evaluated; a bone's y axis points from head to tail.

    Attributes
    ----------
    frames : (F,) float array
    bones : tuple of str
        Names.
    poses : (F, bones, 4, 4) float32 array
        Transposed matrices of the bones in the armature's space, as Blender gives them [Blender units].
    world : (F, 4, 4) float array
        Of the armature, to the frame that it is solved in [Blender units].
    props : mapping of str to (F, 4, 4) float array
        Matrices of the objects to that frame, by their names [m].
    units : SceneUnits
        What frames and Blender units come to.
    shapes : mapping of (object, shape key) to (F,) float array
        Values of shape keys.
    animated : (float, float) or None
        Scene frames of the first key and the last, where there are keys.
    """

    frames: Array
    bones: tuple[str, ...]
    poses: NDArray[np.float32]
    world: Array
    props: Mapping[str, Array]
    units: SceneUnits
    shapes: Mapping[tuple[str, str], Array] = field(default_factory=dict)
    animated: tuple[float, float] | None = None

    @property
    def armature(self) -> Array:
        """World matrices of the armature, (F, 4, 4) [m]."""
        return self._in_metres(self.world.copy())

    @property
    def bones_move(self) -> bool:
        """True if some bone moves in the armature."""
        return bool(np.ptp(self.poses, axis=0).max(initial=0.0) > _STILL * np.abs(self.poses).max(initial=0.0))

    def bone(self, name: str) -> Array:
        """World matrices of a bone, (F, 4, 4) [m]; computed at each call, as all bones at once take much memory."""
        pose = self.poses[:, self.bones.index(name)].astype(float)
        return self._in_metres(self.world @ np.swapaxes(pose, -1, -2))

    def of(self, samples: NDArray[np.intp]) -> Recording:
        """Some of the samples."""
        return replace(
            self,
            frames=self.frames[samples],
            poses=self.poses[samples],
            world=self.world[samples],
            props={name: matrices[samples] for name, matrices in self.props.items()},
            shapes={key: values[samples] for key, values in self.shapes.items()},
        )

    def from_its_start(self) -> Recording:
        """The bones from frame 0, with the armature first at the origin and not turned about the vertical.

        Its places are rounded, so that those of figures that do the same are equal, wherever and whenever they do.
        Objects have none.
        """
        heading = np.arctan2(self.world[0, 1, 0], self.world[0, 0, 0])
        world = displacement(rotation(np.array([0.0, 0.0, -heading])), self.world[0, :3, 3], np.zeros(3)) @ self.world
        size = np.abs(world[0, :3, :3]).max()
        if 0 < size < np.inf:
            quantum = _ALIKE * 2.0 ** np.rint(np.log2(size))
            world[:, :3] = np.rint(world[:, :3] / quantum) * quantum + 0.0  # none of them is -0
        first = float(self.frames[0])
        animated = self.animated and (self.animated[0] - first, self.animated[1] - first)
        return replace(self, frames=self.frames - first, world=world, props={}, animated=animated)

    def in_frame(self) -> Recording:
        """The recording in the frame that it is solved in, rather than in the world's."""
        if self.units.frame is None:
            return self
        turn = self.units.frame.from_world(self.frames)
        in_metres = turn.copy()
        in_metres[:, :3, 3] *= self.units.unit_scale_m
        props = {name: in_metres @ matrices for name, matrices in self.props.items()}
        return replace(self, world=turn @ self.world, props=props)

    def _in_metres(self, matrices: Array) -> Array:
        matrices[..., :3, :] *= self.units.unit_scale_m
        return matrices
