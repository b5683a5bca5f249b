"""A `CharacterMotion` from recorded matrices: the sole of each foot and the bones that carry it."""

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import CENTRE, CharacterMotion
from ..motion.props import capsule
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array
from ..numerics.interpolation import in_stretches
from ..numerics.rigid import displacement, nearest_rotation, unit
from ..soles.foot_attitude import (
    UP,
    FlatFoot,
    FootSize,
    ends_in_toes,
    flat_foot,
    foot_size,
    planted_instants,
    reflection,
    standing_up,
)
from ..soles.soles import PlacedSole, prop_sole
from .bones import RigBones
from .mapping import RigMapping, SoleSource
from .recording import Recording
from .rig_at_rest import RestPose, sizes_at_rest
from .rig_skin import RigSkin
from .skin_mass import centre_of_volume
from .skin_stances import SkinStances
from .sole_extraction import bone_families, foot_sole, limb_family, skin_meshes

_REST_IS_FLAT = np.radians(10.0)
"""Feet with a mesh whose rest pose stands flat to this angle are taken as modelled: flat."""

_MIRROR_TOLERANCE = 0.2
"""Distance between the direction of a foot bone and the other's mirror image, up to which both feet are alike."""

_SAME_SIZE = 0.2
"""Relative difference of foot bones up to which both feet are given one size."""


def assemble_motion(
    name: str,
    bones: RigBones,
    mapping: RigMapping,
    recording: Recording,
    skin: RigSkin | None,
    *,
    mass: float,
    carried: Mapping[str, SoleMotion],
    stances: SkinStances | None = None,
) -> Generator[int, None, CharacterMotion]:
    """The character's motion with the soles of its mapping.

    Yields the number of frames read before each part of the work, so that Blender can answer its user.

    Parameters
    ----------
    name : str
        The character's.
    mass : float
        [kg]
    carried : mapping of str to SoleMotion
        The objects that print, by name of the sole.
    stances : SkinStances, optional
        Bearing of the skin, and attitude of the feet.

    Raises
    ------
    InputError
        If a mesh that should print has no underside.
    """
    rest = RestPose.of(bones, mapping, recording.armature)
    frame_rate, gravity = recording.units.frame_rate, recording.units.gravity_m_s2
    leg = rest.leg_length(mapping)
    if not rest.is_upright:
        stances = None  # where the whole rig is tilted, the ground under its feet is tilted with it

    sources = [source for source in mapping.soles if not source.object and not source.limb]
    standing = stances.standing if stances else {}
    feet = [_Foot.of(source, recording, rest, standing.get(source.name)) for source in sources]
    step = float(recording.frames[1] - recording.frames[0]) if len(recording.frames) > 1 else 1.0
    planted = planted_instants(
        [foot.path for foot in feet], frame_rate=frame_rate / step, leg_length=leg, gravity=gravity
    )
    yield len(recording.frames)
    unseen = {source.name: bone_families(bones, source) for source in sources if source.name not in standing}
    meshes = skin_meshes(skin, unseen, rest.world)
    meshes |= stances.meshes if stances else {}
    yield len(recording.frames)
    flats = _flat_feet(feet, planted, rest, facing=rest.facing(mapping), leg=leg, modelled=meshes.keys())
    sizes = [
        foot_size(flat, ankle_tip=foot.tip, ball=foot.ball, leg=leg) for foot, flat in zip(feet, flats, strict=True)
    ]
    sizes = _evened(sizes, feet, planted)
    motions: dict[str, SoleMotion] = {}
    for foot, flat, size in zip(feet, flats, sizes, strict=True):
        has_toes, mesh = foot.ball is not None, meshes.get(foot.source.name)
        placed = foot_sole(foot.source, flat, size, mesh, has_toes=has_toes, mirrored=rest.is_mirrored)
        motions[foot.source.name] = foot.motion_of(placed, flat)
        yield len(recording.frames)
    motions.update(_limb_motions(mapping, recording, rest, skin))
    motions.update(carried)
    if stances:
        for sole, bears in stances.bears.items():
            motions[sole] = _at_its_skin(replace(motions[sole], bears=bears), stances.low.get(sole))

    joints = {
        joint: along_bone(recording.bone(bone), 0.0 if end == "head" else bones[bone].length)
        for joint, (bone, end) in mapping.joints.items()
    }
    unknown_above = joints.keys().isdisjoint(("neck", "shoulder_l", "shoulder_r"))
    if skin and joints and unknown_above and {*skin.bones} <= {*recording.bones}:
        joints[CENTRE] = centre_of_volume(skin, bones, recording)

    heads = np.array([bone.head for bone in bones.values()])
    at_rest = {joint: bones[bone].end(end) for joint, (bone, end) in mapping.joints.items()}
    tall, large = sizes_at_rest(heads, at_rest, recording.armature[0], mapping.legs, has_skin=skin is not None)
    return CharacterMotion(
        name=name,
        mass=mass,
        leg_length=leg + (float(np.mean([size.ankle_height for size in sizes])) if sizes else 0.0),
        frames=recording.frames,
        frame_rate=frame_rate,
        soles=tuple(motions[source.name] for source in mapping.soles),
        joints=joints,
        gravity=gravity,
        legs=mapping.legs,
        four_legged=rest.is_four_legged(mapping),
        ground_level=stances.level if stances else None,
        skin=stances.skin if stances else None,
        bones_move=recording.bones_move,
        stature=tall,
        size=large,
        animated=recording.animated,
    )


