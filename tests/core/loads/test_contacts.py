"""When soles touch: scale-free, with hysteresis, whatever the float, on any terrain."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.motion.motion import LowSkin
from softground_addon.core.motion.sole_motion import SoleMotion
from softground_addon.core.numerics.intervals import close_short, hysteresis, runs
from tests.core.character import Slope, character, flat_sole
from tests.core.prop_bodies import prop_sole, sphere

RATE = 120.0


def hop(rate=RATE, *, scale=1.0, float_height=0.0, gravity=9.81):
    """A sole that stands 0.5 s, hops for 0.4 s in a parabola, and stands again; times scale as sqrt(scale)."""
    time = np.arange(int(1.4 * rate)) / rate
    duration = 0.4
    flight = (time > 0.5) & (time < 0.5 + duration)
    height = np.where(flight, 0.5 * 9.81 * (time - 0.5) * (0.5 + duration - time), 0.0)
    path = np.stack([np.where(flight, time - 0.5, np.where(time < 0.5, 0.0, duration)), 0 * time, height], axis=1)
    sole = flat_sole(path * scale + (0, 0, float_height))
    landmarks = sole.sole.landmarks * scale
    sole = flat_sole(path * scale + (0, 0, float_height), landmarks=landmarks)
    return character([sole], leg_length=0.9 * scale, rate=rate * np.sqrt(gravity / 9.81 / scale), gravity=gravity)


def test_a_hop_is_two_contacts_with_the_flight_between():
    touching = detect_contacts(hop(), Slope()).touching[:, 0]
    start, end = runs(touching)
    assert len(start) == 2
    assert end[0] / RATE == pytest.approx(0.5, abs=0.03)
    assert start[1] / RATE == pytest.approx(0.9, abs=0.03)


@pytest.mark.parametrize("scale", [0.03, 100.0])
def test_a_mouse_and_a_giant_touch_when_a_human_does(scale):
    human = detect_contacts(hop(), Slope()).touching
    assert np.array_equal(detect_contacts(hop(scale=scale), Slope()).touching, human)


def test_contacts_on_the_moon_are_those_of_the_same_motion_slowed_down():
    assert np.array_equal(
        detect_contacts(hop(gravity=1.62), Slope()).touching, detect_contacts(hop(), Slope()).touching
    )


@pytest.mark.parametrize("height", [-0.06, -0.02, 0.03, 0.08])
def test_a_constant_float_or_sink_is_removed_and_reported(height):
    contacts = detect_contacts(hop(float_height=height), Slope())
    assert contacts.offset[0] == pytest.approx(height, abs=1e-9)
    assert np.array_equal(contacts.touching, detect_contacts(hop(), Slope()).touching)


def test_a_sole_high_in_the_air_touches_nothing():
    contacts = detect_contacts(hop(float_height=0.5), Slope())
    assert not contacts.touching.any()
    assert contacts.offset[0] == 0.0


def test_the_terrain_carries_the_sole_at_its_own_height():
    contacts = detect_contacts(hop(float_height=3.0), Slope(height=3.0))
    assert np.array_equal(contacts.touching, detect_contacts(hop(), Slope()).touching)


def test_a_wall_and_missing_ground_bear_no_sole():
    still = character([flat_sole(np.zeros((60, 3)))])
    assert detect_contacts(still, Slope(slope=0.3)).touching.all()
    assert not detect_contacts(still, Slope(slope=3.0)).touching.any()
    assert not detect_contacts(still, Slope(edge=-1.0)).touching.any()


def test_the_normal_is_that_of_the_slope():
    contacts = detect_contacts(character([flat_sole(np.zeros((4, 3)))]), Slope(slope=0.75))
    assert np.allclose(contacts.normal, (-0.6, 0.0, 0.8))


def test_a_gap_and_a_blip_shorter_than_a_twentieth_of_a_second_close():
    path = np.zeros((120, 3))
    path[40:44, 2] = 0.3  # a tracking glitch of 33 ms while standing
    path[80:, 2] = 0.3
    path[100:104, 2] = 0.0  # and one in the air
    start, end = runs(detect_contacts(character([flat_sole(path)]), Slope()).touching[:, 0])
    assert start.tolist() == [0]
    assert end == pytest.approx([80], abs=4)


def test_one_frame_and_no_motion_at_all_are_no_errors():
    assert detect_contacts(character([flat_sole(np.zeros((1, 3)))]), Slope()).touching.tolist() == [[True]]


def test_a_slow_walk_has_swings():
    """Feet that move on at 0.27 m/s, a centimetre above the ground: slower than a human foot lands."""
    step = np.arange(1440)
    soles = []
    for phase in (0, 240):
        cycle, moment = np.divmod(step + phase, 480)
        swing = np.clip((moment - 300) / 180, 0.0, 1.0)
        x = 0.4 * (cycle + swing)
        soles.append(flat_sole(np.stack([x, 0 * x, 0.01 * np.sin(np.pi * swing)], axis=1)))
    hips = np.stack([0.1 * step / RATE, 0 * step, np.full(len(step), 0.9)], axis=1)
    touching = detect_contacts(character(soles, hips=hips, rate=RATE), Slope()).touching
    assert [len(runs(foot)[0]) for foot in touching.T] == [3, 4]


@pytest.mark.parametrize("seed", range(4))
def test_a_millimetre_of_jitter_is_no_step(seed):
    path = 0.001 * np.random.default_rng(seed).normal(size=(600, 3))
    assert detect_contacts(character([flat_sole(path)], rate=60.0), Slope()).touching.all()


def test_feet_whose_heights_disagree_about_their_ground_touch_when_their_skin_does():
    """One foot hops; the other one's toes stay down while its bones sink through the ground and rise again."""
    hopping = hop().soles[0]
    time = np.arange(len(hopping.transforms)) / RATE
    flies = hopping.transforms[:, 0, 2, 3] > 0
    dip = -0.06 * (1 + np.cos(2 * np.pi * (time - 0.7) / 1.4))
    toes = flat_sole(np.stack([0 * time, 0 * time + 0.2, dip], axis=1))
    soles = [replace(hopping, bears=~flies), replace(toes, bears=np.ones(len(time), dtype=bool))]
    motion = replace(character(soles, hips=(0.0, 0.0, 0.9), rate=RATE), ground_level=0.0)
    contacts = detect_contacts(motion, Slope())
    assert np.array_equal(contacts.touching, np.stack([~flies, np.ones_like(flies)], axis=1))
    assert contacts.offset.tolist() == [0.0, 0.0]


