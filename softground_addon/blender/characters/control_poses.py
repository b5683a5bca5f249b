"""How some bones of a rig stand over time, taken down while the rig is read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .keyed_poses import keyed_channel

Array = NDArray[np.float64]

_CHANNELS = {"location": 3, "rotation_quaternion": 4, "rotation_euler": 3, "rotation_axis_angle": 4, "scale": 3}


@dataclass(frozen=True)
class BonePoses:
    """One bone over time.

    Attributes
    ----------
    matrix : (F, 4, 4) float array
        Pose in the armature's frame [Blender units].
    location, rotation_quaternion, rotation_euler, rotation_axis_angle, scale : (F, 3) or (F, 4) float arrays
        Its channels.
    """

    matrix: Array
    location: Array
    rotation_quaternion: Array
    rotation_euler: Array
    rotation_axis_angle: Array
    scale: Array


@dataclass(frozen=True)
class RigPoses:
    """Bones of an armature over time, and the armature in the world [Blender units], (F, 4, 4)."""

    bones: Mapping[str, BonePoses]
    world: Array


class PoseRecorder:
    """Takes down the poses of some bones, sample by sample or bone by bone.

    Parameters
    ----------
    bones : sequence of str
    count : int
        Number of samples.

    Attributes
    ----------
    world : (F, 4, 4) float array
        Where the armature is [Blender units].
    """

    def __init__(self, bones: Sequence[str], count: int) -> None:
        self.bones = tuple(bones)
        self._matrices = np.empty((count, len(bones), 4, 4), dtype=np.float32)  # by columns, as Blender gives them
        self._channels = {
            key: np.empty((count, len(bones), width), dtype=np.float32) for key, width in _CHANNELS.items()
        }
        self.world = np.empty((count, 4, 4))
        self._places: list[int] = []

    def note(self, sample: int, evaluated: bpy.types.Object) -> None:
        """Take down all bones at a sample, from the evaluated armature."""
        self.world[sample] = evaluated.matrix_world
        pose = evaluated.pose.bones
        if not self._places:
            self._places = [pose.find(bone) for bone in self.bones]
            self._buffer = np.empty(len(pose) * 16, dtype=np.float32)
        pose.foreach_get("matrix", self._buffer)
        self._matrices[sample] = self._buffer.reshape(-1, 4, 4)[self._places]
        for key, width in _CHANNELS.items():
            part = self._buffer[: len(pose) * width]
            pose.foreach_get(key, part)
            self._channels[key][sample] = part.reshape(-1, width)[self._places]

    def note_keys(self, armature: bpy.types.Object, bone: str, times: Array, poses: NDArray[Any]) -> None:
        """Take down one bone at all samples, from its keys at these times and its transposed poses (F, 4, 4)."""
        if bone in self.bones:
            place = self.bones.index(bone)
            self._matrices[:, place] = poses
            for key, values in self._channels.items():
                values[:, place] = keyed_channel(armature, bone, key, times)

    def poses(self) -> RigPoses:
        """What was taken down."""
        matrices = np.swapaxes(self._matrices.astype(float), -1, -2)
        channels = {key: values.astype(float) for key, values in self._channels.items()}
        return RigPoses(
            {
                bone: BonePoses(matrices[:, place], **{key: values[:, place] for key, values in channels.items()})
                for place, bone in enumerate(self.bones)
            },
            self.world,
        )
