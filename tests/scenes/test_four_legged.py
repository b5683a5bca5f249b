"""A dog that walks and trots: the order of its paws, where they stand, and how they share the weight."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from sample_scenes.balance import GRAVITY
from sample_scenes.body import SIDES
from sample_scenes.course import Course
from sample_scenes.dog import FRONT_SHARE, Dog
from sample_scenes.four_legged import LEGS, TROT, WALK, go_on_four_legs
from sample_scenes.motion import joint_paths
from tests.scenes.estimates import vertical_in_body_weights, whole_strides

RATE = 240.0
GAITS = {"walk": WALK, "trot": TROT}
DOGS = {"shepherd": Dog(), "small": Dog(withers=0.35, mass=7.0), "wolfhound": Dog(withers=0.86, mass=60.0)}


@pytest.fixture(params=GAITS)
def gait(request):
    return GAITS[request.param]


@pytest.fixture(params=DOGS)
def dog(request):
    return DOGS[request.param]


def at_equal_froude(gait, dog):
    return dataclasses.replace(gait, speed=gait.speed * (dog.withers / Dog().withers) ** 0.5)


def paw_points(body, motion, leg):
    """Rear and front edge of a paw's pads over time, (F, 3) each."""
    bone, joint = ("foot", "paw") if leg[0] == "H" else ("hand", "forepaw")
    side, paw = leg[-1], body.paw
    place = joint_paths(body, motion)[f"{joint}.{side}"]
    turn = motion.turns[f"{bone}.{side}"]
    return [place + turn @ (along, 0.0, -paw.ankle_height) for along in (paw.heel, paw.toe)]


def test_a_walk_lands_its_paws_one_by_one_in_lateral_sequence():
    falls = go_on_four_legs(Dog(), WALK, 600, RATE).footfalls
    order = "".join(fall.side for fall in falls)
    assert order in "HLFLHRFR" * 20  # Hildebrand (1965): each hind paw is followed by the fore paw of its side
    assert np.diff([fall.strike for fall in falls]).min() > 0.15 * WALK.stride_time(Dog())


def test_a_trot_lands_diagonal_pairs_together():
    falls = go_on_four_legs(Dog(), TROT, 480, RATE).footfalls
    pairs = {}
    for fall in falls:
        pairs.setdefault(round(fall.strike, 6), set()).add(fall.side)
    assert all(pair in ({"HL", "FR"}, {"HR", "FL"}) for pair in pairs.values())
    inside = list(pairs.values())
    assert all(a != b for a, b in pairwise(inside))


def test_a_walk_stands_on_two_to_four_paws_and_a_trot_on_two_or_none():
    for gait, expected in ((WALK, {2, 3, 4}), (TROT, {0, 2})):
        motion = go_on_four_legs(Dog(), gait, 480, RATE)
        times = np.arange(120, 360) / RATE
        down = sum(((times > f.strike) & (times < f.leave)).astype(int) for f in motion.footfalls)
        assert set(down) <= expected


def test_planted_paws_do_not_slide_or_sink(dog, gait):
    motion = go_on_four_legs(dog, at_equal_froude(gait, dog), 360, RATE)
    times = np.arange(360) / RATE
    for leg in LEGS:
        for path in paw_points(dog, motion, leg):
            assert path[:, 2].min() > -1e-3
            for fall in motion.footfalls:
                stance = (times > fall.strike) & (times < fall.leave) & (path[:, 2] < 1e-4)
                if fall.side == leg and stance.any():
                    assert np.ptp(path[stance, :2], axis=0).max() < 1e-3


def test_legs_reach_the_ground_without_snapping_straight(dog, gait):
    motion = go_on_four_legs(dog, at_equal_froude(gait, dog), 360, RATE)
    paths = joint_paths(dog, motion)
    times = np.arange(360) / RATE
    for side in SIDES:
        for leg, bones, ends in (
            ("H", ("thigh", "shin"), ("hip", "hock")),
            ("F", ("upper_arm", "forearm"), ("shoulder", "wrist")),
        ):
            heads = [dog.bones[f"{bone}.{side}"][:2] for bone in bones]
            length = sum(np.linalg.norm(dog.joints[b] - dog.joints[a]) for a, b in heads)
            span = np.linalg.norm(paths[f"{ends[0]}.{side}"] - paths[f"{ends[1]}.{side}"], axis=1)
            planted = np.zeros(360, dtype=bool)
            for fall in motion.footfalls:
                planted |= (fall.side == leg + side) & (times >= fall.strike) & (times <= fall.leave)
            assert span[planted].max() < 0.99 * length
            assert span.min() > 0.3 * length


