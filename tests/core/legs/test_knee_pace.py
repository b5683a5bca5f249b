"""Hips and swinging feet that give way where a knee would turn too fast."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.legs.knee_pace import PacedLeg, relieve
from softground_addon.core.legs.legs import Leg

RATE = 30.0
THIGH, SHANK = 0.45, 0.43
PER_FRAME = 15.0
"""What the knees are kept below [degrees per frame at 30 fps]."""


def leg_at(height, stands, room=0.3, source_height=0.86):
    """A leg below a hip at rest at the origin whose ankle is so far below it over time, made as a standing one."""
    count = len(height)
    still = np.full(count, source_height)

    def joints(span):
        along = (THIGH**2 - SHANK**2 + span**2) / (2 * span)
        knee = np.stack([np.sqrt(np.maximum(THIGH**2 - along**2, 0.0)), np.zeros(count), -along], axis=-1)
        return knee, np.stack([np.zeros(count), np.zeros(count), -span], axis=-1)

    knee, ankle = joints(still)
    source = Leg(np.zeros((count, 3)), knee, ankle, np.tile((1.0, 0.0, 0.0), (count, 1)))
    goal = np.zeros((count, 3))
    goal[:, 2] = -np.asarray(height)
    reach = 0.985 * source.length
    return PacedLeg(source, np.zeros((count, 3)), goal, reach, np.broadcast_to(stands, (count,)), np.full(count, room))


def solved(legs, rate=RATE):
    """The correction, and each leg's span from hip to ankle with it."""
    relief = relieve(legs, step=1 / rate, time_scale=1.0, leg_length=THIGH + SHANK)
    spans = {}
    for side, leg in legs.items():
        axis = leg.hip + relief.hips - leg.ankle
        spans[side] = np.linalg.norm(axis, axis=1) - relief.feet[side]
    return relief, spans


def knee_turn(leg, span):
    """Largest turn of the knee from sample to sample [degrees]."""
    return np.degrees(np.abs(np.diff(leg.source.flexion_at(span)[0])).max())


def test_where_no_knee_is_too_fast_nothing_is_corrected():
    leg = leg_at(0.84 + 0.01 * np.sin(np.arange(60) / 10), stands=True)
    relief, _ = solved({"l": leg})
    assert not relief.hips.any()
    assert not relief.feet["l"].any()


def test_a_foot_in_the_air_gives_way_before_the_hips_and_the_knee_keeps_its_pace():
    """A swing that stretches the knee by 40° in one frame."""
    height = np.where(np.arange(60) < 30, 0.76, 0.855)
    leg = leg_at(height, stands=False)
    assert knee_turn(leg, height) > 30
    relief, spans = solved({"l": leg})
    assert knee_turn(leg, spans["l"]) < PER_FRAME
    assert np.abs(relief.hips[:, 2]).max() < np.abs(relief.feet["l"]).max()
    assert np.abs(relief.feet["l"][[0, -1]]).max() < 0.005, "far from it nothing changes"


def test_a_foot_that_stands_is_not_moved_and_the_hips_give_way():
    """Ground that gives way by 3 cm at once under a leg that is nearly straight."""
    height = np.where(np.arange(60) < 30, 0.82, 0.86)
    leg = leg_at(height, stands=True)
    assert knee_turn(leg, height) > PER_FRAME
    relief, spans = solved({"l": leg})
    assert relief.feet["l"] == pytest.approx(np.zeros(60), abs=1e-5)
    assert knee_turn(leg, spans["l"]) < PER_FRAME
    assert np.abs(relief.hips[:, 2]).max() < 0.04


def test_an_ankle_out_of_reach_comes_into_reach():
    height = 0.84 + 0.06 * np.exp(-(((np.arange(60) - 30) / 8) ** 2))
    leg = leg_at(height, stands=True)
    assert (height > leg.reach).any()
    _, spans = solved({"l": leg})
    assert (spans["l"] <= leg.reach + 1e-3).all()


def test_a_swinging_foot_does_not_give_way_into_the_ground():
    height = np.where(np.arange(60) < 30, 0.855, 0.76)  # the easiest would be to leave the foot down
    leg = leg_at(height, stands=False, room=0.01)
    relief, spans = solved({"l": leg})
    assert relief.feet["l"].min() > -0.012
    assert knee_turn(leg, spans["l"]) < PER_FRAME


@pytest.mark.filterwarnings("error")
def test_a_foot_over_no_ground_gives_way_as_one_far_above_it():
    height = np.where(np.arange(60) < 30, 0.76, 0.855)
    far, endless = (solved({"l": leg_at(height, stands=False, room=room)})[0] for room in (10.0, np.inf))
    assert np.abs(endless.feet["l"]).max() > 0.01
    assert np.array_equal(endless.feet["l"], far.feet["l"])
    assert np.array_equal(endless.hips, far.hips)


@pytest.mark.parametrize("rate", [60.0, 120.0])
def test_the_correction_is_about_the_same_at_any_frame_rate_that_shows_the_turn(rate):
    def hips_at(rate):
        times = np.arange(round(2 * rate) + 1) / rate
        height = 0.70 + 0.16 * np.clip((times - 1.0) / 0.1, 0, 1)
        relief, _ = solved({"l": leg_at(height, stands=True)}, rate)
        return times, relief.hips[:, 2]

    assert np.abs(hips_at(240.0)[1]).max() > 0.01
    times, hips = hips_at(rate)
    fine_times, fine = hips_at(240.0)
    assert hips == pytest.approx(np.interp(times, fine_times, fine), abs=0.25 * np.abs(fine).max())


@settings(max_examples=10)
@given(
    st.lists(st.floats(0.6, 0.86), min_size=3, max_size=12),
    st.lists(st.booleans(), min_size=3, max_size=12),
    st.floats(0.0, 0.3),
)
def test_corrections_are_finite_and_never_of_standing_feet(heights, stands, room):
    height = np.repeat(heights, 5)
    standing = np.resize(np.repeat(stands, 5), len(height))
    relief, _ = solved({"l": leg_at(height, standing, room), "r": leg_at(height[::-1], ~standing, room)})
    assert np.isfinite(relief.hips).all()
    assert np.abs(relief.hips[:, 2]).max() < 0.5
    assert np.abs(relief.feet["l"][standing]).max(initial=0.0) < 1e-4
    assert np.abs(relief.feet["r"][~standing]).max(initial=0.0) < 1e-4