LIMB_THICKNESS = 0.2
"""Radius of a limb without a skin over the length of its bone."""

STEEP = 0.3
"""Horizontal part of a bone over its length, up to which it points nowhere in plan."""

GIVE = 0.04
"""Compression of flesh where it touches, over the size of the limb: 3 mm for a hand, 1 cm for a trunk."""


def _limb_motions(
    mapping: RigMapping, recording: Recording, rest: RestPose, skin: RigSkin | None
) -> dict[str, SoleMotion]:
    """Limbs that print by whatever side faces down: the skin that moves with the bone, or a bar around it."""
    limbs = [source for source in mapping.soles if source.limb and not source.object]
    families = {source.name: (limb_family(rest.bones, source, mapping), frozenset[str]()) for source in limbs}
    meshes = skin_meshes(skin, families, rest.world)
    motions = {}
    for source in limbs:
        head, tail = rest.end(source.bone, "head"), rest.end(source.bone, "tail")
        if source.name in meshes:
            vertices, triangles = meshes[source.name].vertices, meshes[source.name].triangles
        else:
            length = float(np.linalg.norm(tail - head))
            vertices, triangles = capsule(head, tail, LIMB_THICKNESS * length)
        frame = _limb_frame(tail - head, vertices.mean(axis=0))
        sole = prop_sole(
            (vertices - frame[:3, 3]) @ frame[:3, :3], triangles, name=source.name, side=source.side, give=GIVE
        )
        transforms = _rigid_motion(recording.bone(source.bone), rest.matrix(source.bone)) @ frame
        motions[source.name] = SoleMotion(sole, transforms[:, None])
    return motions


def _limb_frame(along: Array, middle: Array) -> Array:
    """The frame of a limb in the rest pose, (4, 4): upright, its middle at the origin, x where its bone points, if that
    is not up or down."""
    frame = np.eye(4)
    frame[:3, 3] = middle
    level = np.array((*along[:2], 0.0))
    if np.linalg.norm(level) > STEEP * np.linalg.norm(along):
        frame[:3, 0] = unit(level)
        frame[:3, 1] = np.cross(UP, frame[:3, 0])
    return frame


def _at_its_skin(motion: SoleMotion, low: Array | None) -> SoleMotion:
    """A limb raised to its lowest skin (F,) [m] while that bears: skin bends where limbs join, rigid limbs do not."""
    bears = motion.bears
    if low is None or bears is None or not bears.any():
        return motion
    frames = np.arange(len(low))
    lift = np.interp(frames, frames[bears], (low - motion.lowest())[bears])
    transforms = motion.transforms.copy()
    transforms[:, :, 2, 3] += lift[:, None]
    return replace(motion, transforms=transforms)


