"""The balance controller against closed forms, an independent integrator, and what it promises."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad, solve_ivp

from softground_addon.core.response.tilt import (
    AUTHORS_TORQUES,
    LARGEST_LEAN,
    PAPER_TORQUES,
    TiltGains,
    along_heading,
    body_gains,
    capsule_inertia,
    lean,
)

SLOPE = np.radians(12.0)


def step_onto_slope(rate, seconds=6.0, at=1.0, slope=SLOPE):
    """Level ground, then a steady rise along x, reached over a tenth of a second."""
    times = np.arange(round(seconds * rate) + 1) / rate
    angle = slope * np.clip((times - at) / 0.1, 0, 1)
    return times, np.stack([angle, 0 * angle], axis=-1)


def test_nothing_leans_on_level_ground():
    assert not lean(np.zeros((50, 2)), frame_rate=24, gains=TiltGains()).any()


def test_a_body_leans_into_the_rise_and_back_from_the_fall():
    _, up = step_onto_slope(30)
    leaning = lean(up, frame_rate=30, gains=TiltGains())
    assert leaning[-1] == pytest.approx([SLOPE, 0.0], rel=1e-3)
    assert np.array_equal(lean(-up, frame_rate=30, gains=TiltGains()), -leaning)
    assert np.array_equal(lean(up[:, ::-1], frame_rate=30, gains=TiltGains()), leaning[:, ::-1])


@pytest.mark.parametrize("frequency", [0.3, 0.6, 1.2])
@pytest.mark.parametrize("damping", [0.2, 0.85, 2.0])
def test_the_swing_is_that_of_an_independent_integrator(frequency, damping):
    times, slope = step_onto_slope(24)
    natural = 2 * np.pi * frequency

    def pendulum(t, state):
        balance = np.interp(t, times, slope[:, 0])
        return state[1], -(natural**2) * np.sin(state[0] - balance) - 2 * damping * natural * state[1]

    oracle = solve_ivp(pendulum, (0, times[-1]), (0, 0), t_eval=times, rtol=1e-9, atol=1e-10, max_step=0.01).y[0]
    result = lean(slope, frame_rate=24, gains=TiltGains(frequency, damping))[:, 0]
    assert np.abs(result - oracle).max() < 0.02 * SLOPE


def test_a_light_damping_swings_at_the_natural_frequency_and_decays_as_it_should():
    gains = TiltGains(frequency=0.6, damping=0.1)
    times, slope = step_onto_slope(240, seconds=8.0, slope=np.radians(2))
    swing = lean(slope, frame_rate=240, gains=gains)[:, 0] - np.radians(2)
    peaks = [k for k in range(1, len(swing) - 1) if swing[k - 1] < swing[k] >= swing[k + 1] and times[k] > 1.2]
    period = np.diff(times[peaks]).mean()
    assert 1 / period == pytest.approx(0.6 * np.sqrt(1 - 0.1**2), rel=0.01)
    decrement = np.log(swing[peaks[0]] / swing[peaks[1]])
    assert decrement == pytest.approx(2 * np.pi * 0.1 / np.sqrt(1 - 0.1**2), rel=0.03)


@pytest.mark.parametrize("rate", [24, 25, 30, 60, 100])
def test_the_lean_does_not_depend_on_the_frame_rate(rate):
    reference_times, slope = step_onto_slope(120)
    reference = lean(slope, frame_rate=120, gains=TiltGains())[:, 0]
    times, slope = step_onto_slope(rate)
    result = lean(slope, frame_rate=rate, gains=TiltGains())[:, 0]
    assert np.abs(result - np.interp(times, reference_times, reference)).max() < 0.02 * SLOPE


def test_it_starts_at_rest_and_without_a_jerk():
    slope = np.full((20, 2), SLOPE)
    leaning = lean(slope, frame_rate=24, gains=TiltGains())
    assert leaning == pytest.approx(slope)


@given(
    st.lists(st.floats(-1.5, 1.5), min_size=2, max_size=40),
    st.floats(0.05, 5.0),
    st.floats(0.0, 3.0),
    st.sampled_from([1.0, 24.0, 120.0]),
)
def test_the_lean_is_bounded_whatever_the_ground_does(slopes, frequency, damping, rate):
    slope = np.stack([slopes, slopes[::-1]], axis=-1)
    leaning = lean(slope, frame_rate=rate, gains=TiltGains(frequency, damping))
    assert np.isfinite(leaning).all()
    assert np.abs(leaning).max() <= LARGEST_LEAN + 1e-12


def test_no_torque_acts_in_flight():
    _, slope = step_onto_slope(60)
    assert not lean(slope, frame_rate=60, gains=TiltGains(), supported=np.zeros(len(slope))).any()


def torques(gains, inertia, arm):
    """The paper's alpha [N] and beta [N·m·s] of a body: I·w²/l and 2·zeta·I·w."""
    natural = 2 * np.pi * gains.frequency
    return inertia * natural**2 / arm, 2 * gains.damping * inertia * natural


def test_gains_and_torques_are_two_words_for_one_thing():
    for mass, arm in ((0.02, 0.03), (77.5, 1.0), (2000.0, 3.0)):
        inertia = capsule_inertia(mass, 2 * arm, 0.2 * arm)
        alpha, beta = torques(TiltGains(0.6, 0.85), inertia, arm)
        gains = TiltGains.from_torques(alpha, beta, inertia=inertia, arm=arm)
        assert (gains.frequency, gains.damping) == pytest.approx((0.6, 0.85))


def test_the_papers_gains_swing_for_many_seconds_and_the_authors_scene_is_near_the_default():
    paper = body_gains(*PAPER_TORQUES, mass=77.5, arm=1.0)
    assert 1 / paper.frequency > 8
    assert paper.damping < 0.1
    authors = body_gains(*AUTHORS_TORQUES, mass=77.5, arm=1.0)
    assert authors.frequency == pytest.approx(0.6, rel=0.15)
    assert authors.damping == pytest.approx(0.85, rel=0.15)


def test_the_capsules_inertia_is_the_integral_of_its_mass():
    mass, height, radius = 77.5, 1.8, 0.25

    def half_width(z):
        below, above = max(radius - z, 0.0), max(z - (height - radius), 0.0)
        return np.sqrt(max(radius**2 - max(below, above) ** 2, 0.0))

    def over(function):
        return dblquad(
            lambda y, z: 2 * np.sqrt(max(half_width(z) ** 2 - y**2, 0.0)) * function(y, z),
            0,
            height,
            lambda z: -half_width(z),
            half_width,
            epsabs=1e-5,
            epsrel=1e-5,
        )[0]

    expected = mass * over(lambda y, z: y**2 + z**2) / over(lambda y, z: 1.0)
    assert capsule_inertia(mass, height, radius) == pytest.approx(expected, rel=1e-3)


def test_without_lateral_tilt_a_cross_slope_is_not_leant_into():
    slope = np.tile([0.1, 0.2], (3, 1))
    heading = np.tile([1.0, 0.0], (3, 1))
    assert along_heading(slope, heading, 0.0) == pytest.approx(np.tile([0.1, 0.0], (3, 1)))
    assert along_heading(slope, heading, 1.0) == pytest.approx(slope)
