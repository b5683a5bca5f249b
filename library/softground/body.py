"""A body in motion, from joint centres, a skeleton or a sequence of meshes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core.capture.captured import Plate, bridged, check_length
from ._core.capture.joint_centres import UPWARD, CapturedBody, axis_along, turned
from ._core.capture.skeleton import Bone, Skeleton, skeleton_of
from ._core.errors import InputError
from ._core.motion.motion import CharacterMotion
from ._core.motion.people import likely_mass
from ._core.motion.units import scale_to_metres, wrong_unit
from ._core.numerics.slices import result_of
from ._core.rig.bare_body import bare_body, body_motion, recorded, with_toes
from ._core.rig.bones import RestBone
from ._core.rig.mapping import BoneEnd, RigMapping, SoleSource
from ._core.rig.motion_assembly import assemble_motion
from ._core.rig.name_mapping import map_by_names
from ._core.rig.recording import Recording, SceneUnits
from ._core.rig.shown_contacts import shown_by_skin
from ._core.rig.skin_mass import skin_mass
from .markers import motion_of_markers

Array = NDArray[np.float64]

GRAVITY = 9.81
"""[m/s²]"""

_NEEDED = tuple(f"{joint}_{side}" for side in "lr" for joint in ("hip", "knee", "ankle", "heel", "ball", "toe"))
_FARTHEST = 1e6
"""Largest coordinate [m]."""
_STRAIGHT = 0.94
"""Cosine of the largest angle between an axis and the way from feet to hips along which that axis is taken for up: 20°,
which is less than of somebody who sits or crawls."""
_POSES = 24
"""Poses by which the parts of a mesh that move together are found."""


@dataclass(frozen=True)
class Body:
    """A body in motion: [s], [m], [kg], Z up.

    Attributes
    ----------
    motion : CharacterMotion
        Its soles, joints and mass over time, as the core finds forces from them: SI units, Z up.
    shape : CharacterMotion
        The same with the soles that print.
    mass_from : str
        What the mass follows from.
    plates : tuple of Plate
        Force plates that were recorded with it.
    """

    motion: CharacterMotion
    shape: CharacterMotion
    mass_from: str = "given"
    plates: tuple[Plate, ...] = ()

    @property
    def name(self) -> str:
        """Name of the body."""
        return self.motion.name

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.motion.mass

    @property
    def rate(self) -> float:
        """Frames per second [Hz]."""
        return self.motion.frame_rate

    @property
    def times(self) -> Array:
        """Times of the frames, (F,) [s]."""
        return self.motion.times

    @classmethod
    def from_joints(
        cls,
        joints: Mapping[str, ArrayLike],
        rate: float,
        *,
        up: str | None = None,
        mass: float | None = None,
        name: str = "body",
        plates: Sequence[Plate] = (),
    ) -> Body:
        """A body from joint centres; gaps (NaN) are bridged by straight lines.

        Parameters
        ----------
        joints : mapping of str to (F, 3) float array
            Paths [m]: `hip`, `knee`, `ankle`, and on the skin of the foot `heel`, `ball` and `toe`, each with
            `_l` and `_r`; `hips`, `neck`, `head`, and `shoulder`, `elbow` and `wrist` of both sides if known.
        rate : float
            Frames per second [Hz].
        up : str, optional
            The upward axis of paths and plates: X, Y, Z, -X, -Y or -Z. Z if not given, and then a body whose hips are
            straight beside its feet is refused; give "Z" if it lies.
        mass : float, optional
            [kg]; that of a person of this size if not given.
        name : str, optional
        plates : sequence of Plate, optional

        Raises
        ------
        InputError
            If joints of the legs are missing or have no length, arrays do not fit, or another axis than Z is up.

        References
        ----------
        The soles are those of a human foot of the size of the bones (Gordon et al. 1989, NATICK/TR-89/044).
        """
        paths = {joint: bridged(np.asarray(path, dtype=float)) for joint, path in joints.items()}
        if missing := [joint for joint in _NEEDED if joint not in paths]:
            raise InputError(
                f"the joints {', '.join(missing)} are missing: give their paths, (frames, 3) in metres",
                "missing_joints",
                missing=missing,
            )
        count = max(len(paths[_NEEDED[0]]), 2)  # a motion has two frames at least
        check_length(count, rate)
        wrong = [joint for joint, path in paths.items() if path.shape != (count, 3) or not np.isfinite(path).all()]
        if wrong:
            raise InputError(f"the path of {wrong[0]} is not numbers of the shape ({count}, 3)", "wrong_shape")
        turn = _turn_up(paths, up, name)
        paths = {joint: path @ turn.T for joint, path in paths.items()}
        plates = [turned(plate, turn) for plate in plates]
        paths.setdefault("hips", (paths["hip_l"] + paths["hip_r"]) / 2)
        skeleton = skeleton_of(CapturedBody(paths, rate))
        body = cls.from_skeleton(skeleton, up="Z", mass=mass, name=name, plates=plates)
        return replace(body, motion=motion_of_markers(paths, rate, mass=body.mass, name=name))

    @classmethod
    def from_skeleton(
        cls,
        skeleton: Skeleton,
        *,
        joints: Mapping[str, BoneEnd] | None = None,
        up: str | None = None,
        mass: float | None = None,
        name: str = "body",
        plates: Sequence[Plate] = (),
    ) -> Body:
        """A body from bones at rest and their poses.

        Parameters
        ----------
        skeleton : Skeleton
            [m]
        joints : mapping of str to (str, str), optional
            Bone of each joint, and its end "head" or "tail"; by the names of the usual rigs if not given.
        up, mass, name, plates
            As for `from_joints`.

        Raises
        ------
        InputError
            If no feet are found among the bones, a joint names a bone that is not there, or another axis than Z is up.
        """
        check_length(len(skeleton.poses), skeleton.rate)
        bones = rest_bones(skeleton)
        if not (np.abs(skeleton.poses) < _FARTHEST).all() or len(skeleton.poses) < 2:
            raise InputError(f"'{name}' has fewer than two poses, or numbers beyond {_FARTHEST:,.0f} m", "wrong_shape")
        mapping = map_by_names(bones, bones.keys()) if joints is None else _mapped(joints)
        if mapping is None or not mapping.soles:
            raise InputError(
                f"no feet are found among the bones {', '.join([*bones][:12])}...: give joints={{'ankle_l': "
                "(BONE, 'head'), ...}, at least both ankles",
                "no_feet",
                bones=[*bones],
            )
        if unknown := {bone for bone, _ in mapping.joints.values()} - bones.keys():
            raise InputError(f"no bone {', '.join(sorted(unknown))} among the bones {', '.join(bones)}", "unknown_bone")
        numbers = [*bones]
        ends = {
            joint: skeleton.poses[:, numbers.index(bone)] @ (0.0, bones[bone].length * (end == "tail"), 0.0, 1.0)
            for joint, (bone, end) in mapping.joints.items()
        }
        turn = _turn_up({joint: path[:, :3] for joint, path in ends.items()}, up, name)
        skeleton, plates = placed(skeleton, turn, 1.0), [turned(plate, turn) for plate in plates]
        bones = rest_bones(skeleton)
        recording = Recording(
            np.arange(len(skeleton.poses), dtype=float),
            tuple(bones),
            np.swapaxes(skeleton.poses, -1, -2).astype(np.float32),
            np.tile(np.eye(4), (len(skeleton.poses), 1, 1)),
            {},
            SceneUnits(skeleton.rate, 1.0, GRAVITY, 1.0),
        )
        motion = result_of(assemble_motion(name, bones, mapping, recording, None, mass=1.0, carried={}))
        if motion.four_legged and len(mapping.soles) == 2:
            hands = [SoleSource(f"hand.{s.upper()}", s.upper(), mapping.joints[f"wrist_{s}"][0]) for s in "lr"]
            paws = [replace(paw, limb=True, toe_bone="") for paw in (*mapping.soles, *hands)]
            mapping = replace(mapping, soles=tuple(paws))
            motion = result_of(assemble_motion(name, bones, mapping, recording, None, mass=1.0, carried={}))
        return _weighed(motion, mass, 0.0, plates)

    @classmethod
    def from_mesh_sequence(
        cls, positions: ArrayLike, triangles: ArrayLike, rate: float, *, mass: float | None = None, name: str = "body"
    ) -> Body:
        """A body from the vertices of its skin over time: what moves as one is a part, what rests on the ground a sole.

        Parameters
        ----------
        positions : (F, V, 3) float array
            Z up [m].
        triangles : (T, 3) int array
        rate : float
            Frames per second [Hz].
        mass : float, optional
            [kg]; by the volume of the skin if not given.
        name : str, optional

        Raises
        ------
        InputError
            If the arrays do not fit, the body is rigid, or no part of it rests on the ground.
        """
        where, faces = np.asarray(positions, dtype=float), np.asarray(triangles, dtype=np.intp)
        if where.ndim != 3 or where.shape[2] != 3 or len(where) < 2 or not np.isfinite(where).all():
            raise InputError(f"positions are of shape {where.shape}, not finite (frames, vertices, 3)", "wrong_shape")
        if (
            faces.ndim != 2
            or faces.shape[1] != 3
            or not len(faces)
            or not 0 <= faces.min() <= faces.max() < where.shape[1]
        ):
            raise InputError("triangles must be rows of three numbers of vertices", "wrong_shape")
        check_length(len(where), rate)
        chosen = np.unique(np.linspace(0, len(where) - 1, _POSES).round().astype(int))
        body = bare_body(where[chosen], faces, [(name, where.shape[1])])
        if body.is_rigid:
            raise InputError("the mesh moves as one rigid piece: only bodies with moving parts are read", "rigid_body")
        units = SceneUnits(rate, 1.0, GRAVITY, 1.0)
        recording = recorded(body, where[:, body.followed], range(len(where)), units)
        soles = with_toes(shown_by_skin(body.bones, body.skin, recording), recording)
        if not soles:
            raise InputError("no part of the mesh rests on the ground: it needs Z up and metres", "no_contact")
        volume = skin_mass(body.skin, body.bones, recording.of(np.array([0])))
        work = body_motion(name, body, RigMapping(soles=soles), recording, mass=1.0, skin_mass=volume)
        return _weighed(result_of(work), mass, volume, ())


def rest_bones(skeleton: Skeleton) -> dict[str, RestBone]:
    """The bones of a skeleton at rest by name."""
    return {
        bone.name: RestBone(bone.parent, matrix, bone.head, bone.tail, float(np.linalg.norm(bone.tail - bone.head)))
        for bone, matrix in zip(skeleton.bones, skeleton.rest(), strict=True)
    }


def placed(skeleton: Skeleton, turn: Array, scale: float) -> Skeleton:
    """The skeleton under a rotation (3, 3), and scaled."""

    def moved(matrices: Array) -> Array:
        matrices = matrices.copy()
        matrices[..., :3, :3] = turn @ matrices[..., :3, :3]
        matrices[..., :3, 3] = scale * matrices[..., :3, 3] @ turn.T
        return matrices

    bones = tuple(
        Bone(bone.name, bone.parent, scale * turn @ bone.head, scale * turn @ bone.tail, turn @ bone.x_axis)
        for bone in skeleton.bones
    )
    at_rest = None if skeleton.at_rest is None else moved(skeleton.at_rest)
    return Skeleton(bones, moved(skeleton.poses), skeleton.rate, at_rest)


def _turn_up(joints: Mapping[str, Array], up: str | None, name: str) -> Array:
    """Rotation (3, 3) that brings an axis up; Z is up if none is given.

    Raises InputError if hips are along another axis than Z from the feet, and nobody says that it is to be so.
    """
    if up is not None:
        if up not in UPWARD:
            raise InputError(f"up is {up!r}: it must be one of {', '.join(UPWARD)}", "unknown_axis", up=up)
        return UPWARD[up]
    ends = [f"{joint}_{side}" for joint in ("hip", "ankle") for side in "lr"]
    if joints.keys() >= {*ends}:
        hips, ankles = (np.mean([joints[end] for end in pair], axis=0) for pair in (ends[:2], ends[2:]))
        seen, above = axis_along(hips - ankles), np.median(hips - ankles, axis=0)
        if seen != "Z" and np.abs(above).max() > _STRAIGHT * np.linalg.norm(above):
            raise InputError(
                f"the hips of '{name}' are above its feet along {seen}, not Z: give up={seen!r}, or up='Z' if it lies",
                "wrong_axis",
                up=seen,
                above=above.tolist(),
            )
    return UPWARD["Z"]


def _mapped(joints: Mapping[str, BoneEnd]) -> RigMapping:
    """The mapping with a foot at each ankle."""
    soles = tuple(
        SoleSource(f"foot.{side.upper()}", side.upper(), joints[ankle][0], joints.get(f"ball_{side}", ("", ""))[0])
        for side in "lr"
        if (ankle := f"ankle_{side}") in joints
    )
    return RigMapping(joints, soles)


def _weighed(motion: CharacterMotion, mass: float | None, volume: float, plates: Sequence[Plate]) -> Body:
    """The body with its mass: as given, else as its skin or its size suggests."""
    source = "given"
    if mass is None:
        mass, source = likely_mass(volume or np.inf, motion.size, two_legs=motion.two_legs)
        if not np.isfinite(mass):
            raise InputError(f"nothing tells what '{motion.name}' weighs: give its mass in kg", "mass", mass=None)
    if scale_to_metres(motion.size) != 1.0 and (source != "given" or motion.two_legs):
        wrong = f"'{motion.name}' is {motion.size:.3g} m large, as of a file in {wrong_unit(motion.size)}: give metres"
        raise InputError(wrong, "wrong_unit", size=motion.size, factor=scale_to_metres(motion.size))
    if not (np.isfinite(mass) and mass > 0):
        raise InputError(f"the mass of '{motion.name}' is {mass:g} kg: give a positive mass in kg", "mass", mass=mass)
    weighed = replace(motion, mass=float(mass))
    return Body(weighed, weighed, source, tuple(plates))
