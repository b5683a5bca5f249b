"""A cartwheel: foot, hand, hand, foot, foot; each stays where it is put while it bears."""

import numpy as np
import pytest

from sample_scenes.balance import GRAVITY, mass_centre
from sample_scenes.body import SIDES, Body, Foot
from sample_scenes.cartwheel import cartwheel
from sample_scenes.motion import joint_paths
from tests.scenes.kinematics import knee_flexion, largest_slide, sole_points

RATE = 120.0
BODIES = {"average": Body(), "child": Body(1.3, 29.0, Foot(0.20, 0.075)), "tall": Body(2.0, 95.0, Foot(0.31, 0.11))}


@pytest.fixture(params=BODIES)
def body(request):
    return BODIES[request.param]


@pytest.fixture
def motion(body):
    return cartwheel(body, frame_rate=RATE)


def planted_wrists(body, motion):
    """Frames at which each wrist stands still near the ground."""
    paths = joint_paths(body, motion)
    result = {}
    for side in SIDES:
        wrist = paths[f"wrist.{side}"]
        still = np.linalg.norm(np.gradient(wrist, 1 / RATE, axis=0), axis=1) < 1e-6
        result[side] = np.flatnonzero(still & (wrist[:, 2] < 0.05 * body.stature))
    return result


def test_feet_and_hands_come_down_in_the_order_of_a_cartwheel(body, motion):
    hands = planted_wrists(body, motion)
    landings = [(fall.strike, f"foot {fall.side}") for fall in motion.footfalls if fall.strike > 0]
    landings += [(frames[0] / RATE, f"hand {side}") for side, frames in hands.items()]
    assert [name for _, name in sorted(landings)] == ["foot L", "hand L", "hand R", "foot R", "foot L"]


def test_hands_bear_for_a_third_of_a_second_without_sliding(body, motion):
    paths = joint_paths(body, motion)
    for side, frames in planted_wrists(body, motion).items():
        assert np.diff(frames).max() == 1
        assert 0.25 < len(frames) / RATE < 0.6
        for joint in ("wrist", "fingertips"):
            assert np.ptp(paths[f"{joint}.{side}"][frames], axis=0).max() < 1e-3


def test_something_is_on_the_ground_all_the_time(body, motion):
    hands = planted_wrists(body, motion)
    for frame in range(len(motion.hips)):
        time = frame / RATE
        feet = any(fall.strike <= time <= fall.leave for fall in motion.footfalls)
        assert feet or any(frame in frames for frames in hands.values())


def test_feet_stay_where_they_are_set_and_knees_bend_one_way(body, motion):
    assert largest_slide(body, motion) < 1e-3
    for points in sole_points(body, motion).values():
        assert min(path[:, 2].min() for path in points.values()) > -0.01 * body.stature
    for side in SIDES:
        flexion = knee_flexion(motion, side)
        assert flexion.min() > 2.0
        assert np.abs(np.diff(flexion)).max() * RATE < 1500.0


def test_the_body_turns_over_once_to_the_left(body, motion):
    up = motion.turns["chest"][:, :, 2]
    over = np.unwrap(np.arctan2(up[:, 1], up[:, 2]))
    assert over[-1] - over[0] == pytest.approx(2 * np.pi, abs=0.05)
    legs = joint_paths(body, motion)
    highest = min(legs["ankle.L"][:, 2].max(), legs["ankle.R"][:, 2].max())
    assert highest > 0.8 * body.stature
    assert up[:, 2].min() < -0.98


def test_limbs_can_bear_the_forces(body, motion):
    height = mass_centre(body, motion)[:, 2]
    force = 1 + np.diff(height, 2) * RATE**2 / GRAVITY
    assert force.mean() == pytest.approx(1.0, abs=0.01)
    assert force.min() > 0.2
    assert force.max() < 2.2


@pytest.mark.slow
def test_hands_lie_on_the_ground_and_nothing_goes_through_it(scene):
    import bpy

    from sample_scenes.character import create_character
    from sample_scenes.keys import write_action

    body = Body()
    armature = create_character("Gymnast", body, scene.collection)
    motion = cartwheel(body)
    write_action(armature, motion, "Cartwheel", first_frame=0)
    skin = armature.children[0]
    groups = [group.name for group in skin.vertex_groups]
    owner = np.array([groups[max(v.groups, key=lambda g: g.weight).group] for v in skin.data.vertices])
    for frame in range(0, len(motion.hips), 2):
        scene.frame_set(frame)
        posed = skin.evaluated_get(bpy.context.evaluated_depsgraph_get())
        places = np.empty(len(owner) * 3, dtype=np.float32)
        posed.data.attributes["position"].data.foreach_get("vector", places)
        height = places.reshape(-1, 3)[:, 2]
        assert height.min() > -0.02
        if 1.16 < frame / 24 < 1.28:  # both hands are down, the feet are not
            assert height[owner == "hand.L"].min() == pytest.approx(0.0, abs=6e-3)
            assert height[owner == "hand.R"].min() == pytest.approx(0.0, abs=6e-3)
            assert height[np.char.startswith(owner, "foot")].min() > 0.8
            assert height[owner == "head"].min() > 0.01