def along_bone(matrices: Array, distance: float) -> Array:
    """Path of the point at a distance from the bone's head, in units of the bone, (F, 3)."""
    return matrices[:, :3, 1] * distance + matrices[:, :3, 3]


@dataclass(frozen=True)
class _Foot:
    """A foot's bones: joints in the rest pose and rigid motions from it [m]."""

    source: SoleSource
    ankle: Array
    hinge: Array  # where the toes bend, or the tip of a foot that does not
    tip: Array
    motion: Array
    toe_motion: Array
    path: Array  # of ankle and hinge, (F, 2, 3)
    stands: bool = False  # joints and motions are from where it is seen standing, in place of the rest pose

    @property
    def ball(self) -> Array | None:
        return self.hinge if self.source.toe_bone else None

    def motion_of(self, placed: PlacedSole, flat: FlatFoot) -> SoleMotion:
        """A sole carried by the foot, its toes by the toe bone."""
        carriers = [self.motion @ flat.foot_frame, self.toe_motion @ flat.toe_frame]
        transforms = [carry @ place for carry, place in zip(carriers, placed.placements, strict=False)]
        return SoleMotion(placed.sole, np.stack(transforms, axis=1))

    @classmethod
    def of(cls, source: SoleSource, recording: Recording, rest: RestPose, standing: int | None = None) -> _Foot:
        """A foot and its bones, from the rest pose or from the sample at which its skin is seen standing."""
        bones = rest.bones
        last = source.toe_bone or source.bone
        matrices = recording.bone(source.bone)
        last_matrices = recording.bone(last) if source.toe_bone else matrices
        start, last_start = (
            (rest.matrix(source.bone), rest.matrix(last))
            if standing is None
            else (matrices[standing], last_matrices[standing])
        )
        motion = _rigid_motion(matrices, start)
        length, last_length = bones[source.bone].length, bones[last].length
        tip = last_start[:3, 3] + last_length * last_start[:3, 1]
        return cls(
            source=source,
            ankle=start[:3, 3],
            hinge=last_start[:3, 3] if source.toe_bone else tip,
            tip=tip,
            motion=motion,
            toe_motion=_rigid_motion(last_matrices, last_start) if source.toe_bone else motion,
            path=np.stack(
                [matrices[:, :3, 3], along_bone(last_matrices, 0.0 if source.toe_bone else length)],
                axis=1,
            ),
            stands=standing is not None,
        )


def _flat_feet(
    feet: Sequence[_Foot],
    planted: Sequence[NDArray[np.bool_]],
    rest: RestPose,
    *,
    facing: Array,
    leg: float,
    modelled: Collection[str],
) -> list[FlatFoot]:
    """Attitude of each standing foot; `modelled` are the names of those that have a mesh."""
    images = _mirror_images(feet)
    flats = []
    for place, foot in enumerate(feet):
        seen = foot.source.name in modelled
        flats.append(_stand(place, feet, planted, images[place], rest, facing=facing, leg=leg, seen=seen))
    return flats


def _stand(
    place: int,
    feet: Sequence[_Foot],
    planted: Sequence[NDArray[np.bool_]],
    images: Mapping[int, Array],
    rest: RestPose,
    *,
    facing: Array,
    leg: float,
    seen: bool,
) -> FlatFoot:
    """Attitude of a standing foot, from its own planted instants and, reflected, from those of its mirror image.

    A foot that is `seen` on a mesh and nearly flat at rest is flat there.

    It stands level in the world or, where the whole rig is tilted, level in the rig: whichever is nearer to its
    attitude at rest.
    """

    foot, instants = feet[place], planted[place]
    if foot.stands:
        ahead = _pointing(foot, UP, facing, leg)
        return flat_foot(foot.ankle, foot.hinge, ahead, foot_up=UP, toe_up=UP, toe_turns=np.eye(3)[None])

    def standing(turns: Sequence[Array], tilts: Array) -> Array:
        def levelled(index: int) -> Array:
            stands = planted[index]
            return np.swapaxes(tilts[stands], -1, -2) @ turns[index][stands, :3, :3]

        mirrored = [levelled(other) @ mirror for other, mirror in images.items()]
        return standing_up(levelled(place), mirrored, trust_rest_within=_REST_IS_FLAT if seen else 0.0)

    foot_motions, toe_motions = [other.motion for other in feet], [other.toe_motion for other in feet]
    levels = (np.broadcast_to(np.eye(3), rest.tilts.shape), rest.tilts)
    foot_up, tilts = max(((standing(foot_motions, level), level) for level in levels), key=lambda pair: pair[0] @ UP)
    return flat_foot(
        foot.ankle,
        foot.hinge,
        _pointing(foot, foot_up, facing, leg, seen=seen),
        foot_up=foot_up,
        toe_up=standing(toe_motions, tilts),
        toe_turns=np.swapaxes(foot.toe_motion[instants, :3, :3], -1, -2) @ foot.motion[instants, :3, :3],
    )


