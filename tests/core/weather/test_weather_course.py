"""Weather that changes: sums over parts of the time against a simulation in small steps of its own."""

from functools import cache

import numpy as np
import pytest

from softground_addon.core.weather import weather as w
from softground_addon.core.weather.weather import PARTS, Span
from softground_addon.core.weather.weather_course import Weather, course_of

HOUR = 3600.0
SPAN = Span(1.0, 1.0 + 2 * PARTS, 24.0)
FINER = 5
LEAST = {"cover": 1e-3, "thawed": 1e-3, "variance": 4e-3, "unfilled": 1.0, "excess": 1e-4}
"""What an error is measured by where there is less [m, m²]: wind crosses its threshold within a part."""


def changing(seed):
    """Rates that swing and jump, at any frame."""
    random = np.random.default_rng(seed)
    jumps = random.random((6, 9)) < 0.6
    most = np.array([0.03 / HOUR, 8.0, 12.0, 30e-3 / HOUR, 1e-3 / HOUR, 1500.0])
    phase = random.uniform(0, 6, 6)

    @cache
    def at(frame):
        on = jumps[:, min(int((frame - SPAN.first) / (2 * PARTS) * 8), 8)]
        swing = 0.6 + 0.4 * np.sin(frame / 60.0 + phase)
        values = most * swing * on
        values[1] = most[1] * np.sin(frame / 50.0 + phase[1])
        values[5] = most[5] * swing[5]
        return values

    return at


def simulated(at, matter, since, frame, share):
    """What happens from one frame to another, step by step, layer by layer."""
    step = SPAN.step / FINER
    water, density, began = [], [], []
    settling = thawed = blown = lost = rained = excess = wet_time = 0.0
    opened, age = 1.0, 0.0
    for number in range(round((frame - SPAN.first) / step)):
        now = SPAN.first + (number + 0.5) * step
        snowfall, temperature, wind, rain, drying, scale = at(now)
        time = step * scale / SPAN.frame_rate
        mud = matter.soaking
        capacity = mud.final + (mud.first - mud.final) * np.exp(-mud.decay * (wet_time + time / 2)) if mud else np.inf
        wet_time += time * (rain > 0)
        if now < since:
            continue
        new = float(w.new_snow_density(temperature))
        age += time
        water.append(snowfall * time * new / 1000.0)
        density.append(new)
        settling += float(w.settling_rate(temperature)) * time
        began.append(settling)
        melt = melted = w.DEGREE_DAY * max(temperature, 0.0) * time
        while melt > 0 and water:
            taken = min(melt, water[-1])
            water[-1], melt = water[-1] - taken, melt - taken
            if water[-1] == 0.0:
                water.pop(), density.pop(), began.pop()
        thawed += melt * 1000.0 / matter.density
        if matter.drifts_from:
            flux = float(w.blown_flux(wind, matter.drifts_from))
            opened *= 1.0 - flux / (matter.section * matter.density) * time
            blown += 2.0 * w.HOP * flux / matter.density * time
        rained += rain * time
        excess += max(rain - share * capacity, 0.0) * time
        lost = max(lost + (drying - rain) * time - (melted if matter.snow_depth else 0.0), 0.0)
    cover = float(np.sum(np.array(water) * 1000.0 / w.settled_density(settling - np.array(began), np.array(density))))
    under = cover + thawed if matter.snow_depth else cover
    return {
        "cover": cover,
        "thawed": thawed,
        "variance": w.DRAPE * under + w.RAIN_ROUNDING * rained + blown,
        "unfilled": opened,
        "lost": lost,
        "excess": excess,
    }


@pytest.mark.parametrize(("surface", "seed"), [("snow", 1), ("snow", 2), ("sand", 3), ("mud", 4), ("mud", 5)])
def test_a_weather_that_changes_is_what_a_simulation_makes_of_it(surface, seed):
    matter, at = w.matter_of(surface, 0.3, 0.02), changing(seed)
    parts = SPAN.first + (np.arange(PARTS)[:, None] + (np.arange(FINER) + 0.5) / FINER) * SPAN.step
    means = np.array([np.mean([at(frame) for frame in part], axis=0) for part in parts])
    weather = Weather(*np.concatenate([means, means[-1:]]).T)
    for frame in (151.0, 513.0):
        course = course_of(weather, matter, frame=frame, span=SPAN)
        for since in (1.0, 99.0, 141.0, 147.0):
            wanted = simulated(at, matter, since, frame, 0.7)
            sums = {
                name: course.since(since, getattr(course, name)) for name in ("cover", "thawed", "variance", "unfilled")
            }
            if matter.soaking:
                sums["excess"] = course.since(since, course.excess(0.7))
            for name, value in sums.items():
                top = max(wanted[name], LEAST[name])
                assert value == pytest.approx(wanted[name], abs=0.01 * top), (name, frame, since)
            if matter.wet:
                assert course.since(since, course.wet) == pytest.approx(w.wetness(wanted["lost"]), abs=0.01)


def test_a_shower_wets_dry_ground_and_the_sun_dries_it_again():
    rain, sun = np.zeros(PARTS + 1), np.full(PARTS + 1, 0.5e-3 / HOUR)
    rain[:30], sun[:30] = 20e-3 / HOUR, 0.0
    weather = Weather(rain=rain, drying=sun, time_scale=24 * 3600.0)  # a frame an hour
    wet = [
        course_of(weather, w.matter_of("soil", 0.2, 0.01), frame=frame, span=Span(0.0, PARTS, 24.0)).wet[0]
        for frame in (0.0, 30.0, 32.0, 38.0)
    ]
    assert wet == pytest.approx([0.0, 1.0, 2 / 3, 0.0], abs=1e-3)


def test_what_was_melted_by_day_leaves_new_snow_of_the_next_night_alone():
    night = np.arange(PARTS + 1) // 64 % 2 == 0
    weather = Weather(np.where(night, 0.02 / HOUR, 0.0), np.where(night, -6.0, 20.0), time_scale=24 * 600.0)
    span, matter = Span(0.0, PARTS, 24.0), w.matter_of("snow", 0.4, 0.01)
    morning, noon, two = (course_of(weather, matter, frame=frame, span=span) for frame in (64.0, 128.0, 192.0))
    assert noon.cover[0] == 0.0
    assert noon.thawed[0] > 0.02
    assert two.cover[0] == pytest.approx(morning.cover[0], rel=1e-6)
    assert two.thawed[0] == noon.thawed[0]
    since = two.since(128.0, two.thawed)
    assert since == 0.0
