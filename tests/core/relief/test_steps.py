"""Relief of steps: volumes stay, no two prints are alike, later steps wipe out earlier ones, and all of it grows."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from softground_addon.core.composers.relief_plan import TREAD
from softground_addon.core.ground import presets
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.playback.ramps import QUANTUM
from softground_addon.core.playback.vertex_histories import vertex_histories
from softground_addon.core.record.pressed_ground import sample_at
from softground_addon.core.relief import amounts
from softground_addon.core.relief.print_shape import shape_of
from softground_addon.core.relief.steps import ReliefSettings, all_together, relief_of_steps, water_at
from softground_addon.core.relief.tread import SoleTread, bare, hiking
from tests.core.walkers import pressed, walk
from tests.tiers import slow_but_one

MATERIALS = {
    "snow": GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005),
    "sand": GroundMaterial(900e3, 0.5, 0.05, blur_sigma=0.01, repose_angle=0.5585, rim_bias=0.6),
    "wet_sand": GroundMaterial(1500e3, 0.5, 0.05, blur_sigma=0.005),
    "mud": GroundMaterial(625e3, 0.35, 0.15, blur_sigma=0.01),
    "soil": GroundMaterial(1100e3, 0.35, 0.05, blur_sigma=0.005),
}
SPACING = 0.0025
SHOWN = {"frame": 500.0, "frame_rate": 30.0, "cell_size": 0.005}


@cache
def steps_on(look, cell_size=0.005):
    return tuple(pressed(walk(steps=2), MATERIALS[look], cell_size)[1])


def around(footprints, spacing=SPACING, reach=0.26):
    """A grid of places around footprints, (2, K)."""
    low = np.min([step.position[:2] for step in footprints], axis=0) - reach
    high = np.max([step.position[:2] for step in footprints], axis=0) + reach
    x, y = np.meshgrid(*(np.arange(a, b, spacing) for a, b in zip(low, high, strict=True)))
    return np.stack([x.ravel(), y.ravel()])


def settings_of(look, footprints, **more):
    treads = {(step.character, step.sole): SoleTread(hiking) for step in footprints}
    return ReliefSettings(amounts.of_look(look), **({"treads": treads} | more))


def relief(look, footprints, place, **more):
    return relief_of_steps(footprints, *place, settings_of(look, footprints, **more),
                           blur_sigma=MATERIALS[look].blur_sigma)  # fmt: skip


@pytest.mark.parametrize("pattern", slow_but_one([hiking, bare]))
@pytest.mark.parametrize("look", SURFACES)
def test_volumes_stay_within_a_percent_and_heights_change(look, pattern):
    footprints = steps_on(look)
    place = around(footprints)
    treads = {(step.character, step.sole): SoleTread(pattern) for step in footprints}
    reliefs = relief(look, footprints, place, treads=treads)
    sample = sample_at(footprints, *place, **SHOWN, blur_sigma=MATERIALS[look].blur_sigma)
    for step in reliefs:
        pressed_there = sample.compression[step.point].sum()
        assert abs(step.change[:, 0].sum()) < 0.01 * pressed_there
        assert step.tread
    height = all_together(reliefs, place.shape[1])[:, 0]
    assert np.abs(height).max() > 0.003


def test_the_same_places_give_the_same_bytes_in_any_company():
    footprints = steps_on("soil")
    place = around(footprints)
    whole = all_together(relief("soil", footprints, place), place.shape[1])
    again = all_together(relief("soil", footprints, place), place.shape[1])
    lower = np.arange(place.shape[1] // 2)  # the lower half
    alone = all_together(relief("soil", footprints, place[:, lower]), len(lower))
    assert np.array_equal(whole, again)
    assert np.array_equal(whole[lower], alone)


def test_no_two_prints_are_alike_where_all_but_the_step_is_the_same():
    step = steps_on("snow")[0]
    later = replace(step, start_frame=step.start_frame + 100, end_frame=step.end_frame + 100)
    place = around([step])
    first, other = (all_together(relief("snow", [each], place), place.shape[1])[:, 0] for each in (step, later))
    moved = (first != 0) & (other != 0)
    assert np.std(first[moved] - other[moved]) > 0.5 * np.std(first[moved])


def test_a_later_step_in_the_same_place_leaves_its_own_relief_alone_under_it():
    step = steps_on("snow")[0]
    later = replace(step, start_frame=step.start_frame + 100, end_frame=step.end_frame + 100)
    place = around([step])
    alone = all_together(relief("snow", [later], place), place.shape[1])[:, 0]
    both = all_together(relief("snow", [step, later], place), place.shape[1])[:, 0]
    x, y = place - step.position[:2, None]
    middle = np.hypot(x, y) < 0.008
    assert np.abs(both - alone)[middle].max() <= 4 * QUANTUM
    assert np.abs(both - alone).max() > 0.002  # around it the earlier one stands


def test_relief_grows_with_the_ramps_of_its_step_and_never_back():
    footprints = steps_on("wet_sand")[:1]
    place = around(footprints, 0.004)
    of_steps = relief("wet_sand", footprints, place)
    sigma = MATERIALS["wet_sand"].blur_sigma
    plain = vertex_histories(footprints, *place, blur_sigma=sigma).movement
    with_it = vertex_histories(footprints, *place, blur_sigma=sigma, relief=of_steps).movement
    count = place.shape[1]
    frames = np.arange(footprints[0].start_frame - 3, footprints[0].end_frame + 3)
    heights, reliefs = np.stack([[a.at(f, count)[:, 0] for f in frames] for a in (plain, with_it)])
    grown = np.abs(reliefs - heights)
    assert (np.diff(grown, axis=0) > -4 * QUANTUM).all()
    assert np.abs((reliefs - heights)[-1] - all_together(of_steps, count)[:, 0]).max() <= 4 * QUANTUM
    ramped = np.isin(np.arange(count), plain.point)
    still = (np.diff(heights, axis=0) == 0) & (np.diff(plain_compression(plain, frames, count), axis=0) == 0)
    assert (np.abs(np.diff(reliefs, axis=0))[still & ramped] <= QUANTUM).all()
    assert len(with_it.point) <= len(plain.point) + (~ramped).sum()  # ramps carry it, none are added for it


def plain_compression(movement, frames, count):
    return np.array([movement.at(frame, count)[:, 1] for frame in frames])


def test_off_changes_nothing_and_strength_is_a_share():
    footprints = steps_on("mud")
    place = around(footprints, 0.005)
    whole = all_together(relief("mud", footprints[:1], place), place.shape[1])
    half = all_together(relief("mud", footprints[:1], place, strength=0.5), place.shape[1])
    assert np.abs(half - whole / 2).max() <= QUANTUM
    assert not all_together(relief("mud", footprints, place, strength=0.0), place.shape[1]).any()


def test_lengths_are_those_of_the_ground_and_not_of_the_foot_down_to_small_feet():
    """A print of a tenth of the size is as ragged for its size as the grain lets it be, and stays a print."""
    step = steps_on("snow")[0]
    small = replace(step, cell_size=step.cell_size / 10, position=step.position / 10)
    shrunk = small.tile(small.compression).max()
    assert shrunk == pytest.approx(step.max_depth_m)  # cells shrink, depths do not: a deep narrow hole
    place = around([small], SPACING / 10, 0.026)
    reliefs = relief("snow", [small], place)
    assert reliefs[0].change[:, 0].std() < 1.2 * step.max_depth_m
    assert np.isfinite(reliefs[0].change).all()


def test_tables_name_what_is_wrong():
    from softground_addon.core.errors import InputError

    for text, message in (
        ("{", "not JSON"),
        ("[]", "not a table"),
        ('{"depth": 5, "edges": {}}', "must be a table of"),
        ('{"depth": 5, "floor": {"size": 3}}', "lacks amount"),
        ('{"depth": 5, "floor": {"size": "a", "amount": 1}}', "must be a number"),
        ("{}", "lacks depth"),
    ):
        with pytest.raises(InputError, match=message):
            amounts.parse(text, "Relief 'x'", "soil")


def test_water_in_mud_leaves_half_of_the_tread_to_be_seen():
    step = steps_on("mud")[0]
    place = around([step])
    water = water_at(relief("mud", [step], place), place.shape[1])
    floor = shape_of(step, MATERIALS["mud"].blur_sigma).at(*place)[0] > 0.012
    assert 0.1 < (water[floor] > 0).mean() < 0.6


@pytest.mark.parametrize("pattern", [hiking, bare])
@pytest.mark.parametrize("name", ["snow", "dry_sand", "wet_sand", "mud", "soil"])
def test_soles_show_on_the_floor_on_each_of_the_grounds_that_two_clicks_give(name, pattern):
    preset = presets.find(name)
    look = preset.surface
    step = steps_on(look)[0]
    place = around([step])
    treads = {(step.character, step.sole): SoleTread(pattern)}
    with_it, without = (
        all_together(relief(look, [step], place, treads=treads, tread_strength=high / TREAD), place.shape[1])[:, 0]
        for high in (preset.tread, 0.0)
    )
    floor = shape_of(step, MATERIALS[look].blur_sigma).at(*place)[0] > 0.012
    assert np.std((with_it - without)[floor]) > 0.0005


def test_water_lies_level_in_mud_and_a_later_step_takes_it_along():
    step = steps_on("mud")[0]
    place = around([step])
    reliefs = relief("mud", [step], place)
    water = water_at(reliefs, place.shape[1])
    sample = sample_at([step], *place, **SHOWN, blur_sigma=MATERIALS["mud"].blur_sigma)
    surface = (sample.display + all_together(reliefs, place.shape[1])[:, 0] + water)[water > 0]
    assert water.max() > 0.004
    assert np.ptp(surface) <= 4 * QUANTUM
    assert water_at(relief("soil", [step], place), place.shape[1]) is None
