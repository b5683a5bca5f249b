"""A track under weather: what each place has kept from its record, and what becomes of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from softground_addon.core.ground.display_blur import blurred_window
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.record.footprints import recompose
from softground_addon.core.weather.hollows import hollows
from softground_addon.core.weather.weather import DEGREE_DAY, WATER_DENSITY, Span, matter_of
from softground_addon.core.weather.weather_course import Weather, course_of
from softground_addon.core.weather.weather_places import (
    NOT_YET,
    POWERS,
    SIGMAS,
    WeatherPlaces,
    rise_of,
    section_of,
    weather_places,
)
from tests.core.walkers import pressed, walk
from tests.core.weather.weathered_ground import weathered

CELL, BLUR, RATE = 0.01, 0.005, 30.0
MATERIAL = GroundMaterial(200e3, 0.3, 0.1, blur_sigma=BLUR)
HOUR, DAY = 3600.0, 86_400.0
SPAN = Span(1.0, 600.0, RATE)


@pytest.fixture(scope="module")
def track():
    _, footprints = pressed(walk(steps=3), MATERIAL)
    x, y = np.meshgrid(np.arange(-0.6, 3.0, CELL) + CELL / 2, np.arange(-0.7, 0.7, CELL) + CELL / 2)
    return footprints, np.stack([x, y, np.zeros_like(x)], axis=-1)


@pytest.fixture(scope="module")
def imprinted(track):
    footprints, position = track
    ground = recompose(footprints)
    compression, rim = ground.sample(position[..., 0].ravel(), position[..., 1].ravel())
    raw = (rim - compression).reshape(position.shape[:2])
    relief = gaussian_filter(raw, BLUR / CELL, mode="constant")
    never = np.full(relief.size, 1e9)
    places = weather_places(
        footprints,
        position.reshape(-1, 3),
        relief.ravel(),
        never,
        -never,
        cell_size=CELL,
        blur_sigma=BLUR,
        layer_depth=0.3,
    )
    return raw, relief, places


def at(imprinted, weather, frame, surface="snow", section=0.01):
    _, relief, places = imprinted
    matter = matter_of(surface, 0.3, section)
    result = weathered(places, relief.ravel(), weather, matter, frame=frame, span=SPAN)
    return replace(result, height=result.height.reshape(relief.shape))


def test_the_blurred_relief_is_that_of_scipy(imprinted):
    raw, relief, places = imprinted
    known = np.cumsum(np.concatenate([relief.reshape(-1, 1), places.blur], axis=1), axis=1)
    for sigma, ours in zip(SIGMAS, known.T[1:], strict=True):
        theirs = gaussian_filter(raw, np.hypot(sigma, BLUR) / CELL, mode="constant", truncate=4.0)
        np.testing.assert_allclose(ours.reshape(raw.shape), theirs, rtol=0, atol=1e-3 * np.abs(raw).max())
        assert ours.sum() == pytest.approx(raw.sum(), rel=1e-4)  # no volume is lost


def test_ages_are_those_of_the_contacts(track, imprinted):
    footprints, position = track
    _, _, places = imprinted
    for footprint in footprints:
        near = np.hypot(*(position.reshape(-1, 3)[:, :2] - footprint.position[:2]).T).argmin()
        first, last, _ = places.times[near]
        assert footprint.start_frame - 1 <= first <= last <= footprint.end_frame + 1
    assert places.times[0, 1] > 1e6  # far from any print nothing has an age


def later(footprint, frames):
    """The same footprint, made some frames later."""
    compression, rim = (
        replace(changes, frames=changes.frames + frames) for changes in (footprint.compression, footprint.rim)
    )
    return replace(
        footprint,
        start_frame=footprint.start_frame + frames,
        end_frame=footprint.end_frame + frames,
        compression=compression,
        rim=rim,
        contact_start=footprint.contact_start[:] + frames,
        contact_end=footprint.contact_end[:] + frames,
    )


@pytest.mark.parametrize("weather", [{"wind": 9.0}, {"rain": 50e-3 / HOUR}, {"snowfall": 0.05 / HOUR}])
def test_a_print_changes_until_somebody_steps_into_it_and_as_a_new_one_after(track, weather):
    footprints, position = track
    first, place = footprints[0], position.reshape(-1, 3)
    never = np.full(len(place), 1e9)

    def places(*steps):
        return weather_places(
            steps, place, shown(*steps), never, -never, cell_size=CELL, blur_sigma=BLUR, layer_depth=0.3
        )

    def shown(*steps):
        raw = recompose(steps).sample(*place[:, :2].T)
        return gaussian_filter((raw[1] - raw[0]).reshape(position.shape[:2]), BLUR / CELL, mode="constant").ravel()

    single, second, twice = places(first), places(later(first, 300)), places(first, later(first, 300))
    sky, sand = Weather(**weather, temperature=-5.0, time_scale=300.0), matter_of("sand", 0.3, 0.01)
    begin = first.start_frame + 300
    away = single.times[:, 1] > 1e6
    for frame in (begin - 150, begin - 1):
        results = (weathered(each, shown(first), sky, sand, frame=frame, span=SPAN) for each in (single, twice))
        alone, now = (result.height - result.water for result in results)  # water stands in the last print
        change = np.abs(alone - alone[away].max()).max()
        assert change > 2e-3
        np.testing.assert_allclose(now, alone, rtol=0, atol=0.01 * change)
    after = first.end_frame + 400
    np.testing.assert_array_equal(twice.times[:, 1], second.times[:, 1])
    trodden = twice.trodden[:, 0] > 0.99
    alone, now = (weathered(each, shown(first), sky, sand, frame=after, span=SPAN) for each in (second, twice))
    np.testing.assert_allclose(now.fresh[trodden], alone.fresh[trodden], atol=1e-6)


def test_prints_apart_have_no_print_before_them(imprinted):
    _, _, places = imprinted
    assert not places.blur_before.any()
    assert (places.again[:, 0] < 0).all()


def test_no_weather_changes_nothing_and_neither_does_any_before_the_bake(imprinted):
    heavy = Weather(0.1 / HOUR, 5.0, 12.0, 30e-3 / HOUR, 1e-7, 1e3)
    for result in (at(imprinted, Weather(time_scale=1e5), 900.0), at(imprinted, heavy, 1.0)):
        assert not result.height.any()
        assert not result.fresh.any()
        assert not result.water.any()


def test_a_print_is_gone_under_a_night_of_snow(imprinted):
    _, relief, places = imprinted
    snow = Weather(snowfall=0.03 / HOUR, temperature=-5.0, time_scale=2880.0)
    heights = [relief + at(imprinted, snow, frame).height for frame in (60.0, 150.0, 400.0)]
    deep = relief < 0.8 * relief.min()
    away = places.times[:, 1].reshape(relief.shape) > 1e6
    depths = [float(height[away].mean() - height[deep].mean()) for height in heights]
    assert depths[0] > depths[1] > depths[2]
    cover = course_of(snow, matter_of("snow", 0.3, 0.01), frame=400.0, span=SPAN).cover[0]
    assert heights[-1][away] == pytest.approx(cover, rel=1e-9)


def lone(depth, *, capacity=0.0, rise=(0.0,) * POWERS):
    """A flat-bottomed print of a depth, deep within it, made at the first frame."""
    times = np.array([[1.0, 1.0, depth]])
    pool, levels = np.array([[capacity, depth, 1.0]]), np.array([[*rise, 1.0]])
    return WeatherPlaces(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), times, pool, levels, *never(1))


def never(count):
    """No step into an earlier print."""
    return np.zeros((count, 3)), np.tile([-NOT_YET, NOT_YET], (count, 1))


def test_a_print_stands_up_as_a_pedestal_in_a_thaw():
    thaw, matter = Weather(temperature=5.0), matter_of("snow", 0.3, 0.01)
    span = Span(0.0, 3 * DAY, 1.0)
    days = np.linspace(2.0, 3 * DAY, 200)
    within = np.array(
        [weathered(lone(0.12), np.array([-0.12]), thaw, matter, frame=day, span=span).height[0] for day in days]
    )
    around = -np.minimum(0.3, DEGREE_DAY * 5.0 * days * WATER_DENSITY / matter.density)
    above = -0.12 + within - around
    assert above[0] == pytest.approx(-0.12, abs=1e-4)
    turned = days[np.argmax(above > 0)]
    # When what is around has lost depth/(1 + (depth - compression)/depth).
    loss = 0.3 / (1 + 0.18 / 0.3)
    assert turned == pytest.approx(loss * matter.density / 1000 / (DEGREE_DAY * 5.0), rel=0.02)
    assert above.max() == pytest.approx(0.3 * 0.6 * 0.4, rel=0.02)  # as the ground around comes bare


def test_water_from_below_comes_up_to_its_table_in_seconds():
    matter, span = matter_of("wet_sand", 0.3, 0.01), Span(1.0, 600.0, RATE)
    places = lone(0.05, capacity=0.03, rise=(0.05, 0.0, 0.0))  # 5 cm deep
    for table, full in ((0.02, 0.03), (0.06, 0.0)):
        for seconds in (0.0, 5.0, 30.0):
            frame = 1.0 + seconds * RATE
            now = weathered(places, np.array([-0.05]), Weather(water_table=table), matter, frame=frame, span=span)
            assert now.water == pytest.approx([full * (1 - np.exp(-seconds / 5.0))], rel=1e-3)
            assert now.height == pytest.approx(now.water)


def test_sand_is_pale_around_a_loaded_foot_and_wet_again_seconds_after(imprinted):
    _, _, places = imprinted
    first, last, _ = places.times.T
    foot = (places.trodden[:, 0] > 0.9) & (last < 60.0)
    before, loaded, after = (
        at(imprinted, Weather(halo=1.0), frame, "wet_sand").dried
        for frame in (first[foot].min() - 1, last[foot].max(), last[foot].max() + 10 * RATE)
    )
    assert not before[foot].any()
    assert loaded[foot].max() == pytest.approx(1.0, abs=0.05)
    assert after[foot].max() < 0.01
    assert not loaded[first > 1e6].any()
    assert not at(imprinted, Weather(halo=1.0), 60.0, "mud").dried.any()


def test_wind_fills_and_conserves_nothing_but_rain_moves_ground_alone(imprinted):
    _, relief, _ = imprinted
    wind = at(imprinted, Weather(wind=9.2, time_scale=100.0), 900.0, "sand")
    assert np.abs(relief + wind.height).max() < 0.1 * np.abs(relief).max()
    rain = at(imprinted, Weather(rain=20e-3 / HOUR, time_scale=60.0), 900.0, "sand", 0.01)
    moved = np.where(rain.water.reshape(relief.shape) > 0, 0.0, rain.height)
    assert moved.sum() == pytest.approx(0.0, abs=2e-2 * np.abs(relief).sum())
    assert np.abs(relief + rain.height).max() < np.abs(relief).max()


@pytest.mark.parametrize(
    "weather", [Weather(wind=9.0, time_scale=60.0), Weather(snowfall=3e-2 / HOUR, time_scale=2880.0)]
)
def test_creeping_sand_and_draping_snow_move_what_is_there_and_lose_none_of_it(imprinted, weather):
    raw, relief, places = imprinted
    alike = replace(places, times=np.where([True, True, False], SPAN.first, places.times))  # all of one age
    bottomless = 1e9  # so that wind fills nothing
    moved = at((raw, relief, alike), weather, 300.0, "sand", bottomless)
    cover = course_of(weather, matter_of("sand", 0.3, bottomless), frame=300.0, span=SPAN).cover[0]
    change = moved.height - cover
    assert np.abs(change).sum() > 0.5 * np.abs(relief).sum()
    assert abs(change.sum()) < 1e-4 * np.abs(relief).sum()


def test_puddles_are_level_and_spill_no_higher_than_their_brim(imprinted):
    _, relief, places = imprinted
    rain = at(imprinted, Weather(rain=40e-3 / HOUR, time_scale=240.0), 900.0, "mud")
    water = rain.water.reshape(relief.shape)
    assert (water > 0).sum() > 20
    surface = (relief + rain.height)[water > 0]
    pools = places.pool[(water > 0).ravel()]
    for capacity in np.unique(pools[:, 0]):
        assert np.ptp(surface[pools[:, 0] == capacity]) < 1e-9
    assert surface.max() < relief.max()


def test_puddles_are_level_while_they_fill(imprinted):
    _, relief, places = imprinted
    rain = at(imprinted, Weather(rain=30e-3 / HOUR, time_scale=20.0), 400.0, "mud")
    wet = rain.water > 0
    surface, since = (relief + rain.height).ravel()[wet.ravel()], places.levels[wet.ravel(), POWERS]
    assert 0.0 < rain.water.max() < 0.5 * np.ptp(relief)
    for age in np.unique(since):
        assert np.ptp(surface[since == age]) < 1e-9


def test_the_water_level_of_a_print_is_that_of_its_volume_curve(track):
    ground = recompose(track[0])
    for footprint in track[0]:
        compression, rim = blurred_window(ground, footprint.window.expanded(1), BLUR)
        for hollow in hollows(rim - compression, CELL**2):
            full = np.linspace(0.0, 1.0, 200)
            level = np.sqrt(full)[:, None] ** np.arange(1, POWERS + 1) @ rise_of(hollow)
            wanted = hollow.level(full * hollow.capacity) - hollow.bottom
            np.testing.assert_allclose(level, wanted, rtol=0, atol=0.01 * wanted[-1])
            assert level[-1] == pytest.approx(wanted[-1])


def test_a_section_is_that_of_the_prints(track):
    footprints, _ = track
    first = footprints[0]
    assert section_of([first]) == pytest.approx(first.compressed_m3 / first.area_m2**0.5)
