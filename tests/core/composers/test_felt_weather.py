"""Steps that feel the weather: a second step into a print that snow, rain, wind or warmth was at."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from softground_addon.core.composers.edited_steps import EditedSteps, with_edits
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.display_blur import blurred_window
from softground_addon.core.ground.heightfield import FlatTerrain, HeightField
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.regions import GroundKind, Regions
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.ground.sparse_grid import SparseGrid, Window
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.ground.terrain import MeshTerrain
from softground_addon.core.motion.motion import steps_per_frame
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.record.footprints import recompose
from softground_addon.core.record.record import BakeRecord
from softground_addon.core.weather import weather as w
from softground_addon.core.weather.felt_weather import FeltWeather, PrintsInWeather, weathering_of
from softground_addon.core.weather.weather import PARTS, Span
from softground_addon.core.weather.weather_course import course_of
from softground_addon.core.weather.weather_places import section_of, weather_places
from tests.core.walkers import box_sole, loads_of, pose, walk
from tests.core.weather.weathered_ground import weathered

RATE, CELL, LAYER = 24.0, 0.02, 0.4
MATERIAL = GroundMaterial(60e3, 0.1, 0.05, layer_depth=LAYER)
SPAN = Span(1.0, 1.0 + PARTS, RATE)
SIDE, FORCE = 0.6, 2000.0
DEPTH = FORCE / SIDE**2 * LAYER / 60e3
"""Of a first print [m]: 3.7 cm."""
FIRST, SECOND = (1, 48), (145, 192)
"""Frames of the two contacts."""
BETWEEN = np.arange(PARTS + 1)
BETWEEN = (BETWEEN >= 60) & (BETWEEN < 130)
"""Parts of the time in which there is weather: one each frame, none of them while anybody stands."""
SECONDS = BETWEEN.sum() / RATE
WHERE = Window(-40, -40, 80, 80)


def two_steps(second=1.0, first=1.0, later=0):
    """A flat sole that stands twice in one place, under parts of the force; the first time so many frames later."""
    count = 240 * steps_per_frame(RATE) + 1
    frames = 1.0 + np.arange(count) / steps_per_frame(RATE)
    force = np.zeros((count, 1))
    for (start, end), part in (((FIRST[0] + later, FIRST[1] + later), first), (SECOND, second)):
        force[(frames > start) & (frames <= end)] = part * FORCE
    poses = np.tile(pose([0.0, 0.0, 0.0]), (count, 1, 1, 1))
    return loads_of([box_sole(SIDE, SIDE)], [poses], force, force > 0, RATE)


def between(**rates):
    """Weather while nobody stands."""
    time_scale = rates.pop("time_scale", 1.0)
    rates["time_scale"] = tuple(np.where(BETWEEN, time_scale, 0.0).tolist())
    return FeltWeather(first=SPAN.first, last=SPAN.last, **rates)


def prints(weather, second=1.0, material=MATERIAL, loads=None):
    weathering = weathering_of(weather, LAYER)
    ground = SoftGround(FlatTerrain(), material, weathering=weathering)
    footprints = [
        footprint for result in simulate([loads or two_steps(second)], ground, CELL) for footprint in result.footprints
    ]
    return sorted(footprints, key=lambda footprint: footprint.start_frame)


def cells(footprints):
    """Compression and rim that the record has, over `WHERE`."""
    return recompose(footprints, cell_size=CELL).read(WHERE)


def gaussian(values, sigma):
    """As the display blurs."""
    return gaussian_filter(values, sigma / CELL, mode="constant", truncate=4.0) if sigma else values


def middle(footprints):
    return float(cells(footprints)[0][40, 40])


def course(weather, surface, frame, section=0.1):
    return course_of(weather, w.matter_of(surface, LAYER, section), frame=frame, span=SPAN)


@pytest.mark.parametrize("surface", ["snow", "sand", "soil"])
@pytest.mark.parametrize("options", [{}, {"hardening": 1.0, "repose_angle": np.radians(34.0)}, {"rim_bias": 0.5}])
def test_weather_that_is_none_changes_no_bit(surface, options):
    material, loads = replace(MATERIAL, **options), walk(steps=5, speed=0.2)
    calm = FeltWeather(temperature=-10.0, wind=2.0, time_scale=3600.0, surface=surface)
    plain, felt = (prints(weather, material=material, loads=loads) for weather in (None, calm))
    for footprint, other in zip(plain, felt, strict=True):
        assert footprint.compressed_m3 == other.compressed_m3
        for changes in ("compression", "rim"):
            before, after = getattr(footprint, changes), getattr(other, changes)
            assert np.array_equal(before.cells[:], after.cells[:])
            assert np.array_equal(before.amounts[:], after.amounts[:])
            assert np.array_equal(before.frames, after.frames)


def test_a_step_on_new_snow_is_as_deep_below_it_as_one_before_the_snow():
    weather = replace(between(snowfall=0.05 / SECONDS, temperature=-5.0), surface="snow")
    first, second = prints(weather)
    level = float(course(weather, "snow", SECOND[0]).cover[0])
    assert level == pytest.approx(0.05, rel=1e-4)
    assert middle([first]) == pytest.approx(DEPTH, rel=1e-3)
    # The layer is thicker by the new snow, and gives way the more.
    below = DEPTH * (1 + level / LAYER)
    assert middle([first, second]) == pytest.approx(below - level, abs=1e-5)
    assert middle([first, second]) < 0
    # In the middle, the second step found a print as deep as before with new snow in it, and pressed that snow alone.
    assert second.compressed_m3 > DEPTH * level / LAYER * SIDE**2


def test_a_step_on_untrodden_new_snow_is_that_deep_too():
    weather = replace(between(snowfall=0.05 / SECONDS, temperature=-5.0), surface="snow")
    loads = two_steps()
    loads.contacts.touching[: 100 * steps_per_frame(RATE)] = False
    (only,) = prints(weather, loads=loads)
    level = float(course(weather, "snow", SECOND[0]).cover[0])
    assert middle([only]) == pytest.approx(DEPTH * (1 + level / LAYER) - level, abs=1e-5)
    # Depth and volumes are those that the step pressed, and not the snow's.
    assert only.max_depth_m == pytest.approx(DEPTH * (1 + level / LAYER), rel=1e-3)
    assert len(only.pressing.frames) == len(only.compression.frames) - 1
    assert only.compressed_m3 == pytest.approx(DEPTH * (1 + level / LAYER) * SIDE**2, rel=0.02)
    assert only.rim_m3 == pytest.approx(2 * 0.1 * only.compressed_m3, rel=1e-9)


def test_a_crust_on_new_snow_carries_what_it_carries_while_it_snows():
    weather = FeltWeather(surface="snow", snowfall=0.1 / SECONDS, temperature=-5.0, first=SPAN.first, last=SPAN.last)
    pressure = FORCE / SIDE**2
    for strength in (1.01, 0.99):
        first, _ = prints(weather, material=replace(MATERIAL, crust_stress=strength * pressure))
        assert (first.max_depth_m > 0.02) == (strength < 1)


def test_a_print_that_rain_rounded_is_pressed_as_the_blur_left_it():
    rain = 0.03**2 / w.RAIN_ROUNDING / SECONDS
    weather = replace(between(rain=rain), surface="soil")
    first, second = prints(weather, second=0.8)
    made = cells([first])
    rounded = np.array([gaussian_filter(each, 0.03 / CELL, mode="constant", truncate=4.0) for each in made])
    assert np.abs(rounded - made).max() > 5e-3
    contact = np.zeros((80, 80), bool)
    contact[25:55, 25:55] = True
    pressed = np.where(contact, np.maximum(rounded[0], 0.8 * DEPTH), rounded[0])
    assert cells([first, second])[0][contact] == pytest.approx(pressed[contact], abs=2e-5)
    volume = (pressed - rounded[0])[contact].sum() * CELL**2
    assert second.compressed_m3 == pytest.approx(volume, rel=0.01)
    rim = second.rim_m3 / (second.rim_m3 + first.rim_m3)
    assert second.rim_m3 == pytest.approx(0.2 * second.compressed_m3, rel=1e-9)
    assert 0 < rim < 1


@pytest.mark.parametrize("part", [0.4, 1.0])
def test_sand_blown_into_a_print_is_pressed_down_again(part):
    weather = replace(between(wind=8.0, time_scale=600.0), surface="sand")
    first, second = prints(weather, second=part)
    section = first.compressed_m3 / np.sqrt(first.area_m2)
    flux = w.blown_flux(8.0, SURFACES["sand"].drifts_from)
    remaining = float(np.exp(-w.fill_rate(flux, section, SURFACES["sand"].density) * 600.0 * SECONDS))
    assert 0.5 < remaining < 0.9
    assert middle([first, second]) == pytest.approx(DEPTH * max(remaining, part), rel=2e-3)


def test_a_step_into_a_print_that_stands_up_in_a_thaw():
    weather = replace(between(temperature=4.0, time_scale=40_000.0), surface="snow")
    first, second = prints(weather)
    thawed = float(course(weather, "snow", SECOND[0]).thawed[0])
    assert 0.03 < thawed < LAYER / 2
    ratio = 1.0 - DEPTH / LAYER
    remaining = DEPTH - thawed * (1.0 - ratio**2)
    below = max(remaining, DEPTH * (1.0 - thawed / LAYER))
    assert middle([first, second]) == pytest.approx(below + thawed, abs=2e-5)


def test_new_snow_on_sand_is_trodden_down_to_the_sand():
    weather = replace(between(snowfall=0.05 / SECONDS, temperature=-5.0), surface="sand")
    assert middle(prints(weather)) == pytest.approx(DEPTH, rel=1e-3)


def test_wind_takes_of_a_print_what_it_fills_and_no_more():
    weather = replace(between(wind=8.0, time_scale=600.0), surface="sand")
    in_weather, ground = PrintsInWeather(weather, LAYER), HeightField(CELL)
    made = np.zeros((2, 80, 80))
    made[:, 35:45, 30:50] = np.random.default_rng(1).random((2, 10, 20)) * 0.05
    ground.write(WHERE, made)
    trodden = SparseGrid(CELL, channels=1)
    trodden.write(WHERE, made[:1] > 0)
    known = {"trodden": trodden, "pressed": made[0], "frame": 145.0, "sections": {"": 0.05}}
    aged = in_weather.aged(ground, WHERE, since=np.full((80, 80), 50.0), **known)
    share = np.exp(
        -w.fill_rate(w.blown_flux(8.0, SURFACES["sand"].drifts_from), 0.05, SURFACES["sand"].density) * 600.0 * SECONDS
    )
    assert aged.sum(axis=(1, 2)) == pytest.approx(share * made.sum(axis=(1, 2)), rel=1e-4)
    assert np.array_equal(in_weather.aged(ground, WHERE, since=np.full((80, 80), 145.0), **known), made)


def seen(footprints, weather, frame, *, felt, blur=0.01):
    """The surface that bake and weather show at the cells of `WHERE` [m]."""
    x, y = WHERE.centres(CELL)
    position = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], axis=-1).reshape(-1, 3)
    compression, rim = blurred_window(recompose(footprints), WHERE, blur)
    relief = (rim - compression).ravel()
    start, end = np.full((2, len(relief)), [[1e9], [-1e9]])
    for footprint in footprints:
        for changes in (footprint.compression, footprint.rim):
            for number, at in enumerate(changes.frames):
                changed = changes.cells[changes.first[number] : changes.first[number + 1]]
                row, column = np.divmod(changed, footprint.window.columns)
                where = (
                    (row + footprint.window.row - WHERE.row) * WHERE.columns
                    + column
                    + footprint.window.column
                    - WHERE.column
                )
                start[where], end[where] = np.minimum(start[where], at - 1.0), np.maximum(end[where], at)
    places = weather_places(
        footprints,
        position,
        relief,
        start,
        end,
        cell_size=CELL,
        blur_sigma=blur,
        layer_depth=LAYER,
        felt=felt,
    )
    matter = w.matter_of(weather.surface, LAYER, section_of(footprints[:1]))
    now = weathered(places, relief, weather, matter, frame=frame, span=SPAN)
    return (relief + now.height - now.water).reshape(len(y), len(x))


@pytest.mark.parametrize("blur", [0.0, 0.01, 0.03])
def test_a_step_on_new_snow_is_shown_without_a_seam_around_it(blur):
    weather = replace(between(snowfall=0.1 / SECONDS, temperature=-5.0), surface="snow")
    loads = two_steps()
    loads.contacts.touching[: 100 * steps_per_frame(RATE)] = False
    (only,) = prints(weather, loads=loads)
    level = weathering_of(weather, LAYER).level(SECOND[1])
    compression, rim = cells([only])
    below = compression + level * (compression < -level / 2)
    wanted = level + gaussian(rim - below, blur)
    assert np.abs(seen([only], weather, SECOND[1], felt=True, blur=blur) - wanted).max() < 1e-6


@pytest.mark.parametrize("surface", ["snow", "sand", "soil"])
@pytest.mark.parametrize(
    "rates",
    [
        {"snowfall": 0.05 / SECONDS, "temperature": -5.0},
        {"temperature": 4.0, "time_scale": 30_000.0},
        {"wind": 8.0, "time_scale": 300.0},
        {"rain": 0.03 / SECONDS},
        {"snowfall": 2e-5, "temperature": -3.0, "wind": 8.0, "rain": 2e-6, "time_scale": 300.0},
    ],
)
def test_a_step_that_hardly_presses_leaves_what_was_seen_before_it(surface, rates):
    """What the bake takes in of the weather is what is shown of it: nothing twice, nothing lost."""
    weather = replace(between(**rates), surface=surface)
    first, second = prints(weather, second=1e-6)
    before = seen([first], weather, SECOND[0], felt=True, blur=0.0)
    after = seen([first, second], weather, SECOND[1], felt=True, blur=0.0)
    inner = (slice(32, 48),) * 2
    if surface == "snow" or "snowfall" not in rates:
        assert after[inner] == pytest.approx(before[inner], abs=1e-7)
    else:
        assert (after[inner] < before[inner] - 0.01).all()  # trodden down to the ground
    plain = seen([first], weather, SECOND[0], felt=False, blur=0.0)
    assert before[inner] == pytest.approx(plain[inner], abs=1e-9)


ALL_AT_ONCE = {"snowfall": 0.03 / SECONDS, "temperature": 1.0, "wind": 8.0, "rain": 0.01 / SECONDS}
FELT = ["snow", "sand", "soil"]


def ground_in(weather):
    return SoftGround(FlatTerrain(), MATERIAL, weathering=weathering_of(weather, LAYER))


@pytest.mark.parametrize("surface", FELT)
@pytest.mark.parametrize(
    ("edit", "as_if"),
    [
        (StepEdit(strength=0.5), {"first": 0.5}),
        (StepEdit(mute=True), {"first": 0.0}),
        (StepEdit(shift_frames=40), {"later": 40}),
    ],
)
def test_an_edited_step_changes_the_later_one_as_if_it_had_been_so(surface, edit, as_if):
    # But for the wind: how fast it fills prints is always what those of the bake say.
    weather = replace(between(**(ALL_AT_ONCE | {"wind": 0.0})), surface=surface)
    record = BakeRecord(tuple(prints(weather, second=0.4)), {})
    after = with_edits(record, {step_id(record.footprints[0]): edit}, ground_in(weather), CELL)
    assert sorted(after.pressed_again) == [0, 1]
    whole = prints(weather, loads=two_steps(second=0.4, **as_if))
    assert np.abs(cells(after.edited) - cells(whole)).max() < 6e-5
    assert np.abs(cells(record.footprints) - cells(whole)).max() > 1e-3


def test_edits_one_after_the_other_end_where_all_at_once_do():
    weather = replace(between(**ALL_AT_ONCE), surface="snow")
    bake = BakeRecord(tuple(prints(weather, second=0.4)), {})
    first, second = map(step_id, bake.footprints)
    wanted = {first: StepEdit(strength=0.8), second: StepEdit(turn_deg=30.0)}
    steps = EditedSteps(bake.footprints, ground_in(weather), CELL)
    now = bake
    for edits in ({second: StepEdit(mute=True)}, {first: StepEdit(shift_frames=9)}, {}, wanted):
        now = steps.record_with(now, edits)
    assert record.dump(now) == record.dump(with_edits(bake, wanted, ground_in(weather), CELL))
    assert not steps.record_with(now, {}).pressed_again


HALVES = (GroundKind("snow", MATERIAL), GroundKind("sand", replace(MATERIAL, layer_depth=0.25, poisson_ratio=0.2)))


def side_by_side(weather):
    """A ground of snow beside sand, with a hard floor further away; and each of the two alone."""
    x = np.array([-20.0, 0.0, 6.0, 20.0])
    vertices = np.array([(across, along, 0.0) for across in x for along in (-20.0, 20.0)])
    first = 2 * np.repeat(np.arange(3), 2)
    corners = np.tile([[0, 2, 3], [0, 3, 1]], (3, 1)) + first[:, None]
    soft = corners[first < 4], np.repeat([0.0, 1.0], 2)
    terrain = MeshTerrain.from_mesh(vertices, soft[0], of_faces=soft[1])
    regions = Regions(HALVES, terrain)
    whole = SoftGround(terrain, MATERIAL, weathering=weathering_of(weather, LAYER, regions), regions=regions)
    alone = [
        replace(
            whole,
            material=kind.material,
            weathering=weathering_of(replace(weather, surface=kind.surface), kind.material.layer_depth),
            regions=None,
        )
        for kind in HALVES
    ]
    return whole, alone


def twice_in_each(ground, sides=(-1.5, 1.5)):
    """Prints of soles that stand twice, one on each side of the border."""
    both = []
    for x in sides:
        loads = two_steps()
        poses = loads.motion.soles[0].transforms.copy()
        poses[..., 0, 3] += x
        both.append(
            loads_of([box_sole(SIDE, SIDE)], [poses], loads.forces.forces[..., 2], loads.contacts.touching, RATE)
        )
    return [step for result in simulate(both, ground, CELL) for step in result.footprints]


@pytest.mark.parametrize(
    "rates",
    [
        {"snowfall": 0.05 / SECONDS, "temperature": -5.0},
        {"temperature": 4.0, "time_scale": 30_000.0},
        {"wind": 8.0, "time_scale": 300.0},
        {"snowfall": 2e-5, "temperature": -3.0, "wind": 8.0, "rain": 2e-6, "time_scale": 300.0},
    ],
)
def test_steps_in_each_region_find_the_weather_of_its_own_surface(rates):
    weather = replace(between(**rates), surface="snow")
    ground, alone = side_by_side(weather)
    mixed = twice_in_each(ground)
    assert {step.surface for step in mixed} == {"snow", "sand"}
    for kind, only, x in zip(HALVES, alone, (-1.5, 1.5), strict=True):
        mine = [step for step in mixed if step.surface == kind.surface]
        expected = twice_in_each(only, (x,))
        assert len(mine) == len(expected) == 2
        for step, other in zip(mine, expected, strict=True):
            assert step.compressed_m3 == pytest.approx(other.compressed_m3, rel=1e-9)
            assert step.rim_m3 == pytest.approx(other.rim_m3, rel=1e-9)
        inner = Window(round(x / CELL) - 40, -40, 80, 80)
        found, wanted = (recompose(prints, cell_size=CELL).read(inner) for prints in (mine, expected))
        assert np.abs(found - wanted).max() < 2e-9
    levels = ground.weathering.levels(SECOND[0], np.array([-1.0, 1.0, 7.0]), np.zeros(3))
    assert levels[0] == alone[0].weathering.level(SECOND[0])
    assert levels[1] == levels[2] == 0.0, "steps tread new snow down to sand, and to a hard floor"


def test_a_region_of_one_kind_is_the_ground_under_weather_bit_for_bit():
    weather = replace(between(snowfall=2e-5, temperature=-3.0, wind=8.0, time_scale=300.0), surface="snow")
    ground, (alone, _) = side_by_side(weather)
    regions = Regions(HALVES[:1], replace(ground.regions.where, values=np.zeros_like(ground.regions.where.values)))
    single = replace(ground, regions=regions, weathering=weathering_of(weather, LAYER, regions))
    for step, other in zip(twice_in_each(single), twice_in_each(alone), strict=True):
        assert step.compressed_m3 == other.compressed_m3
        assert np.array_equal(step.tile(step.compression), other.tile(other.compression))
        assert np.array_equal(step.tile(step.rim), other.tile(other.rim))
