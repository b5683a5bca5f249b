"""Sampling of a rig over a range of frames into a `CharacterMotion`; the user's scene is only read.

A rig that nothing but its keys moves is not evaluated at all. Others are, in a temporary scene that depends on nothing
else: constraints, drivers, NLA, parents and object motion act as in the user's scene, its meshes cost nothing, and the
user's frame, pose and handlers are left alone. Frame handlers of others act in that scene where they move the rig.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence

import bpy
import numpy as np

from ...core.carving.responded_skin import WornSkin
from ...core.motion.motion import CharacterMotion
from ...core.motion.sole_motion import SoleMotion
from ...core.numerics.arrays import Array
from ...core.rig.bones import RigBones
from ...core.rig.mapping import RigMapping, bones_of
from ...core.rig.motion_assembly import assemble_motion
from ...core.rig.recording import Recording
from ...core.rig.rig_skin import RigSkin
from ...core.rig.skin_stances import skin_stances
from ...core.skin.skin_motion import MOST_SAMPLES
from ..jobs import meanwhile
from ..reuse import reused
from ..rigs.rig_mapping import rest_bones
from ..settings import name_of, resolve
from .prop_extraction import check_props, read_prop
from .rig_checks import check_frames, check_mass, check_recording, check_rig
from .rig_recording import record, record_props
from .skin_sampling import has_skin, read_skin
from .take import Take

Sampling = Generator[int, None, CharacterMotion]
"""Yields the number of frames read so far, returns the motion."""


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


def sample_character(
    take: Take,
    armature: bpy.types.Object,
    mapping: RigMapping,
    *,
    mass: float,
    poses: RigPoses | None = None,
    skin_mass: float = 0.0,
) -> Sampling:
    """Read a character frame by frame.

    Parameters
    ----------
    take : Take
        With the units of the bake that it is read for, or about itself.
    armature : bpy.types.Object
        May be linked or overridden.
    mapping : RigMapping
        From `rig_mapping.map_rig`, corrected by the user or not.
    mass : float
        [kg]
    poses : RigPoses, optional
        Gets the poses of its bones.
    skin_mass : float
        That the volume of its skin suggests [kg], against which a bake is checked; 0 where unknown.

    Yields
    ------
    int
        Number of frames read; closing the generator at any point leaves nothing behind.

    Returns
    -------
    CharacterMotion

    Raises
    ------
    InputError
        If the rig cannot be used as it is; the message names the object and the remedy.
    """
    objects = take.scene.objects
    check_rig(objects, armature, mapping, mass)
    check_frames(take.frames)
    bones = [*bones_of(mapping), *(poses.bones if poses else ())]
    on_bones = any(source.bone and not source.object for source in mapping.soles)
    props = list(dict.fromkeys(source.object for source in mapping.soles if source.object))
    rig, skin = name_of(armature), None
    if on_bones and has_skin(objects, armature):
        skin = yield from meanwhile(0, read_skin.slices(objects, armature, take.weights))
    bones += skin.bones if skin and len(take.frames) <= MOST_SAMPLES else ()
    shapes = [shape.key for shape in skin.shapes] if skin else []
    recording = yield from record(take, resolve(rig), bones, props, shapes)
    if poses:
        poses.take(recording)
        if poses.with_skin and skin and {*skin.bones} <= {*recording.bones}:
            poses.skin = WornSkin(rig.name, skin, rest_bones(resolve(rig)), mapping, recording)
    layer = take.scene.view_layers[0]
    return (yield from recorded_motion(layer, resolve(rig), mapping, recording, skin, mass=mass, skin_mass=skin_mass))


def recorded_motion(
    view_layer: bpy.types.ViewLayer,
    armature: bpy.types.Object,
    mapping: RigMapping,
    recording: Recording,
    skin: RigSkin | None,
    *,
    mass: float,
    skin_mass: float = 0.0,
) -> Sampling:
    """The motion of a character that was recorded.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
        In which the objects that it carries are evaluated.
    recording : Recording
        Of the `bones_of` its mapping and of its objects; also of `skin.bones` if it has at most `MOST_SAMPLES` samples.
    armature, mapping, mass, skin_mass
        As for `sample_character`; and so is what it yields, returns and raises.
    """
    check_recording(armature.name, recording)
    name, bones = armature.name, rest_bones(armature)
    carried = {
        source.name: read_prop(view_layer, source, recording.props[source.object])[0]
        for source in mapping.soles
        if source.object
    }
    read = name, bones, mapping, recording, skin, mass, skin_mass, carried
    return (yield from reused(len(recording.frames), "motion", read, _motion(*read), of=name))


def _motion(
    name: str,
    bones: RigBones,
    mapping: RigMapping,
    recording: Recording,
    skin: RigSkin | None,
    mass: float,
    skin_mass: float,
    carried: Mapping[str, SoleMotion],
) -> Sampling:
    count, stances = len(recording.frames), None
    if skin and count <= MOST_SAMPLES:
        step = float(recording.frames[1] - recording.frames[0]) if count > 1 else 1.0
        looking = skin_stances(skin, bones, mapping, recording, recording.units.frame_rate / step, mass=skin_mass)
        stances = yield from meanwhile(count, looking)
    assembling = assemble_motion(name, bones, mapping, recording, skin, mass=mass, carried=carried, stances=stances)
    return (yield from assembling)


def sample_prop(take: Take, name: str, mapping: RigMapping, *, mass: float) -> Sampling:
    """Read frame by frame a prop without a rig: one or more objects that fall, roll or slide together.

    Parameters
    ----------
    name : str
        What the user calls it.
    mapping : RigMapping
        Its soles are objects.
    take, mass
        As for `sample_character`; and so is what it yields, returns and raises.
    """
    check_mass(name, mass)
    sources = tuple(source for source in mapping.soles if source.object)
    check_props(take.scene.objects, name, sources)
    check_frames(take.frames)
    props = list(dict.fromkeys(source.object for source in sources))
    recording = yield from record_props(take, name, props)
    view_layer = take.scene.view_layers[0]
    parts = [read_prop(view_layer, source, recording.props[source.object]) for source in sources]
    volumes = np.array([volume for _, volume in parts])
    shares = volumes / volumes.sum() if volumes.min() > 0 else np.full(len(parts), 1 / len(parts))
    motions = tuple(motion for motion, _ in parts)
    return CharacterMotion(
        name=name,
        mass=mass,
        leg_length=max(motion.sole.prop.size for motion in motions if motion.sole.prop),
        frames=recording.frames,
        frame_rate=take.units.frame_rate,
        soles=motions,
        gravity=take.units.gravity_m_s2,
        centre=np.einsum("p,pfi->fi", shares, [motion.transforms[:, 0, :3, 3] for motion in motions]),
    )
