"""Recognition of what a character prints with: from its skin, or from the names and rest pose of its bones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.numerics.arrays import Array
from ...core.rig.bare_body import BareBody, with_toes
from ...core.rig.bones import RigBones, extent
from ...core.rig.mapping import RigMapping, SoleSource, bones_of
from ...core.rig.recording import Recording
from ...core.rig.rig_at_rest import RestPose
from ...core.rig.rig_skin import RigSkin
from ...core.rig.shown_contacts import shown_by_skin
from ...core.rig.skin_mass import skin_mass
from ...core.rig.sole_extraction import bone_families
from ...core.settings import ObjectName
from .. import jobs
from ..reuse import reused
from ..rigs.object_data import armature_of
from ..rigs.rig_mapping import map_rig, require_armature, rest_bones
from ..sampling.body_sampling import POSES, body_frames, read_body, record_body
from ..sampling.rig_checks import is_animated
from ..sampling.rig_recording import record
from ..sampling.skin_sampling import Weights, read_skin
from ..sampling.take import Take
from ..settings import name_of, resolve, timeline_of

MOST_FRAMES = 500
"""Frames from the beginning of the animation that are looked at."""

FOOT_REACH = 0.2
"""A foot and the bone with most of the skin on which it stands are nearer than this, over the size of the rig."""

LEGS_APART = 0.1
"""Feet of different legs of a skeleton are farther apart than this, over the size of the rig."""

COVERS = 0.5
"""Extent of a body's skin over that of its joints from which its volume tells its mass."""

SHARE = 0.3
"""Of a reading of the whole shot, as it is shown to the user."""


@dataclass(frozen=True)
class Recognised:
    """A character as it was recognised.

    Attributes
    ----------
    mapping : RigMapping
        Without soles where neither the skin, nor the names, nor the rest pose show any.
    skin : RigSkin or None
        If it has one.
    recording : Recording or None
        Of the bones of skin and mapping, where a skin moves.
    body : BareBody or None
        If no armature moves it.
    """

    mapping: RigMapping
    skin: RigSkin | None = None
    recording: Recording | None = None
    body: BareBody | None = None


def recognise(
    scene: bpy.types.Scene,
    armature: bpy.types.Object,
    frames: tuple[int, int] | None = None,
    weights: dict[str, Weights] | None = None,
) -> jobs.Job[Recognised]:
    """Joints and contacts of a character.

    Parameters
    ----------
    frames : tuple of int, optional
        First and last frame of its animation.
    weights : dict of str to Weights, optional
        As for `read_skin`.

    Returns
    -------
    Job of Recognised
        Leaving it changes nothing.

    Raises
    ------
    InputError
        If the armature or its meshes cannot be read.
    """
    require_armature(armature)
    mapping = _mapped(armature)
    if armature.mode == "EDIT":
        return Recognised(mapping)
    shaped = _mapped(armature, named=False) if mapping.method == "names" else mapping
    rig, begun, read = name_of(armature), jobs.Progress("sample", 0.0), jobs.Progress("sample", SHARE)
    skin = yield from jobs.meanwhile(begun, read_skin.slices(scene.objects, armature, weights))
    armature = resolve(rig)
    if armature.mode == "EDIT":
        return Recognised(mapping)
    if skin is None:
        bare = _on_all_fours(armature, _mapped(armature, skinned=False), _mapped(armature, named=False, skinned=False))
        return Recognised(bare if bare.soles else _mapped(armature, posed=True))
    take = Take.about(armature, scene, range(scene.frame_current, scene.frame_current + 1))
    moves = bool(frames) and is_animated(armature) and armature_of(armature).pose_position != "REST"
    if frames and moves:
        first, last = (round(frame / take.units.time_stretch) for frame in frames)
        take = replace(take, frames=range(first, min(last, first + MOST_FRAMES) + 1))
    shapes = [shape.key for shape in skin.shapes]
    known = [*skin.bones, *bones_of(mapping), *bones_of(shaped)]
    reading = record(take, armature, known, shapes=shapes)
    recording = (yield from jobs.counted(reading, "sample", len(take.frames), share=SHARE)).from_its_start()
    shown = rest_bones(resolve(rig)), skin, recording, mapping, shaped, moves
    mapping = yield from reused(read, "recognition", shown, _shown(*shown), of=None)
    return Recognised(mapping, skin, recording if moves else None)


def _shown(
    bones: RigBones, skin: RigSkin, recording: Recording, mapping: RigMapping, shaped: RigMapping, moves: bool
) -> jobs.Job[RigMapping]:
    """The mapping of a character as its skin shows it, with its mass; that of its names if it stands still.

    Parameters
    ----------
    mapping, shaped : RigMapping
        By names and rest pose, and by the rest pose alone.
    """
    read = jobs.Progress("sample", SHARE)
    mass = yield from jobs.meanwhile(read, skin_mass.slices(skin, bones, recording))
    if moves:
        seen = yield from jobs.meanwhile(read, shown_by_skin.slices(bones, skin, recording))
        agreeing = (may_be for may_be in (mapping, shaped) if _agrees(bones, may_be, shaped, seen))
        mapping = _joined(bones, skin, next(agreeing, RigMapping(method="skin")), seen)
    return replace(mapping, mass=mass * _covers(bones, skin, mapping))


