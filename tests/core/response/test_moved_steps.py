"""Feet that follow moved and turned steps, on a closed-form walk over level ground."""

from types import SimpleNamespace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.legs.grounding import leg_of, leg_soles, responding
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.record.ground_history import GroundHistory
from softground_addon.core.response.moved_steps import DEEPEST, follow
from softground_addon.core.response.response import GroundingOptions, respond
from tests.core.legs.test_grounding import walk

FLOOR = FlatTerrain(0.0)
MOVE, TURN = (0.10, 0.06), 20.0


def prints_of(motion, touching):
    """The print of each contact."""
    prints = []
    for number, sole in enumerate(motion.soles):
        for first, end in zip(*runs(touching[:, number]), strict=True):
            place = sole.landmark_positions()[first:end].mean(axis=(0, 1))
            ends = {"start_frame": motion.frames[first] - 0.3, "end_frame": motion.frames[end - 1] + 0.3}
            prints.append(SimpleNamespace(character=motion.name, sole=sole.sole.name, position=place, **ends))
    return prints


def second_of(prints, name):
    return [each for each in prints if each.sole == name][1]


def followed_by(edit, name="foot.L"):
    """The walk with that edit of a foot's second step, the source, the step, and what was out of reach."""
    motion, touching = walk()
    prints = prints_of(motion, touching)
    step = second_of(prints, name)
    followed = follow(motion, touching, prints, {step_id(step): edit})
    plain = respond(motion, touching, GroundHistory(FLOOR), tilt=None, grounding=GroundingOptions())
    answer = respond(motion, touching, GroundHistory(FLOOR), tilt=None, grounding=GroundingOptions(), followed=followed)
    return responding(motion, plain), responding(motion, answer), step, followed


def contact(motion, step):
    return (motion.frames > step.start_frame) & (motion.frames < step.end_frame)


def sole_points(motion, name):
    return next(sole for sole in motion.soles if sole.sole.name == name).landmark_positions()


def test_nobody_follows_a_copy():
    motion, touching = walk()
    prints = prints_of(motion, touching)
    copy = {step_id(second_of(prints, "foot.L"), 1): StepEdit(move_m=MOVE)}
    assert follow(motion, touching, prints, copy).carries == {}


@pytest.mark.parametrize("foot", ["foot.L", "foot.R"])
def test_the_foot_stands_where_its_step_was_moved_and_turned_to(foot):
    plain, moved, step, followed = followed_by(StepEdit(move_m=MOVE, turn_deg=TURN), foot)
    cosine, sine = np.cos(np.radians(TURN)), np.sin(np.radians(TURN))
    from_pivot = (sole_points(plain, foot) - step.position)[..., :2]
    wanted = from_pivot @ np.array([[cosine, sine], [-sine, cosine]]) + step.position[:2] + MOVE
    stands = contact(plain, step)
    now = sole_points(moved, foot)
    np.testing.assert_allclose(now[stands][..., :2], wanted[stands], atol=1e-3)
    np.testing.assert_allclose(now[stands][..., 2], sole_points(plain, foot)[stands][..., 2], atol=1e-3)
    assert followed.out_of_reach == ()


def test_all_other_contacts_stay_where_they_are():
    plain, moved, step, _ = followed_by(StepEdit(move_m=MOVE, turn_deg=TURN))
    _, touching = walk()
    for number, sole in enumerate(plain.soles):
        others = touching[:, number] & ~(contact(plain, step) & (sole.sole.name == step.sole))
        toes = (sole_points(moved, sole.sole.name) - sole_points(plain, sole.sole.name))[others, -1, :2]
        assert np.abs(toes).max() < 4e-3, "heels rise where the hips go ahead"


def test_the_swings_before_and_after_ease_there_and_back():
    plain, moved, _, _ = followed_by(StepEdit(move_m=MOVE))
    off = (sole_points(moved, "foot.L") - sole_points(plain, "foot.L"))[:, 1, :2] @ MOVE / np.dot(MOVE, MOVE)
    swing = runs(np.abs(off - np.rint(off)) > 1e-2)
    lengths = np.subtract(*swing[::-1])
    assert len(lengths) == 2
    assert np.abs(np.diff(off)).max() < 1.6 / lengths.min(), "a cubic is steepest by 1.5"
    assert off.min() > -0.01
    assert off.max() < 1.01


def test_the_hips_go_along_in_part_and_smoothly():
    plain, moved, step, _ = followed_by(StepEdit(move_m=MOVE))
    along = (moved.hips - plain.hips)[:, :2] @ MOVE / np.dot(MOVE, MOVE)
    assert 0.2 < along.max() < 1.0
    assert along[contact(plain, step)].max() == along.max()
    assert np.abs(along[[0, -1]]).max() < 0.02
    assert np.abs(np.diff(along)).max() < 0.06


def test_the_leg_keeps_its_lengths():
    _, moved, _, _ = followed_by(StepEdit(move_m=MOVE, turn_deg=TURN))
    source, _ = walk()
    for side, sole in leg_soles(source).items():
        before, after = leg_of(source, side, sole), leg_of(moved, side, sole)
        np.testing.assert_allclose(after.thigh, before.thigh, atol=1e-9)
        np.testing.assert_allclose(after.shank, before.shank, atol=1e-9)


def test_a_step_beyond_the_leg_is_followed_as_far_as_it_goes_and_named():
    far = (0.0, 1.5)
    plain, moved, step, followed = followed_by(StepEdit(move_m=far))
    (short,) = followed.out_of_reach
    assert short.step == step_id(step)
    assert 0.1 < short.part < 0.7
    stands = contact(plain, step)
    went = (sole_points(moved, "foot.L") - sole_points(plain, "foot.L"))[stands][..., 1]
    np.testing.assert_allclose(went, short.part * far[1], atol=0.03)
    assert (plain.hips - moved.hips)[:, 2].max() < (DEEPEST + 0.05) * plain.leg_length


def test_muted_steps_and_those_of_others_are_not_followed():
    motion, touching = walk()
    prints = prints_of(motion, touching)
    muted = {step_id(prints[1]): StepEdit(mute=True, move_m=MOVE)}
    assert not follow(motion, touching, prints, muted).carries
    other = [SimpleNamespace(**{**vars(step), "character": "Other"}) for step in prints]
    assert not follow(motion, touching, other, {step_id(other[1]): StepEdit(move_m=MOVE)}).carries
    deeper = {step_id(prints[1]): StepEdit(strength=2.0)}
    assert not follow(motion, touching, prints, deeper).carries
