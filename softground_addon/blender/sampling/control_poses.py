"""Poses of the bones that a response moves, from the recording of a rig."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.carving.responded_skin import WornSkin
from ...core.numerics.arrays import Array
from ...core.rig.recording import Recording


class RigPoses:
    """Some bones of a rig over time, and the armature in the world; filled while the rig is read.

    Attributes
    ----------
    matrices : dict of str to (F, 4, 4) float array
        Pose of each bone in the armature's frame [Blender units].
    world : (F, 4, 4) float array
        Of the armature [Blender units].
    skin : WornSkin or None
        What moves with all of its bones, if that is wanted and was read.
    """

    world: Array

    def __init__(self, bones: Sequence[str], *, with_skin: bool = False) -> None:
        self.bones, self.with_skin = tuple(bones), with_skin
        self.skin: WornSkin | None = None
        self.matrices: dict[str, Array] = {}

    def take(self, recording: Recording) -> None:
        """Copy the bones from a recording, whose other bones need not stay in memory."""
        self.world = recording.world
        for bone in self.bones:
            self.matrices[bone] = np.swapaxes(recording.poses[:, recording.bones.index(bone)].astype(float), -1, -2)