def test_a_limb_that_rolls_over_the_ground_touches_when_its_skin_does():
    time = np.arange(120) / RATE
    path = np.stack([2.0 * time, 0 * time, 0.1 + 0 * time], axis=1)
    transforms = np.tile(np.eye(4), (120, 1, 1, 1))
    transforms[:, 0, :3, 3] = path
    seen = np.ones(120, dtype=bool)
    seen[:30] = False
    limb = SoleMotion(prop_sole(*sphere(0.1), name="head"), transforms, bears=seen)
    foot = replace(flat_sole(np.zeros((120, 3))), bears=np.ones(120, dtype=bool))
    motion = replace(character([foot, limb], hips=(0.0, 0.0, 0.9), rate=RATE), ground_level=0.0)
    assert np.array_equal(detect_contacts(motion, Slope()).touching[:, 1], seen)


def test_a_foot_that_skids_as_it_lands_touches_from_when_its_skin_does():
    time = np.arange(180) / RATE
    height = np.maximum(0.5 - 2.0 * time, 0.0)
    skids = (height == 0) & (time < 0.45)
    along = 3.0 * np.minimum(time, 0.45)
    foot = flat_sole(np.stack([along, 0 * time, height], axis=1))
    motion = character([replace(foot, bears=height == 0)], hips=(0.0, 0.0, 0.9), rate=RATE)
    assert not detect_contacts(motion, Slope()).touching[skids].any()
    touching = detect_contacts(replace(motion, ground_level=0.0), Slope()).touching[:, 0]
    assert np.array_equal(touching, height == 0)


def test_the_skin_tells_which_soles_are_in_the_air_where_the_ground_is_level_under_it():
    steps = 240
    path = np.zeros((steps, 3))
    path[:, 0] = np.linspace(0.0, 4.0, steps)
    path[:, 2] = np.where(np.arange(steps) < 120, 0.0, 0.06)
    foot = replace(flat_sole(path), bears=path[:, 2] == 0)
    skin = LowSkin(np.arange(steps), path[:, None], np.zeros((steps, 1)), 0.3, 1.78)
    motion = replace(character([foot], hips=(0.0, 0.0, 0.9), rate=RATE), ground_level=0.0, skin=skin)
    assert np.array_equal(detect_contacts(motion, Slope()).aloft[:, 0], path[:, 2] > 0)
    assert detect_contacts(motion, Slope(slope=0.05)).aloft is None


