"""Contacts that are held by the heel, by the ball, flat, as a whole, or less: on a walk that slides and rolls."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.legs.foot_lock import underside_on
from softground_addon.core.legs.grounding import responding
from softground_addon.core.motion.sole_motion import SoleMotion
from softground_addon.core.numerics.orientation import rotation_vectors
from softground_addon.core.numerics.rigid import displacement, rotation
from softground_addon.core.record.ground_history import GroundHistory
from softground_addon.core.response.clean_feet import clean, foot_faults, missed_holds, standing
from softground_addon.core.response.foot_holds import MODES, FootHold, HeldContacts
from tests.core.legs.test_grounding import walk

FLOOR = FlatTerrain(0.0)
HEEL, BALL, TOE = range(3)


@pytest.fixture(scope="module")
def sliding():
    """The walk with feet that slide 3 cm, roll by 12 degrees and turn by 6 in half a second, and when they touch."""
    motion, touching = walk()
    swing = np.sin(2 * np.pi * np.arange(len(motion.frames)) / 15.0)
    soles = []
    for sole in motion.soles:
        turn = rotation(np.radians([0.0, 12.0, 6.0]) * swing[:, None])
        middle = sole.landmark_positions().mean(axis=1)
        spoil = displacement(turn, middle, middle + swing[:, None] * (0.03, 0.01, 0.0))
        soles.append(SoleMotion(sole.sole, spoil[:, None] @ sole.transforms))
    return replace(motion, soles=tuple(soles)), touching


def second_contact(motion, touching):
    """Frames of the left foot's second contact."""
    at = np.flatnonzero(np.diff(touching[:, 0].astype(int)) == 1)[0] + 1
    end = at + np.argmin(touching[at:, 0])
    return slice(int(at), int(end))


def cleaned(sliding, *holds):
    motion, touching = sliding
    answer = clean(motion, touching, FLOOR, holds)
    return responding(motion, answer)


def held(sliding, mode, **options):
    """The left sole after Clean Feet with its second contact held in a mode, in the frames of that contact."""
    during = second_contact(*sliding)
    after = cleaned(sliding, FootHold("foot.L", sliding[0].frames[during][2], mode, **options))
    return after.soles[0].landmark_positions()[during], after.soles[0].transforms[during, 0]


def along(sole, way):
    """A sole that is carried by a way (F, 3) as well."""
    poses = sole.transforms.copy()
    poses[..., :3, 3] += way[:, None]
    return replace(sole, transforms=poses)


def level_travel(places):
    return np.linalg.norm(places[:, :2] - places[0, :2], axis=1).max()


@pytest.mark.parametrize(("mode", "landmark"), [("HEEL", HEEL), ("BALL", BALL)])
def test_heel_or_ball_stays_and_the_others_go_round_it(sliding, mode, landmark):
    places, _ = held(sliding, mode)
    assert level_travel(places[:, landmark]) < 3e-3  # the rim's nearest point stays; the landmark is beside it
    assert level_travel(places[:, TOE if landmark == HEEL else HEEL]) > 5e-3


def test_a_foot_that_is_held_flat_lies_on_the_floor_all_the_time(sliding):
    places, pose = held(sliding, "FLAT")
    assert np.abs(pose[:, 2, 2] - 1.0).max() < 1e-9
    assert np.abs(places[..., 2]).max() < 1e-3
    assert level_travel(places[:, HEEL]) < 1e-3


def test_a_foot_that_is_held_as_a_whole_does_not_move(sliding):
    during = second_contact(*sliding)
    places, pose = held(sliding, "FULL")
    assert np.abs(places - places[0]).max() < 1e-6
    source = sliding[0].soles[0].transforms[during, 0]
    turned = [np.abs(rotation_vectors((each[:3, :3].T @ pose[0, :3, :3])[None])).max() for each in source]
    assert min(turned) < np.radians(3.0), "it is held as it was in one of its frames, but for the lock's turn"