def test_joints_bend_the_way_a_dogs_do(gait):
    dog = Dog()
    paths = joint_paths(dog, go_on_four_legs(dog, gait, 240, RATE))
    for side in SIDES:
        knee, elbow = (
            np.cross(paths[b] - paths[a], paths[c] - paths[b])[:, 1]
            for a, b, c in (
                (f"hip.{side}", f"knee.{side}", f"hock.{side}"),
                (f"shoulder.{side}", f"elbow.{side}", f"wrist.{side}"),
            )
        )
        assert (knee > 0).all()  # forward
        assert (elbow < 0).all()  # backward


def test_the_trunk_falls_freely_in_the_trots_flight_and_bears_two_body_weights_in_between():
    dog = Dog()
    stride = TROT.stride_time(dog)
    motion = go_on_four_legs(dog, TROT, 481, 480 / stride, start_phase=0.0)
    centre = motion.hips + motion.turns["hips"] @ (dog.centre - dog.joints["hips"])
    force = 1 + np.diff(centre[:, 2], 2) * (480 / stride) ** 2 / GRAVITY
    phase = np.arange(1, 480) / 480
    airborne = np.mod(phase, 0.5) > TROT.duty_factor + 0.01
    airborne &= np.mod(phase, 0.5) < 0.49
    assert np.abs(force[airborne]).max() < 0.02
    assert force.mean() == pytest.approx(1.0, abs=0.01)
    assert 1.6 < force.max() < 2.2


def test_a_dog_follows_a_course_over_a_hill():
    def hill(x, y):
        return 0.4 * np.exp(-((x - 2.0) ** 2 + y**2) / 2.0)

    dog, course = Dog(), Course([(0, 0), (2, 0), (4, 1.0)], hill)
    motion = go_on_four_legs(dog, WALK, 900, RATE, course=course)
    for leg in LEGS:
        for path in paw_points(dog, motion, leg):
            assert (path[:, 2] - hill(path[:, 0], path[:, 1])).min() > -3e-3
    assert motion.hips[:, 2].max() - motion.hips[0, 2] == pytest.approx(0.38, abs=0.05)


class TestInBlender:
    @pytest.fixture
    def loads(self, scene, gait):
        from sample_scenes.character import create_character
        from sample_scenes.keys import write_action
        from softground_addon.blender.jobs import run
        from softground_addon.blender.rigs.rig_mapping import map_rig
        from softground_addon.blender.sampling.rig_sampling import sample_character
        from softground_addon.blender.sampling.take import Take
        from softground_addon.core.ground.heightfield import FlatTerrain
        from softground_addon.core.loads.estimate import estimate_loads
        from softground_addon.core.rig.mapping import RigMapping, SoleSource
        from tests.scenes.estimates import SNOW

        dog = Dog()
        armature = create_character("Dog", dog, scene.collection)
        write_action(armature, go_on_four_legs(dog, gait, 120, 60.0), "Gait", first_frame=0)
        scene.render.fps = 60
        soles = [
            SoleSource(f"{bone}.{side}", side, bone=f"{bone}.{side}") for bone in ("foot", "hand") for side in SIDES
        ]
        mapping = RigMapping(map_rig(armature).joints, tuple(soles))
        sampled = run(sample_character(Take.about(armature, scene, range(120)), armature, mapping, mass=dog.mass))
        return estimate_loads(sampled, FlatTerrain(0.0), force_model="WHOLE_BODY", material=SNOW)

    @pytest.mark.slow
    def test_the_add_on_takes_it_for_an_animal(self, loads):
        assert loads.motion.four_legged

    @pytest.mark.slow
    def test_the_add_on_finds_one_body_weight_on_paws_that_bear_in_turn(self, loads, gait):
        vertical = vertical_in_body_weights(loads)
        strides = whole_strides(loads, gait.stride_time(Dog()))
        mean = vertical[strides].mean(axis=0)
        assert mean.sum() == pytest.approx(1.0, abs=0.04)
        assert mean[0] == pytest.approx(mean[1], abs=0.04)
        assert mean[2] == pytest.approx(mean[3], abs=0.04)
        assert mean[2:].sum() / mean.sum() == pytest.approx(FRONT_SHARE, abs=0.08)
        duty = loads.contacts.touching[strides].mean(axis=0)
        assert duty == pytest.approx(gait.duty_factor, abs=0.09)
