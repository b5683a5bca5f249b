"""Weather: each process against a value worked out by hand, an independent integral, and its limits."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp, trapezoid

from softground_addon.core.after import weather as w

HOUR, DAY = 3600.0, 86_400.0


def test_a_moderate_snowfall_at_minus_five_is_one_and_a_third_centimetres_an_hour():
    water = 1e-3 / HOUR
    rate = water * w.WATER_DENSITY / float(w.new_snow_density(-5.0))
    assert rate * HOUR == pytest.approx(0.0133, rel=0.01)
    assert w.snow_water(HOUR, rate, -5.0) == pytest.approx(1e-3, rel=1e-9)


def test_new_snow_is_never_denser_than_a_hundred_and_twenty():
    assert w.new_snow_density([-60.0, 3.0]) == pytest.approx([67.92, 120.0])


@pytest.mark.parametrize("temperature", [-12.0, 0.0])
def test_snow_settles_as_the_rate_equation_says(temperature):
    rate, warmth, slowing = w.SETTLING

    def growth(_time, density):
        return 100.0 * rate * np.exp(warmth * temperature - slowing * (density[0] - 100.0))

    late = solve_ivp(growth, (0.0, 5 * DAY), [100.0], rtol=1e-9, atol=1e-9).y[0, -1]
    assert w.settled_density(5 * DAY, temperature, 100.0) == pytest.approx(late, rel=1e-5)


@pytest.mark.parametrize("hours", [0.5, 8.0, 240.0])
def test_the_cover_is_the_sum_of_layers_each_settled_by_its_own_age(hours):
    rate, new = 0.03 / HOUR, float(w.new_snow_density(-4.0))
    layers, _ = quad(lambda age: rate * new / float(w.settled_density(age, -4.0, new)), 0.0, hours * HOUR)
    assert w.snow_cover(hours * HOUR, rate, -4.0) == pytest.approx(layers, rel=5e-3)


def test_three_days_of_thaw_melt_what_degree_days_say():
    # 3.5 mm a degree-day: 3 days at 4 degrees melt 42 mm of water, 28 cm of snow of 150 kg/m3.
    assert w.melted_water(3 * DAY, 4.0) == pytest.approx(0.042)
    assert w.level_of_snow(3 * DAY, 0.0, 4.0, depth=0.4) == pytest.approx(-0.28, rel=1e-9)
    assert w.level_of_snow(30 * DAY, 0.0, 4.0, depth=0.4) == pytest.approx(-0.4)  # and no more than there is


def test_new_snow_melts_before_the_ground():
    # 10 mm of water fall and 4 mm melt, over a time: six tenths of the cover are left, and all of the ground.
    age, rate = DAY, 10e-3 * w.WATER_DENSITY / float(w.new_snow_density(8 / 7)) / DAY
    level = w.level_of_snow(age, rate, 8 / 7, depth=0.3)
    assert level == pytest.approx(0.6 * float(w.snow_cover(age, rate, 8 / 7)))
    assert w.level_of_snow(age, rate, 20.0, depth=0.0) == 0.0


def test_a_print_stands_up_as_a_pedestal_in_a_thaw():
    days = np.linspace(0.0, 3.0, 200) * DAY
    around = w.level_of_snow(days, 0.0, 5.0, depth=0.3)
    trodden = w.level_of_snow(days, 0.0, 5.0, depth=0.3, compression=0.12) - 0.12
    above = trodden - around
    assert above[0] == pytest.approx(-0.12)
    turned = days[np.argmax(above > 0)]
    # When what is around has lost depth/(1 + (depth - compression)/depth).
    loss = 0.3 / (1 + 0.18 / 0.3)
    assert turned == pytest.approx(loss * w.SNOW.bulk_density / 1000 / (w.DEGREE_DAY * 5.0), rel=0.02)
    assert above.max() == pytest.approx(0.3 * 0.6 * 0.4, rel=0.02)  # as the ground around comes bare


def test_a_print_in_a_sandy_wind_lasts_twenty_minutes_and_its_edges_less_than_one():
    wind = 0.4 * np.log(10.0 / w.ROUGHNESS_LENGTH) / w.KARMAN  # friction velocity 0.4 m/s
    assert w.friction_velocity(wind) == pytest.approx(0.4)
    flux = 1.8 * 1.2 / 9.81 * 0.4**3
    assert w.blown_flux(wind, w.SAND) == pytest.approx(flux)
    section = 0.27 * 0.04
    tau = section * 1600.0 / flux
    assert tau == pytest.approx(20 * 60, rel=0.05)
    assert w.filled_share(tau, wind, section, w.SAND) == pytest.approx(1 - np.exp(-1))
    assert w.blown_variance(45.0, wind, w.SAND) == pytest.approx(0.02**2, rel=0.02)


def test_below_the_threshold_nothing_is_blown():
    # 0.23 m/s at the ground is 5.3 m/s at ten metres.
    assert w.blown_flux(5.2, w.SAND) == 0.0
    assert w.blown_flux(5.4, w.SAND) > 0.0
    assert 0.1 * np.sqrt((2650 - 1.2) / 1.2 * 9.81 * 0.25e-3) == pytest.approx(w.SAND.threshold, rel=0.02)


def test_ten_millimetres_of_rain_round_what_is_finer_than_a_centimetre_and_a_half():
    assert np.sqrt(w.rain_variance(HOUR, 10e-3 / HOUR)) == pytest.approx(0.0141, rel=0.01)
    assert np.sqrt(w.drape_variance(0.12)) == pytest.approx(0.06, rel=0.01)


@pytest.mark.parametrize(("surface", "millimetres", "share"), [("mud", 20, 1.0), ("soil", 60, 0.4), ("sand", 200, 1.0)])
def test_what_the_ground_does_not_take_up_is_the_integral_of_rain_over_horton(surface, millimetres, share):
    rain, soaking = millimetres * 1e-3 / HOUR, w.SOAKING[surface]

    def over(time):
        return max(rain - share * (soaking.final + (soaking.first - soaking.final) * np.exp(-soaking.decay * time)), 0)

    for hours in (0.1, 0.5, 2.0):
        times = np.linspace(0.0, hours * HOUR, 40_001)
        independent = trapezoid([over(time) for time in times], times)
        assert w.rain_excess(hours * HOUR, rain, soaking, share) == pytest.approx(independent, rel=2e-3, abs=1e-9)


def test_ground_that_takes_up_all_rain_has_no_puddles():
    assert w.rain_excess(10 * HOUR, 0.9e-3 / HOUR, w.SOAKING["mud"]) == 0.0


def test_water_seeps_up_to_its_table():
    assert w.seep_level([0.0, 10.0, 1e4], 0.03, 10.0) == pytest.approx([0.0, 0.03 * (1 - np.exp(-1)), 0.03])


def test_a_beach_dries_in_two_stages():
    # Half a millimetre an hour: the film of a millimetre is gone after two hours, and all looks dry after eight.
    rate = 0.5e-3 / HOUR
    wet = w.wetness(np.array([0.0, 1.0, 2.0, 4.5, 8.0, 20.0]) * HOUR, rate)
    assert wet == pytest.approx([1.0, 5 / 6, 2 / 3, 1 / 3, 0.0, 0.0])
    just = w.wetness(np.array([2 * HOUR - 1, 2 * HOUR + 1]), rate)  # the second stage begins as fast as the first ended
    assert np.diff(just) == pytest.approx(-2 * rate / w.SURFACE_FILM / w.DRY_AT, rel=1e-3)


def test_pale_sand_around_a_foot_is_wet_again_after_seconds():
    assert w.halo([0.0, 2.0]) == pytest.approx([1.0, np.exp(-1)])


PROCESSES = {
    "snow": lambda age, k: w.snow_cover(age, k * 0.01 / HOUR, -3.0),
    "melt": lambda age, k: -w.level_of_snow(age, 0.0, k * 2.0, depth=0.3),
    "fill": lambda age, k: w.filled_share(age, k * 6.0, 0.01, w.SAND),
    "spread": lambda age, k: w.blown_variance(age, k * 7.0, w.SNOW),
    "rain": lambda age, k: w.rain_variance(age, k * 1e-6),
    "excess": lambda age, k: w.rain_excess(age, k * 20e-3 / HOUR, w.SOAKING["mud"]),
    "drying": lambda age, k: 1.0 - w.wetness(age, k * 1e-7),
    "wetting": lambda age, k: w.wetted(age * k * 1e-7),
}


@pytest.mark.parametrize("process", PROCESSES)
def test_nothing_at_age_nought_nothing_at_rate_nought_and_ever_more_after(process):
    age = np.linspace(0.0, 5 * HOUR, 100)
    assert (PROCESSES[process](age, 0.0) == 0.0).all()
    late = PROCESSES[process](age, 1.0)
    assert late[0] == 0.0
    assert (np.diff(late) >= 0).all()
    assert late[-1] > 0
    assert (PROCESSES[process](age, 2.0) >= late).all()