def test_nothing_else_changes_but_the_way_to_that_contact(sliding):
    motion, touching = sliding
    during = second_contact(*sliding)
    plain, other = cleaned(sliding), cleaned(sliding, FootHold("foot.L", motion.frames[during][2], "FULL"))
    same = touching[:, 0].copy()
    same[during] = False
    np.testing.assert_allclose(other.soles[0].transforms[same], plain.soles[0].transforms[same], atol=1e-7)


def test_what_bears_is_what_is_held_by_default(sliding):
    during = second_contact(*sliding)
    plain = cleaned(sliding)
    hold = FootHold("foot.L", sliding[0].frames[during][2])
    np.testing.assert_array_equal(plain.soles[0].transforms, cleaned(sliding, hold).soles[0].transforms)


def test_strength_goes_from_the_source_to_the_hold(sliding):
    motion, _ = sliding
    during = second_contact(*sliding)
    source = motion.soles[0].transforms[during, 0]
    moved = [np.abs(held(sliding, "FULL", strength=part)[1] - source).max() for part in (0.0, 0.5, 1.0)]
    assert moved[0] < 1e-7
    assert moved[1] == pytest.approx(moved[2] / 2, rel=0.1)


def test_an_eased_contact_comes_to_rest_later_and_leaves_earlier(sliding):
    still, _ = held(sliding, "FULL")
    eased, _ = held(sliding, "FULL", ease_in=3, ease_out=2)
    assert np.abs(still[3:-2] - still[3]).max() < 1e-6
    assert np.abs(eased[3:-2] - eased[3]).max() < 1e-6
    assert level_travel(eased[:4, HEEL]) > 1e-3
    assert level_travel(eased[-3:, HEEL]) > 1e-3


@pytest.fixture(scope="module")
def lunging(sliding):
    """The sliding walk with a left foot that goes 30 cm aside in six frames of its second contact, and stays there."""
    motion, touching = sliding
    at = second_contact(motion, touching).start + 5
    part = np.clip((np.arange(len(motion.frames)) - at) / 6.0, 0.0, 1.0)
    way = (part * part * (3 - 2 * part))[:, None] * (0.0, 0.3, 0.0)
    joints = motion.joints | {f"{each}_l": motion.joints[f"{each}_l"] + way for each in ("ankle", "ball")}
    left, right = motion.soles
    return replace(motion, soles=(along(left, way), right), joints=joints), touching


def test_a_foot_that_goes_along_the_floor_on_purpose_stands_before_and_after_and_gets_there(lunging):
    motion, touching = lunging
    during = second_contact(motion, touching)
    stands = standing(motion, touching, FLOOR)
    assert (touching & ~stands)[:, 1].sum() == 0, "the other foot stands"
    gone = np.flatnonzero(touching[:, 0] & ~stands[:, 0]) - during.start
    assert (gone[0], gone[-1]) == pytest.approx((6, 10), abs=1)
    after = cleaned(lunging)
    places = after.soles[0].landmark_positions()[during, HEEL]
    assert places[-1, 1] - places[0, 1] == pytest.approx(0.3, abs=0.04)
    assert foot_faults(after, touching, FLOOR, stands).slide.max() < 3e-3
    assert foot_faults(motion, touching, FLOOR, stands).slide.max() > 0.02
    assert foot_faults(after, touching, FLOOR).penetration.max() < 1e-6, "it is on the floor all the way"


def test_a_foot_lock_holds_what_travels(lunging):
    motion, touching = lunging
    during = second_contact(motion, touching)
    hold = FootHold("foot.L", motion.frames[during][2], "FULL")
    np.testing.assert_array_equal(standing(motion, touching, FLOOR, (hold,)), touching)
    places = cleaned(lunging, hold).soles[0].landmark_positions()[during]
    assert np.abs(places - places[0]).max() < 1e-6


