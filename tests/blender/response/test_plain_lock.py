"""Clean Feet against the plain lock: each planted foot frozen by an IK constraint, blended over five frames.

The hips come down for the plain lock as far as each frame wants it: else its legs do not reach what it freezes, and its
feet slide.
"""

import bpy
import numpy as np
import pytest

from softground_addon.core.legs.grounding import LegResponse, Response, leg_of, leg_soles, out_of_reach, responding
from softground_addon.core.legs.legs import solve
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.numerics.orientation import rotation_vectors
from softground_addon.core.numerics.rigid import carried, displacement, rotation
from softground_addon.core.response.clean_feet import clean, foot_faults
from tests.blender import shots
from tests.blender.response.test_clean_feet import floor_walk, read, spoil  # noqa: F401  (a fixture)

BLEND = 5
"""Frames before and after a contact in which the constraint's influence grows and falls."""


def frozen(poses, touching):
    """Poses (F, 4, 4) to which a constraint holds a foot, each from where it comes down, and its influence (F,)."""
    frames, target, influence = np.arange(len(poses)), poses.copy(), np.zeros(len(poses))
    for first, end in zip(*runs(touching), strict=True):
        off = np.maximum(np.maximum(first - frames, frames - (end - 1)), 0)
        grown = np.clip(1.0 - off / BLEND, 0.0, 1.0)
        nearer = grown > influence
        target[nearer], influence[nearer] = poses[first], grown[nearer]
    return target, influence


def plain_lock(motion, touching):
    """The response of IK constraints that freeze feet, hips let down as far as each frame wants it."""
    carries, drop = {}, np.zeros(len(motion.frames))
    for side, sole in leg_soles(motion).items():
        poses, leg = motion.soles[sole].transforms[:, 0], leg_of(motion, side, sole)
        target, influence = frozen(poses, touching[:, sole])
        whole = rotation_vectors(target[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2))
        turn = rotation(influence[:, None] * whole)
        held = carried(target @ np.linalg.inv(poses), leg.ankle)
        ankle = leg.ankle + influence[:, None] * (held - leg.ankle)
        carries[side] = leg, displacement(turn, leg.ankle, ankle), ankle
        drop = np.maximum(drop, out_of_reach(leg, leg.hip, ankle))
    down = np.array((0.0, 0.0, -1.0)) * drop[:, None]
    body = np.broadcast_to(np.eye(4), (len(drop), 4, 4)).copy()
    body[:, :3, 3] = down
    legs = {}
    for side, (leg, carry, ankle) in carries.items():
        solved = solve(leg, leg.hip + down, ankle)
        carry[:, :3, 3] += carried(solved.shank, leg.ankle) - ankle  # short of it where the leg does not reach
        legs[side] = LegResponse(solved.thigh, solved.shank, carry)
    return Response(motion.frames, body, legs, np.zeros((len(drop), 2)))


def jerk(path, step):
    """Root mean square of the third derivative."""
    change = np.diff(path.reshape(len(path), -1), 3, axis=0) / step**3
    return float(np.sqrt((change**2).sum(axis=1).mean()))


def judged(motion, touching, terrain):
    """Slide (95 %) [mm], and jerk of hips [m/s³] and knees [rad/s³]."""
    legs = [leg_of(motion, side, sole) for side, sole in leg_soles(motion).items()]
    slide = np.percentile(foot_faults(motion, touching, terrain).slide, 95) * 1e3
    hips = jerk(motion.hips, motion.time_step)
    return slide, hips, float(np.mean([jerk(leg.flexion, motion.time_step) for leg in legs]))


def check(scene, name):
    shot, touching = read(scene)
    motion = shot.motions[0]
    answers = {"source": None, "clean": clean(motion, touching, shot.terrain), "plain": plain_lock(motion, touching)}
    measures = {
        key: judged(responding(motion, answer) if answer else motion, touching, shot.terrain)
        for key, answer in answers.items()
    }
    print(
        f"\n{name}: "
        + "; ".join(f"{key} {s:.2f} mm, {h:.0f} m/s³, {k:.0f} rad/s³" for key, (s, h, k) in measures.items())
    )
    assert measures["clean"][0] < measures["plain"][0] + 1.0, "no more slide"
    assert measures["clean"][1] < measures["plain"][1], "less jerk of the hips"
    assert measures["clean"][2] < measures["plain"][2], "less jerk of the knees"


@pytest.mark.slow
def test_a_walk_that_slides_jerks_less_than_under_the_plain_lock(floor_walk):  # noqa: F811
    spoil(floor_walk, floats=0.0)
    check(floor_walk, "spoilt walk")


@pytest.mark.slow
@pytest.mark.parametrize("name", shots.MOTION_FILES)
def test_so_do_reference_motions(scene, name):
    shots.import_motion(name)
    bpy.ops.softground.add_character()
    check(scene, name)
