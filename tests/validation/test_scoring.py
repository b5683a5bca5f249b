"""What of a trial the score looks at, on trials in closed form."""

import numpy as np
import pytest

from library.softground.scoring import PointScore, plates_saw_everything, score, score_points

WEIGHT, RATE = 700.0, 100.0


def frames(*intervals):
    state = np.zeros(200, dtype=bool)
    for first, last in intervals:
        state[first:last] = True
    return state


def seen(loads, touching):
    return plates_saw_everything(np.stack(loads, axis=1), np.stack(touching, axis=1), weight=WEIGHT, rate=RATE)


@pytest.mark.parametrize("length", [60, 8])
def test_a_step_beside_the_plates_is_left_out_whole(length):
    stands, steps_beside = frames((0, 200)), frames((100, 100 + length))
    scored = seen([WEIGHT * stands, 0.0 * stands], [stands, steps_beside])
    assert (scored == ~frames((94, 106 + length))).all()


def test_a_foot_whose_load_comes_earlier_than_its_motion_shows_is_scored():
    left, right = frames((0, 100)), frames((94, 200))
    assert seen([WEIGHT * left, WEIGHT * right], [left, frames((100, 200))]).all()


def test_who_sits_is_scored_from_where_the_feet_bear_the_weight():
    """Up from 0 to the weight within half a second, the feet on the ground throughout."""
    load = WEIGHT / 2 * np.clip((np.arange(200) - 100) / 50, 0.0, 1.0)
    feet = frames((0, 200))
    assert (seen([load, load], [feet, feet]) == (np.arange(200) >= 150)).all()


def test_all_errors_are_those_that_were_made():
    step = np.arange(200)
    share = np.clip((step - 90) / 20, 0.0, 1.0)
    measured = np.zeros((200, 2, 3))
    measured[..., 2] = WEIGHT * np.stack([1 - share, share], axis=1)
    late = np.roll(measured, 3, axis=0)
    late[:3] = measured[0]
    result = score(late, measured, frames((0, 200)), weight=WEIGHT, rate=RATE)
    assert result.heel_strike_bias_ms == pytest.approx(30.0)
    assert result.toe_off_bias_ms == pytest.approx(30.0)
    assert result.rms_bw_total == pytest.approx(0.0, abs=1e-12)
    assert result.share_rms_bw == pytest.approx(result.rms_bw_foot)
    assert result.rms_bw_foot == pytest.approx(np.hypot(result.rms_bw_left, result.rms_bw_right) / np.sqrt(2))
    skewed = score(measured + np.array((7.0, 14.0, 0.0)), measured, frames((0, 200)), weight=WEIGHT, rate=RATE)
    assert skewed.rms_bw_foot_anterior_posterior == pytest.approx(0.01)
    assert skewed.rms_bw_foot_medio_lateral == pytest.approx(0.02)
    assert skewed.rms_bw_foot == 0.0
    heavier = score(1.1 * measured, measured, frames((0, 200)), weight=WEIGHT, rate=RATE)
    assert heavier.share_rms_bw == pytest.approx(0.0, abs=1e-12)
    assert heavier.rms_bw_total == pytest.approx(0.1)


def test_points_and_twists_are_scored_where_they_are_measured():
    centres, moments = np.zeros((200, 2, 3)), np.zeros((200, 2))
    off, twisted = centres + np.array((0.03, 0.04, 1.0)), moments + 2.0
    off[50:60], twisted[50:] = np.nan, np.nan
    score = score_points(centres, moments, (off, twisted), frames((0, 100)))
    assert score.rms_centre_mm == pytest.approx(50.0)
    assert score.rms_free_moment_nm == pytest.approx(2.0)
    assert score_points(centres, moments, (None, None), frames((0, 100))) == PointScore()
    assert score_points(centres, moments, (np.nan * off, None), frames((0, 100))) == PointScore()
