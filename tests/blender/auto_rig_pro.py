"""A rig built like Auto-Rig Pro's, which is not free to ship: its public control names and how they are connected.

Controls `c_*` lead; `thigh_ik` and `leg_ik` reach for the foot control's roll bones; `thigh_stretch`, `leg_stretch` and
`foot` deform and copy either chain, as the property `ik_fk_switch` of the foot control says (0 IK, 1 FK).
"""

import bpy
import numpy as np

from tests.blender import responders, rigs

_TRUNK = {
    "c_pos": ((0.0, 0.0, 0.0), (0.0, -0.3, 0.0)),
    "c_traj": ((0.0, 0.0, 0.0), (0.0, -0.2, 0.0)),
    "c_root_master.x": ((0.0, 0.0, 0.95), (0.0, 0.0, 1.05)),
    "c_root.x": ((0.0, 0.0, 0.95), (0.0, 0.0, 1.05)),
    "root.x": ((0.0, 0.0, 0.95), (0.0, 0.0, 1.05)),
    "c_spine_01.x": ((0.0, 0.0, 1.05), (0.0, 0.0, 1.22)),
    "spine_01.x": ((0.0, 0.0, 1.05), (0.0, 0.0, 1.22)),
    "c_spine_02.x": ((0.0, 0.0, 1.22), (0.0, 0.0, 1.46)),
    "spine_02.x": ((0.0, 0.0, 1.22), (0.0, 0.0, 1.46)),
    "neck.x": ((0.0, 0.0, 1.46), (0.0, 0.0, 1.55)),
    "head.x": ((0.0, 0.0, 1.55), (0.0, 0.0, 1.78)),
}
_TRUNK_PARENTS = {
    "c_traj": "c_pos",
    "c_root_master.x": "c_traj",
    "c_root.x": "c_root_master.x",
    "root.x": "c_root.x",
    "c_spine_01.x": "c_root_master.x",
    "spine_01.x": "c_spine_01.x",
    "c_spine_02.x": "c_spine_01.x",
    "spine_02.x": "c_spine_02.x",
    "neck.x": "spine_02.x",
    "head.x": "neck.x",
}
_LEG = {
    "thigh_stretch": ("thigh", "c_root.x"),
    "leg_stretch": ("shin", "thigh_stretch"),
    "foot": ("foot", "leg_stretch"),
    "toes_01": ("toe", "foot"),
    "thigh_ik": ("thigh", "c_root.x"),
    "leg_ik": ("shin", "thigh_ik"),
    "c_thigh_fk": ("thigh", "c_root.x"),
    "c_leg_fk": ("shin", "c_thigh_fk"),
    "c_foot_fk": ("foot", "c_leg_fk"),
    "c_foot_ik": ("foot", "c_traj"),
    "foot_01_roll": ("foot", "c_foot_ik"),
    "foot_ik_target": ("foot", "foot_01_roll"),
    "foot_ik": ("foot", "foot_01_roll"),
}
"""Bone: which limb segment it lies along, and its parent."""
_ARM = {
    "shoulder": ("collar", "spine_02.x"),
    "arm_stretch": ("upper_arm", "shoulder"),
    "forearm_stretch": ("forearm", "arm_stretch"),
    "hand": ("hand", "forearm_stretch"),
}
_DEFORM = (
    "root.x",
    "spine_01.x",
    "spine_02.x",
    "neck.x",
    "head.x",
    "thigh_stretch",
    "leg_stretch",
    "foot",
    "toes_01",
    *_ARM,
)
_COPIES = {
    "thigh_stretch": ("thigh_ik", "c_thigh_fk"),
    "leg_stretch": ("leg_ik", "c_leg_fk"),
    "foot": ("foot_ik", "c_foot_fk"),
}


def build() -> bpy.types.Object:
    """The rig at rest."""
    bones, parents = dict(_TRUNK), dict(_TRUNK_PARENTS)
    for side, flip in (("l", lambda point: point), ("r", rigs.mirrored)):
        for bone, (segment, parent) in (_LEG | _ARM).items():
            bones[f"{bone}.{side}"] = tuple(flip(end) for end in rigs.LIMBS[segment])
            parents[f"{bone}.{side}"] = parent if parent.endswith(".x") or parent == "c_traj" else f"{parent}.{side}"
        knee = rigs.LIMBS["shin"][0]
        pole = [(knee[0], knee[1] - 0.5, knee[2]), (knee[0], knee[1] - 0.6, knee[2])]
        bones[f"c_leg_pole.{side}"] = tuple(flip(end) for end in pole)
        parents[f"c_leg_pole.{side}"] = "c_foot_ik." + side
    steering = [bone for bone in bones if bone not in _DEFORM and bone.rpartition(".")[0] not in _DEFORM]
    armature = rigs.build("Hero", bones, parents, steering=steering)
    for side in "lr":
        _wire_leg(armature, side)
    return armature


def _wire_leg(armature: bpy.types.Object, side: str) -> None:
    pose = armature.pose.bones
    pose[f"c_foot_ik.{side}"]["ik_fk_switch"] = 0.0
    ik = pose[f"leg_ik.{side}"].constraints.new("IK")
    ik.target, ik.subtarget, ik.chain_count, ik.iterations = armature, f"foot_ik_target.{side}", 2, 500
    ik.pole_target, ik.pole_subtarget, ik.pole_angle = armature, f"c_leg_pole.{side}", -np.pi / 2
    for bone, (by_ik, by_fk) in _COPIES.items():
        for source, expression in ((by_ik, "1"), (by_fk, "switch")):
            copy = pose[f"{bone}.{side}"].constraints.new("COPY_TRANSFORMS")
            copy.target, copy.subtarget = armature, f"{source}.{side}"
            if expression != "1":
                driver = copy.driver_add("influence").driver
                driver.type = "AVERAGE"
                variable = driver.variables.new()
                variable.name = expression
                variable.targets[0].id = armature
                variable.targets[0].data_path = f'pose.bones["c_foot_ik.{side}"]["ik_fk_switch"]'


def walking() -> bpy.types.Object:
    """The rig, walking on its IK controls."""
    armature = build()
    responders.key_steps(armature, "c_root_master.x", ["c_foot_ik.l", "c_foot_ik.r"])
    return armature


def switch_to_fk(armature: bpy.types.Object) -> None:
    """Let the legs follow their FK controls."""
    for side in "lr":
        armature.pose.bones[f"c_foot_ik.{side}"]["ik_fk_switch"] = 1.0
    armature.update_tag()
    bpy.context.view_layer.update()