_STUB = 0.02
"""Length of a foot bone over the leg's, below which it points nowhere."""

_STEEPEST = np.cos(np.radians(18.0))
"""A foot bone closer than this to the vertical does not show where the toes are."""


def _pointing(foot: _Foot, up: Array, facing: Array, leg: float, *, seen: bool = True) -> Array:
    """Direction of the toes in the rest pose; where the character faces if the foot bone is too short or too steep.

    Captures have the ball on the outer side of the foot as often as in its middle, and the tip on the great toe: a foot
    that is not `seen` on a mesh points between the two, if the toes end about where they should.
    """
    along = foot.hinge - foot.ankle
    length = float(np.linalg.norm(along))
    if length < _STUB * leg or abs(float(along @ up)) > _STEEPEST * length:
        return facing
    if not seen and ends_in_toes(foot.ankle, foot.hinge, foot.tip, up):
        return (foot.hinge + foot.tip) / 2 - foot.ankle
    return along


def _mirror_images(feet: Sequence[_Foot]) -> list[dict[int, Array]]:
    """Mirror images of each foot among the others in the rest pose, with the (3, 3) reflection."""
    images: list[dict[int, Array]] = [{} for _ in feet]
    for i, foot in enumerate(feet):
        for j, other in enumerate(feet):
            across = (other.ankle - foot.ankle) * (1, 1, 0)
            if {foot.source.side, other.source.side} != {"L", "R"} or np.linalg.norm(across) == 0:
                continue
            if foot.source.name[:-1] != other.source.name[:-1]:
                continue
            mirror = reflection(across)
            gap = unit(foot.hinge - foot.ankle) - mirror @ unit(other.hinge - other.ankle)
            if np.linalg.norm(gap) < _MIRROR_TOLERANCE:
                images[i][j] = mirror
    return images


def _evened(sizes: Sequence[FootSize], feet: Sequence[_Foot], planted: Sequence[NDArray[np.bool_]]) -> list[FootSize]:
    """Left and right foot of one size where their bones are, each weighted by the time for which it stands."""
    instants = np.array([float(stands.sum()) for stands in planted]) + 1e-6
    bones = np.array([float(np.linalg.norm(foot.hinge - foot.ankle)) for foot in feet])
    values = np.array([(size.length, size.ankle_height) for size in sizes]).reshape(-1, 2)
    evened = []
    for foot, bone in zip(feet, bones, strict=True):
        same_limb = np.array([other.source.name[:-1] == foot.source.name[:-1] for other in feet])
        alike = same_limb & (np.abs(bones - bone) <= _SAME_SIZE * max(bone, 1e-12))
        evened.append(FootSize(*np.average(values[alike], axis=0, weights=instants[alike]).tolist()))
    return evened


def _rigid_motion(matrices: Array, rest: Array) -> Array:
    """Rigid transforms that carry the rest pose to each sample, exact at the bone's head; scaling is left out."""
    back = np.linalg.inv(rest[:3, :3])
    turn = in_stretches(lambda stretch: nearest_rotation(matrices[stretch, :3, :3] @ back), len(matrices))
    return displacement(turn, rest[:3, 3], matrices[:, :3, 3])