@pytest.mark.parametrize("skid", [-0.3, 0.3])
def test_a_walk_that_skids_as_its_travel_is_scaled_wrongly_is_held(sliding, skid):
    motion, touching = sliding
    way = skid * (motion.hips - motion.hips[0]) * (1.0, 0.0, 0.0)
    soles = tuple(along(sole, way) for sole in motion.soles)
    scaled = replace(motion, soles=soles, joints={name: path + way for name, path in motion.joints.items()})
    np.testing.assert_array_equal(standing(scaled, touching, FLOOR), touching)


def test_a_foot_that_drifts_far_in_one_contact_is_let_go_however_slowly(sliding):
    motion, touching = sliding
    touching = np.ones_like(touching)
    seconds, count = np.arange(len(touching))[:, None] / motion.frame_rate, len(touching)
    joints = {name: np.repeat(path[:1], count, axis=0) for name, path in motion.joints.items()}
    soles = []
    for side, sole, speed in zip("lr", motion.soles, (0.12, 0.2), strict=True):
        way = seconds * (speed, 0.0, 0.0)
        soles.append(along(replace(sole, transforms=np.repeat(sole.transforms[:1], count, axis=0)), way))
        joints[f"ankle_{side}"] = joints[f"ankle_{side}"] + way
    stands = standing(replace(motion, soles=tuple(soles), joints=joints), touching, FLOOR)
    assert stands[:, 0].all(), "by 0.36 m in three seconds"
    assert not stands[:, 1].any(), "by 0.6 m, with legs of 0.92 m"


def test_skates_are_let_go():
    motion, touching = walk()
    way = np.arange(len(motion.frames))[:, None] / motion.frame_rate * (2.0, 0.0, 0.0)
    still = (replace(sole, transforms=np.repeat(sole.transforms[:1], len(way), axis=0)) for sole in motion.soles)
    joints = {name: path[:1] + way for name, path in motion.joints.items()}
    skating = replace(motion, soles=tuple(along(sole, way) for sole in still), joints=joints)
    touching = np.ones_like(touching)
    assert not standing(skating, touching, FLOOR).any()
    assert clean(skating, touching, FLOOR).is_none


def test_easing_that_is_longer_than_the_contact_holds_one_frame():
    touching = np.array([False, True, True, True, True, False])
    frames = np.arange(6.0)
    contacts = HeldContacts.of([FootHold("f", 2, ease_in=9, ease_out=9)], "f", frames, touching)
    assert contacts.held(frames, touching).sum() == 1


def test_holds_that_hold_nothing_are_told(sliding):
    motion, touching = sliding
    swings = float(motion.frames[np.flatnonzero(~touching[:, 0])[0]])
    hold = FootHold("foot.L", motion.frames[second_contact(*sliding)][2])
    nowhere = (FootHold("foot.L", swings), FootHold("paw", 3.0), FootHold("foot.L", 1e6))
    assert set(missed_holds(motion, touching, (hold, *nowhere))) == set(nowhere)
    np.testing.assert_array_equal(cleaned(sliding, *nowhere).soles[0].transforms, cleaned(sliding).soles[0].transforms)


@pytest.mark.parametrize("mode", MODES)
def test_feet_stand_on_the_floor_however_they_are_held(sliding, mode):
    during = second_contact(*sliding)
    hold = FootHold("foot.L", sliding[0].frames[during][2], mode, ease_in=2)
    after = cleaned(sliding, hold)
    lowest = underside_on(after.soles[0], GroundHistory(FLOOR), after.frames).lowest()
    assert np.abs(lowest[sliding[1][:, 0]]).max() < 1e-6


def test_rotation_vectors_agree_with_scipy():
    turns = Rotation.random(200, random_state=1)
    few = Rotation.from_rotvec([[0, 0, 0], [1e-9, 0, 0], [np.pi - 1e-9, 0, 0], [0, -1e-5, 1e-5]])
    for known in (turns, few):
        np.testing.assert_allclose(rotation_vectors(known.as_matrix()), known.as_rotvec(), atol=1e-7)