def test_a_foot_touches_no_longer_than_its_skin_is_on_the_ground_nor_where_it_only_hangs_over_it():
    """Beside one that stands, a foot hangs just over the ground, comes down from higher up, and lifts slowly."""
    step = np.arange(360)
    height = np.interp(step, [60, 90, 120, 300, 360], [0.02, 0.1, 0.0, 0.0, 0.06])
    path = np.stack([0 * step, 0 * step, height], axis=1)
    foot = replace(flat_sole(path), bears=height < 0.015)
    stands = replace(flat_sole(np.tile((0.0, 0.3, 0.0), (360, 1))), bears=np.ones(360, dtype=bool))
    skin = LowSkin(step, np.zeros((360, 1, 3)), np.zeros((360, 1)), 0.3, 1.78)
    motion = replace(character([foot, stands], hips=(0.0, 0.0, 0.9), rate=RATE), ground_level=0.0, skin=skin)
    touching = detect_contacts(motion, Slope()).touching
    assert touching[:, 1].all()
    assert not touching[height > 0.018 * 1.78, 0].any()
    assert not touching[:60, 0].any()
    assert touching[120:300, 0].all()


@pytest.mark.parametrize("hangs", [0.0, 0.015])
def test_a_limb_that_lies_still_just_over_the_ground_touches_though_its_skin_does_not(hangs):
    down = np.maximum(1.0 - 2.0 * np.arange(180) / RATE, hangs) + 0.1
    transforms = np.tile(np.eye(4), (180, 1, 1, 1))
    transforms[:, 0, 2, 3] = down
    head = SoleMotion(prop_sole(*sphere(0.1), name="head"), transforms, bears=down < 0.1 + 0.012)
    foot = replace(flat_sole(np.zeros((180, 3))), bears=np.ones(180, dtype=bool))
    motion = replace(character([foot, head], hips=(0.0, 0.0, 0.9), rate=RATE), ground_level=0.0)
    assert detect_contacts(motion, Slope()).touching[-60:].all()


def step_beside():
    """A foot that comes in flat beside one that stands, and stops within 0.2 s; the other then leaves gently."""
    time = np.arange(360) / RATE
    arrival = np.clip((time - 0.8) / 0.2, 0.0, 1.0)
    speed = np.where(time < 0.8, 3.0, 3.0 * (1 - arrival) ** 2)
    along = np.cumsum(speed) / RATE
    leaving = np.maximum(time - 1.2, 0.0)
    front = np.stack([along - along[-1] + 0.6, 0 * time, 0.15 * (1 - np.clip(time / 0.8, 0, 1)) ** 2], axis=1)
    back = np.stack([5.0 * leaving**2, 0 * time, 3.0 * leaving**2], axis=1)
    soles = [flat_sole(path, landmarks=((0, 0, 0),)) for path in (back, front)]
    return detect_contacts(character(soles, hips=(0.3, 0.0, 0.9), rate=RATE), Slope()).touching


def test_beside_a_foot_that_bears_one_lands_as_it_slows_and_leaves_as_it_speeds_away():
    back, front = step_beside().T
    assert runs(front)[0][0] / RATE == pytest.approx(0.92, abs=0.04)  # 0.5 m/s
    assert runs(back)[1][0] / RATE == pytest.approx(1.33, abs=0.04)  # 1.5 m/s


def test_hysteresis_keeps_its_state_between_the_thresholds():
    start = np.array([0, 1, 0, 0, 0, 0, 1, 0], dtype=bool)
    stop = np.array([0, 0, 0, 1, 0, 1, 0, 0], dtype=bool)
    assert hysteresis(start, stop).astype(int).tolist() == [0, 1, 1, 0, 0, 0, 1, 1]


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(1, 6))
def test_after_closing_no_inner_run_is_short(values, shortest):
    closed = close_short(np.array(values), shortest)
    start, end = runs(closed)
    inner = (start > 0) & (end < len(closed))
    assert (end - start)[inner].min(initial=shortest) >= shortest
