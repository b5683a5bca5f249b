"""How the bones that a response is keyed on stand over time, as the user's animation alone poses them."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..animation_layer.nla_layer import without_layer
from ..characters.rig_sampling import handlers_silent, object_named, sampling_scene, still_there

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


def sample_poses(
    scene: bpy.types.Scene, armature: bpy.types.Object, frames: Sequence[int], bones: Sequence[str]
) -> Generator[int, None, RigPoses]:
    """Read bones frame by frame, without the layer that may lie on the armature.

    Yields
    ------
    int
        Number of frames read.
    """
    name = armature.name_full
    matrices = np.empty((len(frames), len(bones), 4, 4))
    channels = {key: np.empty((len(frames), len(bones), width)) for key, width in _CHANNELS.items()}
    world = np.empty((len(frames), 4, 4))
    with sampling_scene(scene, name, bones, []) as scene_name:
        for done, frame in enumerate(frames):
            temporary = still_there(scene_name)
            with handlers_silent(), without_layer(object_named(name)):
                temporary.frame_set(int(frame))
                depsgraph = temporary.view_layers[0].depsgraph
                assert depsgraph is not None
                evaluated = object_named(name).evaluated_get(depsgraph)
                world[done] = evaluated.matrix_world
                pose = evaluated.pose.bones
                if done == 0:
                    places = [pose.find(bone) for bone in bones]
                    buffer = np.empty(len(pose) * 16, dtype=np.float32)
                pose.foreach_get("matrix", buffer)
                matrices[done] = buffer.reshape(-1, 4, 4)[places]
                for key, width in _CHANNELS.items():
                    part = buffer[: len(pose) * width]
                    pose.foreach_get(key, part)
                    channels[key][done] = part.reshape(-1, width)[places]
            yield done + 1
    matrices = np.swapaxes(matrices, -1, -2)  # foreach_get goes by columns
    return RigPoses(
        {
            bone: BonePoses(matrices[:, place], **{key: values[:, place] for key, values in channels.items()})
            for place, bone in enumerate(bones)
        },
        world,
    )
