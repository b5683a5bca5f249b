"""Roles by names alone, where limbs are misread."""

import numpy as np
import pytest

from softground_addon.core.rig.bones import RestBone
from softground_addon.core.rig.name_mapping import map_by_names

LEG, ARM = ("thigh", "shin", "foot", "toe"), ("upper_arm", "forearm", "hand")


def mapped(names):
    """Mapping of a person, with bones called otherwise; and the bones that the joints are, by the names they had."""
    parents = {"hips": "", "spine": "hips", "neck": "spine", "head": "neck"}
    for side in "LR":
        for chain, root in ((LEG, "hips"), (ARM, "spine")):
            bones = [f"{segment}.{side}" for segment in chain]
            parents |= dict(zip(bones, [root, *bones], strict=False))
    true = {names.get(bone, bone): bone for bone in parents}
    point = np.zeros(3)
    bones = {
        new: RestBone(names.get(parents[old], parents[old]), np.eye(4), point, point, 1.0) for new, old in true.items()
    }
    mapping = map_by_names(bones, set(bones))
    return {joint: true[bone] for joint, (bone, _) in mapping.joints.items()}, [true[s.bone] for s in mapping.soles]


def swapped(bone, other):
    return {bone: other, other: bone}


EXPECTED, FEET = mapped({})


def without(*parts):
    return {joint: bone for joint, bone in EXPECTED.items() if joint not in parts}


@pytest.mark.parametrize("other", ["forearm.L", "upper_arm.L"])
def test_a_misread_arm_costs_that_arm_alone(other):
    joints, feet = mapped(swapped("hand.L", other))
    assert feet == FEET == ["foot.L", "foot.R"]
    assert joints == without("shoulder_l", "elbow_l", "wrist_l")


def test_a_misread_leg_costs_the_legs_alone():
    joints, feet = mapped(swapped("thigh.L", "foot.L"))
    assert feet == []
    assert joints == without(*(f"{joint}_{side}" for joint in ("hip", "knee", "ankle", "ball", "toe") for side in "lr"))


def test_hips_that_are_called_a_foot_cost_the_trunk_too():
    joints, feet = mapped(swapped("hips", "foot.L"))
    assert feet == []
    assert joints == {joint: bone for joint, bone in EXPECTED.items() if joint[:-2] in ("shoulder", "elbow", "wrist")}
