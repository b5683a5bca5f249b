"""Feet on the ground that gave way, hips and legs that follow: on grounds in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.legs.foot_placement import ANKLE_PITCH, place_sole, posed_points, slide_offset, underside
from softground_addon.core.legs.grounding import Response, leg_of, leg_soles, responding, settle
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.motion.motion import CharacterMotion
from softground_addon.core.motion.sole_motion import Sole, SoleMotion
from softground_addon.core.record.ground_history import GroundHistory
from softground_addon.core.response import response
from softground_addon.core.response.response import GroundingOptions, TiltOptions, gaps, respond, stood_on
from tests.core.walkers import foot_sole, pose

RATE = 30.0
LEG = 0.92
ANKLE = 0.08


class Ground:
    """A ground over time as a function z(x, y, frame)."""

    def __init__(self, height):
        self.height = height

    def heights(self, x, y, frame=0.0):
        return self.height(x, y, frame) + 0.0 * x


def walk(frames=90, *, stride=1.2, period=1.1, heading=0.0):
    """A level walk along x in closed form: feet that stand, swing in a half sine and stand; hips above their middle."""
    times = np.arange(frames) / RATE
    soles, joints, touching = [], {}, []
    ankles = []
    for side, y, shift in (("l", 0.09, 0.0), ("r", -0.09, 0.5)):
        cycle, phase = np.divmod(times / period + shift, 1.0)
        swing = np.clip((phase - 0.62) / 0.38, 0.0, 1.0)
        eased = swing * swing * (3 - 2 * swing)
        x = stride * (cycle + eased - shift)
        z = 0.10 * np.sin(np.pi * swing) ** 2
        heel = np.stack([x - 0.07, np.full(frames, y), z], axis=-1)
        poses = pose(heel)
        soles.append(SoleMotion(foot_sole(f"foot.{side.upper()}", side.upper()), np.stack([poses, poses], axis=1)))
        joints[f"ankle_{side}"] = heel + np.array((0.07, 0.0, ANKLE))
        joints[f"ball_{side}"] = heel + np.array((0.19, 0.0, 0.02))
        ankles.append(joints[f"ankle_{side}"])
        touching.append(swing == 0.0)
    hips = np.stack([stride * times / period - 0.1 * stride, np.zeros(frames), np.full(frames, 0.90)], axis=-1)
    joints["hips"] = hips
    joints["head"] = hips + np.array((0.0, 0.0, 0.7))
    for side, y, ankle in zip("lr", (0.09, -0.09), ankles, strict=True):
        hip = hips + np.array((0.0, y, 0.0))
        along = ankle - hip
        span = np.linalg.norm(along, axis=1)
        half = (LEG - ANKLE) / 2
        offset = np.sqrt(np.maximum(half**2 - (span / 2) ** 2, 1e-4))
        forward = np.cross(np.broadcast_to((0.0, 1.0, 0.0), along.shape), along / span[:, None])
        joints[f"hip_{side}"] = hip
        joints[f"knee_{side}"] = hip + along / 2 - offset[:, None] * forward
    motion = CharacterMotion("walker", 75.0, LEG, np.arange(frames) + 1.0, RATE, tuple(soles), joints)
    return motion, np.stack(touching, axis=1)


def clearance(motion, ground, touching):
    """Height of the lowest point of each standing sole above the ground, by a denser set of points."""
    heights = []
    for index, sole in enumerate(motion.soles):
        points = posed_points(sole, underside(sole.sole, edge=0.03))
        z = ground.heights(points[..., 0], points[..., 1], motion.frames[:, None])
        heights.append((points[..., 2] - z).min(axis=1)[touching[:, index]])
    return np.concatenate(heights)


def placed(motion, touching, ground, undisturbed=None, **options):
    return {
        side: (
            sole,
            place_sole(
                motion,
                sole,
                touching[:, sole],
                ground,
                undisturbed or ground,
                **options,
            ),
        )
        for side, sole in leg_soles(motion).items()
    }


def grounded(motion, touching, ground, undisturbed=None, **options):
    level = np.zeros((len(motion.frames), 2))
    response = settle(motion, placed(motion, touching, ground, undisturbed, **options), touching, level)
    return response, responding(motion, response)


def knee_flexion(motion):
    angles = []
    for side, sole in leg_soles(motion).items():
        leg = leg_of(motion, side, sole)
        thigh, shank = leg.knee - leg.hip, leg.ankle - leg.knee
        cosine = np.sum(thigh * shank, axis=1) / np.linalg.norm(thigh, axis=1) / np.linalg.norm(shank, axis=1)
        angles.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return np.stack(angles, axis=1)


GROUNDS = {
    "sunk": lambda x, y, t: -0.06,
    "giving way": lambda x, y, t: -0.05 * np.clip((t - 20) / 40, 0, 1),
    "rising": lambda x, y, t: np.tan(np.radians(10)) * x,
    "falling": lambda x, y, t: -np.tan(np.radians(10)) * x,
    "across": lambda x, y, t: np.tan(np.radians(10)) * y,
    "hill": lambda x, y, t: 0.4 * np.exp(-(((x - 1.5) / 1.2) ** 2)),
    "bumps of 5 cm": lambda x, y, t: 0.025 * np.sin(5 * x) * np.sin(4 * y + 1) + 0.025 * np.sin(3 * x + 2 * y),
}


@pytest.mark.parametrize("kind", GROUNDS)
def test_standing_soles_lie_on_the_ground_and_legs_do_not_tear(kind):
    motion, touching = walk()
    ground = Ground(GROUNDS[kind])
    response, moved = grounded(motion, touching, ground)
    gap = np.abs(clearance(moved, ground, touching)) * 1e3
    assert np.percentile(gap, 95) < 2.0
    assert gap.max() < 5.0
    for side, sole in leg_soles(motion).items():
        before, after = leg_of(motion, side, sole), leg_of(moved, side, sole)
        assert after.length == pytest.approx(before.length, rel=1e-6)
        assert (after.extension <= np.maximum(before.extension, 0.985) + 1e-6).all()
    source = np.abs(np.diff(knee_flexion(motion), axis=0)).max()
    assert np.abs(np.diff(knee_flexion(moved), axis=0)).max() < max(15.0, 1.05 * source)
    hips = moved.joints["hips"][:, 2] - motion.joints["hips"][:, 2]
    assert np.abs(np.diff(hips, 2)).max() < 0.01, "hips move smoothly"
    assert not response.is_none


def test_a_ground_that_is_where_the_feet_are_changes_nothing():
    motion, touching = walk()
    response, moved = grounded(motion, touching, Ground(lambda x, y, t: 0.0))
    for name, path in motion.joints.items():
        assert moved.joints[name] == pytest.approx(path, abs=2e-3)
    assert isinstance(response, Response)


def test_on_a_sunken_level_the_whole_body_goes_down_by_the_depth():
    motion, touching = walk()
    _, moved = grounded(motion, touching, Ground(lambda x, y, t: -0.06))
    for name, path in motion.joints.items():
        assert moved.joints[name] - path == pytest.approx(np.broadcast_to((0, 0, -0.06), path.shape), abs=3e-3)


def test_feet_take_on_the_slope_and_no_more_than_an_ankle_can():
    motion, touching = walk()
    for degrees, expected in ((10.0, 10.0), (35.0, np.degrees(ANKLE_PITCH))):
        rise = float(np.tan(np.radians(degrees)))
        placements = placed(motion, touching, Ground(lambda x, y, t, rise=rise: rise * x))
        for sole, placement in placements.values():
            forward = (placement.carry @ motion.soles[sole].transforms[:, 0])[touching[:, sole], :3, 0]
            assert np.degrees(np.arcsin(forward[:, 2])) == pytest.approx(np.full(len(forward), expected), abs=0.5)


def test_a_foot_that_was_posed_for_the_slope_is_not_turned_again():
    motion, touching = walk()
    angle = np.radians(12)
    tilt = pose((0.0, 0.0, 0.0), pitch=angle)
    soles = tuple(SoleMotion(sole.sole, tilt @ sole.transforms) for sole in motion.soles)
    joints = {name: path @ tilt[:3, :3].T for name, path in motion.joints.items()}
    tilted = replace(motion, soles=soles, joints=joints)
    response, _ = grounded(tilted, touching, Ground(lambda x, y, t: np.tan(angle) * x))
    for leg in response.legs.values():
        assert leg.foot[:, :3, :3] == pytest.approx(np.broadcast_to(np.eye(3), leg.foot[:, :3, :3].shape), abs=0.02)


def test_swinging_feet_clear_what_is_in_their_way():
    motion, touching = walk()
    ground = Ground(lambda x, y, t: 0.10 * np.exp(-(((x - 1.0) / 0.08) ** 2)))
    _, moved = grounded(motion, touching, ground)
    for index, sole in enumerate(moved.soles):
        points = posed_points(sole)
        above = (points[..., 2] - ground.heights(points[..., 0], points[..., 1], moved.frames[:, None])).min(axis=1)
        assert above[~touching[:, index]].min() > -0.03


def test_locking_takes_the_slide_out_of_each_contact_and_jumps_nowhere():
    frames = 60
    drift = np.stack([0.3 * np.arange(frames) / RATE, 0 * np.arange(frames), 0 * np.arange(frames)], axis=-1)
    poses = pose(drift)
    sole = SoleMotion(foot_sole("foot.L", "L"), np.stack([poses, poses], axis=1))
    touching = np.zeros(frames, bool)
    touching[5:25] = touching[35:55] = True
    points = posed_points(sole)
    offset = slide_offset(points, touching)
    held = (points + offset[:, None]).mean(axis=1)
    for part in (slice(5, 25), slice(35, 55)):
        assert np.ptp(held[part], axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    assert np.linalg.norm(np.diff(offset, axis=0), axis=1).max() < 0.06
    flat = Ground(lambda x, y, t: 0.0)
    motion = CharacterMotion("walker", 75.0, LEG, np.arange(frames) + 1.0, RATE, (sole,))
    unlocked = place_sole(motion, 0, touching, flat, flat)
    assert unlocked.carry[:, :2, 3] == pytest.approx(np.zeros((frames, 2)), abs=1e-9)


def test_a_sole_that_never_touches_is_left_alone():
    motion, touching = walk()
    flat = Ground(lambda x, y, t: 1.0)
    placement = place_sole(motion, 0, np.zeros_like(touching[:, 0]), flat, flat)
    assert placement.carry == pytest.approx(np.broadcast_to(np.eye(4), placement.carry.shape))


def test_a_sole_without_an_underside_has_no_gap_to_the_ground():
    motion, touching = walk()
    remaining = gaps(
        motion, touching, GroundHistory(FlatTerrain()), lambda sole: posed_points(sole, [(0, np.empty((0, 3)))])
    )
    assert not len(remaining.heights)


def test_without_grounding_a_lean_keeps_the_feet_where_they_are():
    motion, touching = walk()
    slope = np.tan(np.radians(10))

    class Rise:
        def heights(self, x, y):
            return slope * x + 0.0 * y

    response = respond(motion, touching, GroundHistory(Rise()), tilt=TiltOptions(strength=1.0), grounding=None)
    assert np.degrees(response.lean[:, 0]) == pytest.approx(np.full(len(response.lean), 10.0), abs=0.5)
    moved = responding(motion, response)
    for side in "lr":
        assert moved.joints[f"ankle_{side}"] == pytest.approx(motion.joints[f"ankle_{side}"], abs=1e-6)
    ahead = (moved.joints["head"] - moved.joints["hips"]) - (motion.joints["head"] - motion.joints["hips"])
    assert (ahead[:, 0] > 0.1).all(), "uphill the body leans into the slope"


def test_on_rigid_level_ground_there_is_no_response():
    motion, touching = walk()
    response = respond(motion, touching, GroundHistory(FlatTerrain(0.0)), tilt=TiltOptions(), grounding=None)
    assert response.is_none
    response = respond(
        motion, touching, GroundHistory(FlatTerrain(0.0)), tilt=TiltOptions(), grounding=GroundingOptions()
    )
    assert responding(motion, response).joints["hips"] == pytest.approx(motion.joints["hips"], abs=2e-3)


@pytest.mark.parametrize("size", [0.05, 1.0, 20.0])
def test_characters_of_all_sizes_respond_alike(size):
    """The same ground and motion in another size, at the pace that gravity gives it."""
    motion, touching = walk()
    plain, _ = grounded(motion, touching, Ground(GROUNDS["hill"]))
    soles = []
    for sole in motion.soles:
        transforms = sole.transforms.copy()
        transforms[..., :3, 3] *= size
        soles.append(SoleMotion(_scaled(sole.sole, size), transforms))
    big = CharacterMotion(
        "walker",
        75.0,
        LEG * size,
        motion.frames,
        RATE / np.sqrt(size),
        tuple(soles),
        {name: path * size for name, path in motion.joints.items()},
    )
    ground = Ground(lambda x, y, t: size * GROUNDS["hill"](x / size, y / size, t))
    placements = {
        side: (
            index,
            place_sole(big, index, touching[:, index], ground, ground),
        )
        for side, index in leg_soles(big).items()
    }
    scaled = settle(big, placements, touching, np.zeros((len(big.frames), 2)))
    assert scaled.body[:, 2, 3] / size == pytest.approx(plain.body[:, 2, 3], abs=4e-3)


def _scaled(sole, size):
    patches = tuple(
        replace(
            patch,
            heights=patch.heights * size,
            signed_distance=patch.signed_distance * size,
            origin=patch.origin * size,
            spacing=patch.spacing * size,
        )
        for patch in sole.patches
    )
    return Sole(sole.name, sole.side, patches, sole.landmarks * size, sole.landmark_patch, sole.outline * size)


def test_a_walk_made_for_level_ground_is_put_on_a_hill_and_one_made_for_the_hill_is_left():
    motion, touching = walk()

    class Hill:
        def heights(self, x, y):
            return GROUNDS["hill"](x, y, 0.0)

    assert stood_on(motion, FlatTerrain(0.0)) is motion
    standing = stood_on(motion, Hill())
    assert standing is not motion
    gap = clearance(standing, Ground(GROUNDS["hill"]), touching)
    assert np.percentile(np.abs(gap), 90) < 0.01
    assert stood_on(standing, Hill()) is standing


def test_contacts_are_looked_for_once_with_each_ground_that_a_walk_may_be_made_for(monkeypatch):
    motion, _ = walk()
    grounds = []

    def counted(of, terrain):
        grounds.append(terrain)
        return detect_contacts(of, terrain)

    class Hill:
        def heights(self, x, y):
            return GROUNDS["hill"](x, y, 0.0)

    monkeypatch.setattr(response, "detect_contacts", counted)
    stood_on(motion, FlatTerrain(0.0))
    assert not grounds, "level ground asks nothing"
    stood_on(motion, Hill())
    assert [type(ground) for ground in grounds] == [FlatTerrain, Hill]


def test_a_leg_stands_on_the_snowshoe_that_it_wears_and_no_hand_is_a_foot():
    motion, _ = walk(30)
    below = np.eye(4)
    below[2, 3] = -0.04
    shoes = tuple(
        SoleMotion(replace(s.sole, name=f"shoe {s.sole.side}", side=""), below @ s.transforms) for s in motion.soles
    )
    hand = motion.soles[0].transforms.copy()
    hand[..., 2, 3] += 0.9
    hands = (SoleMotion(replace(motion.soles[0].sole, name="hand.L"), hand),)
    equipped = replace(motion, soles=(*motion.soles, *shoes, *hands))
    assert leg_soles(motion) == {"l": 0, "r": 1}
    assert leg_soles(equipped) == {"l": 2, "r": 3}
    touching = np.ones((30, 5), bool)
    sunk = Ground(lambda x, y, t: -0.10)
    _, moved = grounded(equipped, touching, sunk)
    for foot, shoe in ((0, 2), (1, 3)):
        before = np.linalg.inv(equipped.soles[foot].transforms) @ equipped.soles[shoe].transforms
        after = np.linalg.inv(moved.soles[foot].transforms) @ moved.soles[shoe].transforms
        assert after == pytest.approx(before, abs=1e-6)
