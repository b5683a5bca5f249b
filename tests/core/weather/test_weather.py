"""Weather: each process at a steady rate against a value by hand, an independent integral, and its limits."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp, trapezoid

from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.weather import weather as w
from softground_addon.core.weather.weather import Span
from softground_addon.core.weather.weather_course import Weather, course_of

HOUR, DAY = 3600.0, 86_400.0
SECTION = 0.27 * 0.04


def after(seconds, surface="snow", **rates):
    """The course of a steady weather over a time, at a frame a second."""
    matter = w.matter_of(surface, 0.3, SECTION)
    return course_of(Weather(**rates), matter, frame=seconds, span=Span(0.0, seconds, 1.0))


def test_a_moderate_snowfall_at_minus_five_is_one_and_a_third_centimetres_an_hour():
    rate = 1e-3 / HOUR * w.WATER_DENSITY / float(w.new_snow_density(-5.0))
    assert rate * HOUR == pytest.approx(0.0133, rel=0.01)


def test_new_snow_is_never_denser_than_a_hundred_and_twenty():
    assert w.new_snow_density([-60.0, 3.0]) == pytest.approx([67.92, 120.0])


@pytest.mark.parametrize("temperature", [-12.0, 0.0])
def test_snow_settles_as_the_rate_equation_says(temperature):
    rate, warmth, slowing = w.SETTLING

    def growth(_time, density):
        return 100.0 * rate * np.exp(warmth * temperature - slowing * (density[0] - 100.0))

    late = solve_ivp(growth, (0.0, 5 * DAY), [100.0], rtol=1e-9, atol=1e-9).y[0, -1]
    assert w.settled_density(5 * DAY * w.settling_rate(temperature), 100.0) == pytest.approx(late, rel=1e-5)


@pytest.mark.parametrize("hours", [0.5, 8.0, 240.0])
def test_the_cover_is_the_sum_of_layers_each_settled_by_its_own_age(hours):
    rate, new, settling = 0.03 / HOUR, float(w.new_snow_density(-4.0)), float(w.settling_rate(-4.0))
    layers, _ = quad(lambda age: rate * new / float(w.settled_density(age * settling, new)), 0.0, hours * HOUR)
    cover = after(hours * HOUR, snowfall=rate, temperature=-4.0).cover
    assert cover[0] == pytest.approx(layers, rel=1e-6)
    # Long after the parts that are known it is within half a percent.
    late = course_of(Weather(rate, -4.0), w.matter_of("snow", 0.3, 0.01), frame=hours * HOUR, span=Span(0.0, 60.0, 1.0))
    assert late.cover[0] == pytest.approx(layers, rel=5e-3)


def test_three_days_of_thaw_melt_what_degree_days_say():
    # 3.5 mm a degree-day: 3 days at 4 degrees melt 42 mm of water, 28 cm of snow of 150 kg/m3.
    thaw = after(3 * DAY, temperature=4.0)
    assert thaw.thawed[0] == pytest.approx(0.28, rel=1e-9)
    assert not thaw.cover.any()


def test_new_snow_melts_before_the_ground():
    # 10 mm of water fall and 4 mm melt, over a time: six tenths of the cover are left, and all of the ground.
    rate = 10e-3 * w.WATER_DENSITY / float(w.new_snow_density(8 / 7)) / DAY
    course = after(DAY, snowfall=rate, temperature=8 / 7)
    # At 0 degrees it settles as fast, and weighs a little less.
    new = float(w.new_snow_density(8 / 7))
    layers, _ = quad(lambda age: rate * new / float(w.settled_density(age * w.settling_rate(0.0), new)), 0.0, DAY)
    assert course.cover[0] == pytest.approx(0.6 * layers, rel=1e-6)
    assert not course.thawed.any()


def test_a_print_in_a_sandy_wind_lasts_twenty_minutes_and_its_edges_less_than_one():
    wind = 0.4 * np.log(10.0 / w.ROUGHNESS_LENGTH) / w.KARMAN  # friction velocity 0.4 m/s
    assert w.friction_velocity(wind) == pytest.approx(0.4)
    flux = 1.8 * 1.2 / 9.81 * 0.4**3
    assert w.blown_flux(wind, SURFACES["sand"].drifts_from) == pytest.approx(flux)
    tau = SECTION * 1600.0 / flux
    assert tau == pytest.approx(20 * 60, rel=0.05)
    assert after(tau, "sand", wind=wind).unfilled[0] == pytest.approx(np.exp(-1))
    assert after(45.0, "sand", wind=wind).variance[0] == pytest.approx(0.02**2, rel=0.02)


def test_below_the_threshold_nothing_is_blown():
    # 0.23 m/s at the ground is 5.3 m/s at ten metres.
    assert w.blown_flux(5.2, SURFACES["sand"].drifts_from) == 0.0
    assert w.blown_flux(5.4, SURFACES["sand"].drifts_from) > 0.0
    assert 0.1 * np.sqrt((2650 - 1.2) / 1.2 * 9.81 * 0.25e-3) == pytest.approx(SURFACES["sand"].drifts_from, rel=0.02)


def test_ten_millimetres_of_rain_round_what_is_finer_than_a_centimetre_and_a_half():
    assert np.sqrt(after(HOUR, rain=10e-3 / HOUR).variance[0]) == pytest.approx(0.0141, rel=0.01)


def test_twelve_centimetres_of_snow_soften_what_is_finer_than_six():
    course = after(10 * HOUR, snowfall=0.012 / HOUR, temperature=-10.0)
    assert np.sqrt(course.variance[0] * 0.12 / course.cover[0]) == pytest.approx(0.06, rel=0.01)


@pytest.mark.parametrize(("surface", "millimetres", "share"), [("mud", 20, 1.0), ("soil", 60, 0.4), ("sand", 200, 1.0)])
def test_what_the_ground_does_not_take_up_is_the_integral_of_rain_over_horton(surface, millimetres, share):
    rain, soaking = millimetres * 1e-3 / HOUR, SURFACES[surface].soaking

    def over(time):
        return max(rain - share * (soaking.final + (soaking.first - soaking.final) * np.exp(-soaking.decay * time)), 0)

    for hours in (0.1, 0.5, 2.0):
        times = np.linspace(0.0, hours * HOUR, 40_001)
        independent = trapezoid([over(time) for time in times], times)
        excess = after(hours * HOUR, surface, rain=rain).excess(share)
        assert excess[0] == pytest.approx(independent, rel=2e-3, abs=1e-9)


def test_ground_that_takes_up_all_rain_has_no_puddles():
    assert not after(10 * HOUR, "mud", rain=0.9e-3 / HOUR).excess(1.0).any()


def test_water_seeps_up_to_its_table():
    mud = SURFACES["mud"].soaking
    assert w.seeped([0.0, mud.seep, 1e4], mud) == pytest.approx([0.0, 1 - np.exp(-1), 1.0])


def test_a_beach_dries_in_two_stages():
    # Half a millimetre an hour: the film of a millimetre is gone after two hours, and all looks dry after eight.
    rate = 0.5e-3 / HOUR
    wet = [after(hours * HOUR, "wet_sand", drying=rate).wet[0] for hours in (1.0, 2.0, 4.5, 8.0, 20.0)]
    assert wet == pytest.approx([5 / 6, 2 / 3, 1 / 3, 0.0, 0.0])
    just = w.wetness(w.SURFACE_FILM * np.array([1 - 1e-4, 1 + 1e-4]))  # the second stage begins as fast as the first
    assert np.diff(just) == pytest.approx(-2e-4 / w.DRY_AT, rel=1e-3)


def test_pale_sand_around_a_foot_is_wet_again_after_seconds():
    assert w.halo([0.0, 2.0]) == pytest.approx([1.0, np.exp(-1)])


PROCESSES = {
    "snow": ("snow", lambda k: {"snowfall": k * 0.01 / HOUR, "temperature": -3.0}, lambda c: c.cover),
    "melt": ("snow", lambda k: {"temperature": k * 2.0}, lambda c: c.thawed),
    "fill": ("sand", lambda k: {"wind": k * 6.0}, lambda c: 1.0 - c.unfilled),
    "spread": ("snow", lambda k: {"wind": k * 7.0}, lambda c: c.variance),
    "rain": ("soil", lambda k: {"rain": k * 1e-6}, lambda c: c.variance),
    "excess": ("mud", lambda k: {"rain": k * 20e-3 / HOUR}, lambda c: c.excess(1.0)),
    "drying": ("mud", lambda k: {"drying": k * 1e-7}, lambda c: 1.0 - c.wet),
}


@pytest.mark.parametrize("process", PROCESSES)
def test_nothing_at_age_nought_nothing_at_rate_nought_and_ever_more_after(process):
    surface, rates, seen = PROCESSES[process]
    assert not seen(after(5 * HOUR, surface, **rates(0.0))).any()
    assert not seen(after(0.0, surface, **rates(1.0))).any()
    late = seen(after(5 * HOUR, surface, **rates(1.0)))  # by the moment since which it goes on
    assert late[-1] == 0.0
    assert (np.diff(late) <= 0).all()
    assert late[0] > 0
    assert (seen(after(5 * HOUR, surface, **rates(2.0))) >= late).all()
