"""Rigs to test with: one body under the names of every family, with the bones that could fool a mapping."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import pytest

TRUNK = {
    "hips": ((0.0, 0.0, 0.95), (0.0, 0.0, 1.05)),
    "spine": ((0.0, 0.0, 1.05), (0.0, 0.0, 1.22)),
    "chest": ((0.0, 0.0, 1.22), (0.0, 0.0, 1.46)),
    "neck": ((0.0, 0.0, 1.46), (0.0, 0.0, 1.55)),
    "head": ((0.0, 0.0, 1.55), (0.0, 0.0, 1.78)),
}
LIMBS = {
    "collar": ((0.03, 0.0, 1.43), (0.18, 0.0, 1.43)),
    "upper_arm": ((0.18, 0.0, 1.43), (0.46, 0.02, 1.43)),
    "forearm": ((0.46, 0.02, 1.43), (0.72, 0.0, 1.43)),
    "hand": ((0.72, 0.0, 1.43), (0.84, 0.0, 1.43)),
    "thigh": ((0.10, 0.0, 0.92), (0.10, -0.02, 0.50)),
    "shin": ((0.10, -0.02, 0.50), (0.10, 0.0, 0.09)),
    "foot": ((0.10, 0.0, 0.09), (0.10, -0.13, 0.02)),
    "toe": ((0.10, -0.13, 0.02), (0.10, -0.20, 0.015)),
}
PARENTS = {
    "spine": "hips",
    "chest": "spine",
    "neck": "chest",
    "head": "neck",
    "collar": "chest",
    "upper_arm": "collar",
    "forearm": "upper_arm",
    "hand": "forearm",
    "thigh": "hips",
    "shin": "thigh",
    "foot": "shin",
    "toe": "foot",
}
"""A standing figure of 1.78 m that faces -Y; limbs of the left side, at +X."""


@dataclass(frozen=True)
class Family:
    """Names of a rig family: parts in the order hips, spine, chest, neck, head, and a template per limb segment.

    `{s}` stands for the side as in `sides`. `decoys` are further bones that must never be chosen; those with a side are
    made for both.
    """

    trunk: Sequence[str]
    limbs: Mapping[str, str]
    sides: tuple[str, str] = ("Left", "Right")
    decoys: Sequence[str] = ()
    decoys_deform: bool = False

    def name(self, part: str, side: int = 0) -> str:
        if part in self.limbs:
            return self.limbs[part].format(s=self.sides[side])
        return self.trunk[list(TRUNK).index(part)]


def _limbs(
    collar: str, upper_arm: str, forearm: str, hand: str, thigh: str, shin: str, foot: str, toe: str
) -> dict[str, str]:
    return dict(zip(LIMBS, (collar, upper_arm, forearm, hand, thigh, shin, foot, toe), strict=True))


_MIXAMO = ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
_MIXAMO_TRUNK = ("Hips", "Spine", "Spine1", "Neck", "Head")
_BLENDER = ("shoulder", "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe")

FAMILIES = {
    "mixamo": Family(
        [f"mixamorig:{part}" for part in _MIXAMO_TRUNK],
        _limbs(*(f"mixamorig:{{s}}{part}" for part in _MIXAMO)),
        decoys=("mixamorig:{s}Toe_End", "mixamorig:{s}HandIndex1", "mixamorig:HeadTop_End"),
        decoys_deform=True,
    ),
    "mixamo numbered": Family(
        [f"mixamorig7:{part}" for part in _MIXAMO_TRUNK], _limbs(*(f"mixamorig7:{{s}}{part}" for part in _MIXAMO))
    ),
    "mixamo bare": Family(_MIXAMO_TRUNK, _limbs(*(f"{{s}}{part}" for part in _MIXAMO))),
    "mixamo underscored": Family(
        [f"mixamorig_{part}" for part in _MIXAMO_TRUNK], _limbs(*(f"mixamorig_{{s}}{part}" for part in _MIXAMO))
    ),
    "rigify metarig": Family(
        ("spine", "spine.001", "spine.002", "spine.004", "spine.006"),
        _limbs(*(f"{part}.{{s}}" for part in _BLENDER)),
        sides=("L", "R"),
        decoys=("heel.02.{s}", "pelvis.{s}", "palm.01.{s}"),
        decoys_deform=True,
    ),
    "rigify deform": Family(
        ("DEF-spine", "DEF-spine.001", "DEF-spine.002", "DEF-spine.004", "DEF-spine.006"),
        _limbs(*(f"DEF-{part}.{{s}}" for part in _BLENDER)),
        sides=("L", "R"),
        decoys=(
            "hips",
            "torso",
            "head",
            "neck",
            "root",
            "ORG-foot.{s}",
            "MCH-foot.{s}",
            "foot_ik.{s}",
            "foot_fk.{s}",
            "foot_heel_ik.{s}",
            "foot_spin_ik.{s}",
            "toe_ik.{s}",
            "toe_fk.{s}",
            "thigh_parent.{s}",
            "foot_tweak.{s}",
            "VIS_thigh_ik_pole.{s}",
            "thigh_ik_target.{s}",
            "ORG-toe.{s}",
            "ORG-shin.{s}",
        ),
    ),
    "cmu bvh": Family(
        ("Hips", "Chest", "Chest2", "Neck", "Head"),
        _limbs(*(f"{{s}}{part}" for part in ("Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Toe"))),
        decoys=("LHipJoint", "RHipJoint"),
        decoys_deform=True,
    ),
    "unreal": Family(
        ("pelvis", "spine_01", "spine_02", "neck_01", "head"),
        _limbs(
            "clavicle_{s}", "upperarm_{s}", "lowerarm_{s}", "hand_{s}", "thigh_{s}", "calf_{s}", "foot_{s}", "ball_{s}"
        ),
        sides=("l", "r"),
        decoys=(
            "ik_foot_root",
            "ik_foot_{s}",
            "ik_hand_{s}",
            "thigh_twist_01_{s}",
            "calf_twist_01_{s}",
            "upperarm_twist_01_{s}",
        ),
        decoys_deform=True,
    ),
    "vrm": Family(
        [f"J_Bip_C_{part}" for part in ("Hips", "Spine", "Chest", "Neck", "Head")],
        _limbs(
            *(
                f"J_Bip_{{s}}_{part}"
                for part in ("Shoulder", "UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "ToeBase")
            )
        ),
        sides=("L", "R"),
        decoys=("J_Sec_{s}_Bust1", "J_Adj_{s}_FaceEye", "J_Sec_Hair1_01", "J_Sec_{s}_SkirtBack1_01"),
        decoys_deform=True,
    ),
    "makehuman": Family(
        ("root", "spine05", "spine02", "neck01", "head"),
        _limbs(
            "clavicle.{s}",
            "upperarm01.{s}",
            "lowerarm01.{s}",
            "wrist.{s}",
            "upperleg01.{s}",
            "lowerleg01.{s}",
            "foot.{s}",
            "toe1-1.{s}",
        ),
        sides=("L", "R"),
        decoys=("upperleg02.{s}", "lowerleg02.{s}", "toe2-1.{s}", "toe1-2.{s}", "upperarm02.{s}"),
        decoys_deform=True,
    ),
    "auto-rig pro": Family(
        ("root.x", "spine_01.x", "spine_02.x", "neck.x", "head.x"),
        _limbs(
            "shoulder.{s}",
            "arm_stretch.{s}",
            "forearm_stretch.{s}",
            "hand.{s}",
            "thigh_stretch.{s}",
            "leg_stretch.{s}",
            "foot.{s}",
            "toes_01.{s}",
        ),
        sides=("l", "r"),
        decoys=(
            "c_foot_ik.{s}",
            "c_foot_fk.{s}",
            "c_foot_roll_cursor.{s}",
            "c_toes_fk.{s}",
            "c_leg_pole.{s}",
            "foot_ik.{s}",
            "c_thigh_b.{s}",
            "c_root_master.x",
            "c_pos",
            "foot_fk.{s}",
            "toes_end.{s}",
            "c_hand_ik.{s}",
            "leg_ik_nostr.{s}",
        ),
    ),
    "blender": Family(
        ("hips", "spine", "chest", "neck", "head"),
        _limbs(*(f"{part}.{{s}}" for part in _BLENDER)),
        sides=("L", "R"),
        decoys=(
            "foot_ik.{s}",
            "knee_pole.{s}",
            "heel_roll.{s}",
            "ctrl_foot.{s}",
            "foot_control.{s}",
            "thigh_twist.{s}",
        ),
        decoys_deform=True,
    ),
    "3ds max biped": Family(
        ("Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine1", "Bip01 Neck", "Bip01 Head"),
        _limbs(
            *(
                f"Bip01 {{s}} {part}"
                for part in ("Clavicle", "UpperArm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "Toe0")
            )
        ),
        sides=("L", "R"),
        decoys=("Bip01 Footsteps",),
        decoys_deform=True,
    ),
    "character creator": Family(
        ("CC_Base_Hip", "CC_Base_Waist", "CC_Base_Spine01", "CC_Base_NeckTwist01", "CC_Base_Head"),
        _limbs(
            *(
                f"CC_Base_{{s}}_{part}"
                for part in ("Clavicle", "Upperarm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "ToeBase")
            )
        ),
        sides=("L", "R"),
        decoys=("CC_Base_{s}_ThighTwist01", "CC_Base_{s}_CalfTwist02"),
        decoys_deform=True,
    ),
    "daz": Family(
        ("hip", "abdomenLower", "chestLower", "neckLower", "head"),
        _limbs(
            "{s}Collar", "{s}ShldrBend", "{s}ForearmBend", "{s}Hand", "{s}ThighBend", "{s}Shin", "{s}Foot", "{s}Toe"
        ),
        sides=("l", "r"),
        decoys=("{s}ThighTwist", "{s}ShldrTwist", "{s}SmallToe1"),
        decoys_deform=True,
    ),
    "smpl": Family(
        ("pelvis", "spine1", "spine2", "neck", "head"),
        _limbs(*(f"{{s}}_{part}" for part in ("collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot"))),
        sides=("left", "right"),
    ),
    "leg and knee": Family(
        ("pelvis", "torso", "chest", "neck", "head"),
        _limbs("clavicle_{s}", "arm_{s}", "elbow_{s}", "hand_{s}", "leg_{s}", "knee_{s}", "foot_{s}", "toes_{s}"),
        sides=("L", "R"),
    ),
    "joint suffix": Family(
        ("hero_hips_jnt", "hero_spine_jnt", "hero_chest_jnt", "hero_neck_jnt", "hero_head_jnt"),
        _limbs(
            *(
                f"hero_{{s}}_{part}_jnt"
                for part in ("clavicle", "upperArm", "foreArm", "hand", "upLeg", "lowLeg", "foot", "toe")
            )
        ),
        sides=("l", "r"),
        decoys=("hero_{s}_footHeel_jnt", "hero_{s}_upLegTwist_jnt"),
        decoys_deform=True,
    ),
}


def build(
    name: str,
    bones: Mapping[str, tuple[Sequence[float], Sequence[float]]],
    parents: Mapping[str, str] | None = None,
    *,
    steering: Iterable[str] = (),
) -> bpy.types.Object:
    """An armature object in the open scene with these bones (head, tail); `steering` ones do not deform."""
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    edit = armature.data.edit_bones
    for bone, (head, tail) in bones.items():
        created = edit.new(bone)
        created.head, created.tail = head, tail
    for bone, parent in (parents or {}).items():
        edit[bone].parent = edit[parent]
    for bone in steering:
        edit[bone].use_deform = False
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


def mirrored(point: Sequence[float]) -> tuple[float, float, float]:
    return (-point[0], point[1], point[2])


def human(family: Family, *, name: str = "Human", without: Sequence[str] = (), turn: float = 0.0) -> bpy.types.Object:
    """The standing figure under a family's names, with the family's decoys, facing -Y turned by an angle [rad]."""
    bones: dict[str, tuple[Sequence[float], Sequence[float]]] = {}
    parents: dict[str, str] = {}
    for part, ends in TRUNK.items():
        bones[family.name(part)] = ends
        if part in PARENTS:
            parents[family.name(part)] = family.name(PARENTS[part])
    for side in (0, 1):
        for part, (head, tail) in LIMBS.items():
            if part in without:
                continue
            bone = family.name(part, side)
            bones[bone] = (head, tail) if side == 0 else (mirrored(head), mirrored(tail))
            parents[bone] = family.name(PARENTS[part], side)
    steering = []
    for place, decoy in enumerate(family.decoys):
        for side in (0, 1) if "{s}" in decoy else (0,):
            bone = decoy.format(s=family.sides[side])
            x = 0.5 - side
            bones[bone] = ((x, -0.3, 0.01 * place), (x, -0.3, 0.01 * place + 0.1))
            if not family.decoys_deform:
                steering.append(bone)
    cosine, sine = np.cos(turn), np.sin(turn)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    turned = {bone: (rotation @ np.array(head), rotation @ np.array(tail)) for bone, (head, tail) in bones.items()}
    return build(name, turned, parents, steering=steering)


def key(thing: bpy.types.Object, path: str, values: Mapping[int, Sequence[float]], *, bone: str = "") -> None:
    """Linear keys on a property of an object or of one of its bones."""
    owner = thing.pose.bones[bone] if bone else thing
    if path == "rotation_euler":
        owner.rotation_mode = "XYZ"
    for frame, value in values.items():
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)


_MAKE_RIGIFY = """
import os, sys
import bpy, addon_utils
bpy.ops.wm.read_factory_settings(use_empty=True)
if addon_utils.enable("rigify", default_set=True) is None:
    os._exit(3)
bpy.ops.object.armature_human_metarig_add()
metarig = bpy.context.view_layer.objects.active
bpy.ops.pose.rigify_generate()
metarig.data.rigify_target_rig.name = "Generated"
metarig.name = "Metarig"
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1])
os._exit(0)
"""
"""In a process of its own: with Rigify's classes registered, the Blender wheel does not exit."""


def make_rigify_file(path: Path) -> None:
    """A file with Rigify's human, "Metarig" and "Generated"; skips the test where there is no Rigify."""
    made = subprocess.run(
        [sys.executable, "-c", _MAKE_RIGIFY, str(path)], capture_output=True, timeout=600, check=False
    )
    if made.returncode == 3:
        pytest.skip("this Blender comes without Rigify")
    assert made.returncode == 0, made.stderr.decode()


def open_rigify(path: Path, name: str) -> bpy.types.Object:
    """Open that file and return one of its armatures."""
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    return bpy.data.objects[name]