def recognise_body(scene: bpy.types.Scene, name: ObjectName) -> jobs.Job[Recognised]:
    """Contacts of a body without an armature: none where it is rigid, or none of its parts rests on the ground.

    Raises InputError if its meshes cannot be read.
    """
    read = jobs.Progress("sample", SHARE)
    body = yield from jobs.counted(read_body(scene, name), "sample", POSES, share=SHARE / 2)
    if body.is_rigid:
        return Recognised(RigMapping(method="skin"), body=body)
    first, last = body_frames(timeline_of(scene), resolve(name))
    take = Take.about(resolve(name), scene, range(first, min(last, first + MOST_FRAMES) + 1))
    recording = yield from jobs.counted(record_body(take, name, body), "sample", len(take.frames), share=SHARE)
    weighing = skin_mass.slices(body.skin, body.bones, recording)
    mass = yield from jobs.meanwhile(read, weighing)
    seen = yield from jobs.meanwhile(read, shown_by_skin.slices(body.bones, body.skin, recording))
    soles = with_toes(seen, recording)
    return Recognised(RigMapping(soles=soles, method="skin", mass=mass), body.skin, recording, body)


def _mapped(armature: bpy.types.Object, **known: bool) -> RigMapping:
    """Mapping by names and rest pose, or without a skin by the current pose; empty if none of them gives one."""
    try:
        return map_rig(armature, **known)
    except InputError:
        return RigMapping(method="skin")


def _on_all_fours(armature: bpy.types.Object, mapping: RigMapping, shaped: RigMapping) -> RigMapping:
    """The mapping of a skeleton without a skin, with the legs that its rest pose shows elsewhere than those named.

    They stand apart from these as skirts and tails do not, and the trunk lies on all of them.
    """
    bones = rest_bones(armature)
    size = extent(np.array([bone.head for bone in bones.values()]), np.eye(4))
    further = tuple(sole for sole in shaped.soles if _gap(bones, sole, mapping.soles) > LEGS_APART * size)
    is_told = len(mapping.soles) + len(further) == len(shaped.soles) > 0  # those that are named are among them
    rest = RestPose.of(bones, shaped, np.array(armature.matrix_world)[None])
    if not (further and is_told and rest.is_four_legged(shaped)):
        return mapping
    hip, shoulder = (bones[shaped.joints[joint][0]].head for joint in ("hip_l", "shoulder_l"))
    is_trunk = np.linalg.norm(shoulder - hip) > FOOT_REACH * size
    return replace(mapping, soles=mapping.soles + further) if is_trunk else mapping


def _gap(bones: RigBones, sole: SoleSource, others: Iterable[SoleSource]) -> float:
    """The least distance between the ends of a sole's bones and those of others; infinite without any."""

    def ends(of: SoleSource) -> list[Array]:
        return [bones[bone].end(end) for bone in (of.bone, of.toe_bone) if bone for end in ("head", "tail")]

    gaps = (np.linalg.norm(end - place) for other in others for end in ends(other) for place in ends(sole))
    return float(min(gaps, default=np.inf))


def _covers(bones: RigBones, skin: RigSkin, mapping: RigMapping) -> bool:
    """True if a skin is that of the whole body, by its joints, and not only of shoes on a body of curves."""
    joints = [bones[bone].end(end) for bone, end in mapping.joints.values()]
    return not joints or bool(np.ptp(skin.vertices, axis=0).max() > COVERS * np.ptp(joints, axis=0).max())


def _held(bones: RigBones, foot: SoleSource, seen: Iterable[SoleSource]) -> list[SoleSource]:
    """The contacts of which a foot has a part."""
    family, _ = bone_families(bones, foot)
    return [contact for contact in seen if family & {*contact.parts}]


def _agrees(bones: RigBones, mapping: RigMapping, shaped: RigMapping, seen: tuple[SoleSource, ...]) -> bool:
    """True if feet are near what the skin shows of them, as hips are not, and if none is idle where the rest pose has
    feet elsewhere that bear."""
    reach = FOOT_REACH * extent(np.array([bone.head for bone in bones.values()]), np.eye(4))
    others = {foot.bone for foot in shaped.soles}
    bearing, idle = [], False
    for foot in mapping.soles:
        ends = [bones[bone].end(end) for bone in (foot.bone, foot.toe_bone) if bone for end in ("head", "tail")]
        held = _held(bones, foot, seen)
        if any(np.linalg.norm(ends - bones[contact.bone].head, axis=1).min() > reach for contact in held):
            return False
        bearing += held
        idle |= not held and foot.bone not in others
    return not idle or all(contact in bearing for foot in shaped.soles for contact in _held(bones, foot, seen))


def _joined(bones: RigBones, skin: RigSkin, mapping: RigMapping, seen: tuple[SoleSource, ...]) -> RigMapping:
    """What the names say with the skin's parts, and what only the skin shows: beside feet, hands and other limbs.

    Feet that are named and have no skin, as bones for inverse kinematics, are none where as many others show, or the
    skin of legs.

    Legs that the rest pose alone tells are none if the character bears on other parts, and never on these.
    """
    soles, remaining = [], list(seen)
    bare = [source for source in mapping.soles if not skin.weight_of(bone_families(bones, source)[0]).any()]
    legs = {bone for joint, (bone, _) in mapping.joints.items() if joint.startswith(("hip_", "knee_", "ankle_"))}
    shows_legs = len(seen) >= len(bare) or any(legs & {*contact.parts} for contact in seen)
    for source in mapping.soles:
        if source in bare and shows_legs:
            continue
        same = _held(bones, source, remaining)
        remaining = [contact for contact in remaining if contact not in same]
        parts = tuple(dict.fromkeys(bone for contact in same for bone in contact.parts))
        soles.append(SoleSource(source.name, source.side, source.bone, source.toe_bone, parts=parts))
    if mapping.method == "rest pose" and remaining == list(seen) != []:
        return RigMapping(soles=seen, method="skin")
    others = (replace(contact, limb=contact.limb or bool(mapping.soles)) for contact in remaining)
    return replace(mapping, soles=(*soles, *others))
