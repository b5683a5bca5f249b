"""Bones that move a character: the one that carries its body, and the FK bones or IK controls of its legs.

Rigs are read as a graph: a bone goes where its parent goes, or where its constraints copy it from. The bones that are
mapped to joints mostly sit at the end of that graph; the bones that an animator keys sit at its start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from ...core.errors import InputError
from ...core.motion.people import leg_sides
from ...core.rig.mapping import RigMapping
from ..animation_layer.constraint_layer import is_own
from ..animation_layer.layer_curves import animated_paths
from ..rigs.object_data import pose_bones
from ..rigs.rig_mapping import CHOOSE_CONTACTS

_FOLLOWED = 0.5
"""Influence from which on a constraint counts."""
_REPLACING = 0.999
"""Influence from which on a constraint that copies a whole transform replaces the pose."""

BODY = "body"


@dataclass(frozen=True)
class Control:
    """A bone to key.

    Attributes
    ----------
    part : str
        Part that it moves with: "body", or "thigh", "shank", "foot", "knee", "arm" and a side, e.g.
        "thigh_l".
    carried_by : str
        The part that its parents move with already; empty if none of them is keyed.
    moves : bool
        True if its location is keyed beside its rotation.
    """

    bone: str
    part: str
    carried_by: str
    moves: bool


def find_controls(armature: bpy.types.Object, evaluated: bpy.types.Object, mapping: RigMapping) -> list[Control]:
    """The bones to key on a rig, parents first.

    Parameters
    ----------
    evaluated : bpy.types.Object
        The same as a dependency graph evaluates it: there the influence of switches is known.

    Raises
    ------
    InputError
        If no bone carries the whole body.
    """
    rig = _Rig(armature, evaluated)
    body = _body_control(rig, mapping)
    parts = {body: BODY}
    chosen: list[tuple[str, str, bool]] = [(body, BODY, True)]
    for side in dict.fromkeys(("l", "r", *leg_sides(mapping.joints))):
        named = [mapping.joints.get(f"{joint}_{side}", ("", ""))[0] for joint in ("hip", "knee", "ankle")]
        names = named if named[2] else named[:2]
        if all(names) and len(set(names)) == len(names):
            leg = _leg_controls(rig, side, names, body)
            if leg:
                chosen += leg
                parts |= {bone: part for bone, part, _ in leg}
        arm = _arm_control(rig, mapping, side)
        if arm and arm not in parts:
            chosen.append((arm, f"arm_{side}", False))
            parts[arm] = f"arm_{side}"
    trunk = {*rig.behind(body)}
    chains = [[*rig.behind(sole.bone)] for sole in mapping.soles if sole.bone]
    apart = [[bone for bone in chain if bone not in trunk] for chain in chains if parts.keys().isdisjoint(chain)]
    chosen += [(bone, BODY, True) for bone in dict.fromkeys(chain[-1] for chain in apart if chain) if rig.is_free(bone)]
    parts |= {bone: part for bone, part, _ in chosen}
    controls = []
    for bone, part, moves in chosen:
        above = (ancestor for ancestor in rig.behind(bone) if ancestor != bone and ancestor in parts)
        controls.append(Control(bone, part, parts.get(next(above, ""), ""), moves))
    return controls


def travelling_bone(armature: bpy.types.Object, evaluated: bpy.types.Object, mapping: RigMapping) -> str:
    """The bone without a parent whose location moves the whole rig, IK targets and all; empty where there is none."""
    rig = _Rig(armature, evaluated)
    names = [bone for bone, _ in mapping.joints.values() if bone] + [sole.bone for sole in mapping.soles if sole.bone]
    behind = [set(rig.behind(bone)) for bone in (*names, *rig.targets())]
    if not behind:
        return ""
    free = [bone for bone in rig.behind(names[0]) if all(bone in chain for chain in behind) and rig.is_placed(bone)]
    return next(iter([bone for bone in free if rig.is_shaped(bone)] or free), "")


def _body_control(rig: _Rig, mapping: RigMapping) -> str:
    """The nearest bone behind the hips that also carries both thighs and the head, and that can be moved."""
    joints = mapping.joints
    thighs = [joint for joint in joints if joint.startswith("hip_")]
    carried = [joints[joint][0] for joint in ("hips", *thighs, "head", "neck", "spine") if joint in joints]
    if not carried:
        carried = [source.bone for source in mapping.soles if source.bone]
    if not carried:
        raise InputError(f"'{rig.name}' has no feet, and nothing else to print with: {CHOOSE_CONTACTS}.")
    behind = [list(rig.behind(bone)) for bone in carried]
    common = [bone for bone in behind[0] if all(bone in chain for chain in behind)]
    free = [bone for bone in common if rig.is_free(bone) and rig.can_move(bone)]
    keyed = [bone for bone in free if rig.is_shaped(bone) or bone in rig.keyed]
    if not free:
        hips, root = "choose the bone of the hips in Properties > Physics > Body Bones", "add a root bone in Edit Mode"
        remedy = hips if joints else f"{root}, and parent to it the bones that have no parent"
        raise InputError(f"No bone of '{rig.name}' carries its whole body: {remedy}.")
    return (keyed or free)[0]


def _leg_controls(rig: _Rig, side: str, names: list[str], body: str) -> list[tuple[str, str, bool]]:
    """Bone, part, and True if it is moved, of one leg: its IK target and pole, or its FK bones. Empty if unknown.

    In game rigs, whose IK was baked, feet often hang on the root: such a bone does not go where the shank takes it.
    Legs of thigh and shin alone have no bone for the foot, and IK does not turn it.
    """
    trunk = set(rig.behind(body))
    solver = next(
        (ik for bone in names[:0:-1] for limb in rig.behind(bone) if limb not in trunk for ik in rig.solvers(limb)),
        None,
    )
    if solver is not None:
        if solver.target != rig.armature or not solver.subtarget or len(names) < 3:
            return []
        target = rig.control_behind(solver.subtarget, trunk)
        if target is None:
            return []
        controls = [(target, f"foot_{side}", True)]
        if solver.pole_target == rig.armature and solver.pole_subtarget:
            pole = rig.control_behind(solver.pole_subtarget, trunk)
            if pole is not None and target not in rig.behind(pole):
                controls.append((pole, f"knee_{side}", True))
        return controls
    bones = [rig.origin(bone) for bone in names]
    if len(set(bones)) < len(bones) or not all(rig.is_free(bone) for bone in bones):
        return []
    above = (body, *bones)
    return [
        (bone, f"{part}_{side}", above[i] not in rig.behind(bone))
        for i, (bone, part) in enumerate(zip(bones, ("thigh", "shank", "foot"), strict=False))
    ]


def _arm_control(rig: _Rig, mapping: RigMapping, side: str) -> str:
    """The upper arm of an FK arm; empty where there is none."""
    if f"shoulder_{side}" not in mapping.joints:
        return ""
    arm = rig.origin(mapping.joints[f"shoulder_{side}"][0])
    solved = any(rig.solvers(bone) for bone in (arm, *rig.below(arm)))
    return arm if rig.is_free(arm) and not solved else ""


class _Rig:
    """An armature's bones as a graph: each follows others."""

    def __init__(self, armature: bpy.types.Object, evaluated: bpy.types.Object) -> None:
        self.armature, self.name = armature, armature.name
        self._bones: Mapping[str, bpy.types.PoseBone] = {bone.name: bone for bone in pose_bones(armature)}
        self._evaluated: Mapping[str, bpy.types.PoseBone] = {bone.name: bone for bone in pose_bones(evaluated)}
        self.keyed = {path.split('"')[1] for path, _ in animated_paths(armature) if path.startswith('pose.bones["')}
        self._shapes = any(bone.custom_shape for bone in pose_bones(armature))

    def behind(self, bone: str) -> Iterator[str]:
        """The bone, then all that it follows, nearest first."""
        seen, waiting = {bone}, [bone]
        while waiting:
            current = waiting.pop(0)
            yield current
            for source in self._followed(current):
                if source not in seen:
                    seen.add(source)
                    waiting.append(source)

    def below(self, bone: str) -> list[str]:
        """The bones under another one."""
        return [child.name for child in self._bones[bone].children_recursive]

    def origin(self, bone: str) -> str:
        """The bone that another one copies, and so on to the first."""
        for _ in self._bones:
            copied = [c for c in self._active(bone) if c.type == "COPY_TRANSFORMS" and c.influence >= _REPLACING]
            if not copied or not copied[-1].subtarget:
                return bone
            bone = copied[-1].subtarget
        return bone

    def solvers(self, bone: str) -> list[Any]:
        """The bone's constraints that solve a leg."""
        return [
            constraint
            for constraint in self._active(bone)
            if constraint.type == "IK" and constraint.target is not None and constraint.chain_count != 1
        ]

    def targets(self) -> set[str]:
        """Bones that limbs reach for, and toward which their knees and elbows point."""
        solved = [solver for bone in self._bones for solver in self.solvers(bone)]
        aims = [(ik.target, ik.subtarget) for ik in solved] + [(ik.pole_target, ik.pole_subtarget) for ik in solved]
        return {bone for target, bone in aims if target == self.armature and bone in self._bones}

    def is_placed(self, bone: str) -> bool:
        """True if no other bone of the rig moves the bone."""
        return self._bones[bone].parent is None and not self._active(bone)

    def control_behind(self, bone: str, trunk: set[str]) -> str | None:
        """The nearest bone behind another, off the trunk, that an animator keys; else the nearest with a shape."""
        candidates = [name for name in self.behind(bone) if name not in trunk and self.is_free(name)]
        for kind in (self.keyed.__contains__, self.is_shaped, lambda _: True):
            control = next((name for name in candidates if kind(name)), None)
            if control is not None:
                return control
        return None

    def is_shaped(self, bone: str) -> bool:
        """True if the rig shows the bone as a control."""
        return not self._shapes or self._bones[bone].custom_shape is not None

    def is_free(self, bone: str) -> bool:
        """True if nothing overrides the bone's keys."""
        return not any(
            constraint.type in ("COPY_TRANSFORMS", "ARMATURE", "COPY_ROTATION", "COPY_LOCATION", "IK", "DAMPED_TRACK")
            for constraint in self._active(bone)
        )

    def can_move(self, bone: str) -> bool:
        """True unless the bone is connected: Blender keeps it at its parent's tail then, constraints or not."""
        pose_bone = self._bones[bone]
        return not (pose_bone.bone.use_connect and pose_bone.parent)

    def _followed(self, bone: str) -> list[str]:
        sources: list[str] = []
        for constraint in reversed(self._active(bone)):
            if constraint.type == "ARMATURE":
                return sources + [t.subtarget for t in constraint.targets if t.weight > _FOLLOWED and t.subtarget]
            if constraint.type in ("COPY_TRANSFORMS", "CHILD_OF", "COPY_LOCATION") and constraint.subtarget:
                sources.append(constraint.subtarget)
                if constraint.type == "COPY_TRANSFORMS" and constraint.influence >= _REPLACING:
                    return [name for name in sources if name in self._bones]
        parent = self._bones[bone].parent
        return [name for name in (*sources, *([parent.name] if parent else [])) if name in self._bones]

    def _active(self, bone: str) -> list[Any]:
        """The bone's constraints that act now and refer to bones of this armature, as far as they refer to anything."""
        seen: Any = self._evaluated.get(bone, self._bones[bone]).constraints  # which may be renamed since
        return [
            c
            for c in self._bones[bone].constraints
            if not c.mute and c.enabled and seen.get(c.name, c).influence > _FOLLOWED and not is_own(c)
            if getattr(c, "target", None) in (None, self.armature) or c.type == "IK"
        ]
