"""Plants under feet: the closed forms of their bend, and the passes that a record of footprints comes to."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.plants import bending
from softground_addon.core.plants.bending import PLANTS, Pass, Plant, bend, cover, held, lasting_of
from softground_addon.core.plants.sole_passes import BESIDE
from softground_addon.core.plants.swings import SWING_HEIGHT
from softground_addon.core.plants.tramplings import SHUTTER, tramplings
from softground_addon.core.record.footprints import recompose
from tests.core.walkers import walk

MUD = GroundMaterial(0.3e6, 0.35, 0.15)
RATE = 60.0
GRASS = Plant(0.3, 0.0, 100.0, 1.0, 150.0)
TREAD = Pass(10.0, 20.0, 0.01, 0.02, 1.0, 0.0, 1.0, 0.0)


def angle(by, plant, frame, chance=0.0):
    return np.asarray(bend(by, plant, frame, 25.0, chance)[0]) * 90.0


def test_no_tip_of_a_blade_is_above_the_sole_at_any_height():
    heights, clearances = np.meshgrid(np.geomspace(0.01, 2.0, 40), np.geomspace(1e-5, 2.0, 200))
    tip = heights * np.cos(held(clearances, heights) * np.pi / 2)
    touched = clearances < heights
    assert (tip[touched] <= clearances[touched] * (1 + 1e-9) + 1e-12).all()
    assert (held(clearances, heights)[~touched] == 0).all()


def test_a_blade_stands_until_the_sole_is_at_its_height_and_lies_while_that_stands():
    touches = TREAD.start - GRASS.height / TREAD.down
    assert (angle(TREAD, GRASS, np.array([touches - 50, touches - 1e-3])) == 0).all()
    assert (np.diff(angle(TREAD, GRASS, np.linspace(touches, TREAD.start, 50))) >= 0).all()
    np.testing.assert_allclose(angle(TREAD, GRASS, np.array([10.0, 15.0, 20.0])), 90.0)


@pytest.mark.parametrize(("pressure", "stays"), [(0.0, 0.0), (75e3, 0.5), (150e3, 1.0), (900e3, 1.0)])
def test_it_rises_exponentially_to_what_lasts(pressure, stays):
    by = replace(TREAD, lasting=lasting_of(pressure))
    low, age = stays * 90.0 * bending.MOST_LASTING, np.array([60.0, 100.0, 700.0])
    expected = low + (90.0 - low) * np.exp(-age / GRASS.recovery)
    np.testing.assert_allclose(angle(by, GRASS, by.end + age * 25.0), expected, rtol=1e-4, atol=1e-3)


def test_of_what_two_passes_leave_bent_the_shares_multiply():
    np.testing.assert_allclose(np.exp(-2 * lasting_of(75e3)), 0.25)


def test_half_of_the_plants_lie_for_good_after_the_passes_of_their_preset():
    chance, late = (np.arange(1000) + 0.5) / 1000, TREAD.end + 1e6
    for passes, height in ((150, 0.5), (300, 0.25)):
        assert cover(passes, 150.0) == pytest.approx(height)
        lie = angle(replace(TREAD, passes=float(passes)), GRASS, late, chance) > 45.0
        assert lie.mean() == pytest.approx(1 - height, abs=2e-3)


def test_stiff_plants_spring_back_and_what_brushes_them_leaves_less():
    after = TREAD.end + 100
    stiff = angle(TREAD, replace(GRASS, stiffness=0.5), after)
    assert stiff == pytest.approx(0.5 * angle(TREAD, GRASS, after))
    brushed = angle(replace(TREAD, above=SWING_HEIGHT, passes=0.0), GRASS, after)
    assert brushed == pytest.approx(bending.BRUSHED * angle(TREAD, GRASS, after))


def test_what_hardly_reaches_a_blade_leaves_it_as_it_was_bent_before():
    for reach in (0.0, 0.1, 1.0):
        _, weight = bend(replace(TREAD, reach=reach), GRASS, np.array([15.0, 25.0]), 25.0, 0.0)
        assert weight == pytest.approx(reach)


def test_presets_are_of_the_trials():
    assert all(0 <= plant.stiffness <= 1 and 75 <= plant.half_after <= 300 for _, plant in PLANTS.values())


@pytest.fixture(scope="module")
def steps():
    """Footprints of two walks along one line, the second later, and the ground that they leave."""
    ground = SoftGround(FlatTerrain(), MUD)
    return [print_ for result in simulate([walk(steps=4)], ground, 0.01) for print_ in result.footprints]


def test_no_blade_moves_before_the_first_frame_of_the_shot(steps):
    """Where feet stand that would come down on tall blades earlier."""
    first = min(step.load_frames[0] - step.pressed_by.first * step.load_spacing for step in steps)
    table = tramplings(steps)
    assert table.active.min() == first - SHUTTER
    assert (table.active <= table.by.start).all()


def shifted(steps, frames):
    return [
        replace(
            step,
            start_frame=step.start_frame + frames,
            end_frame=step.end_frame + frames,
            load_frames=step.load_frames + frames,
            contact_start=step.contact_start + frames,
            contact_end=step.contact_end + frames,
        )
        for step in steps
    ]


def places_of(step):
    x, y = (values.ravel()[step.contact_cells] for values in np.meshgrid(*step.window.centres(step.cell_size)))
    return x, y


def test_all_that_soles_touch_is_trodden_when_they_touch_it(steps):
    table = tramplings(steps)
    for step in steps:
        latest = table.latest(*places_of(step))
        assert (table.by.passes[latest] == 1).all()
        assert (table.by.start[latest] <= step.contact_start + 1e-9).all()
        assert (table.by.end[latest] >= step.contact_end - 1e-9).all()
        assert (table.latest(*places_of(step), step.start_frame - 1e4) == -1).all()


def test_nothing_acts_far_from_the_trail(steps):
    x, y = np.random.default_rng(0).uniform(-5.0, 5.0, (2, 20_000))
    touched = np.concatenate([np.column_stack(places_of(step)) for step in steps])
    table = tramplings(steps)
    trodden = table.latest(x, y)
    trodden = np.flatnonzero((trodden >= 0) & (table.by.above[trodden] == 0))
    apart = np.linalg.norm(np.stack([x, y], 1)[trodden, None] - touched, axis=2).min(axis=1)
    rim = max(step.window.columns * step.cell_size for step in steps)  # litter rises with it
    assert len(trodden) > 20
    assert apart[table.by.reach[table.latest(x, y)[trodden]] > 0].max() < BESIDE + 2 * table.cell_size
    assert apart.max() < rim


def test_the_ground_under_litter_changes_by_the_volume_of_the_record(steps):
    table, ground = tramplings(steps), recompose(steps)
    windows = [step.window for step in steps]
    whole = windows[0]
    for window in windows[1:]:
        whole = whole.union(window)
    compression, rim = ground.read(whole)
    slots = np.flatnonzero(np.diff(table.first))
    last = table.first[slots + 1] - 1
    assert table.sink[last].sum() * table.cell_size**2 == pytest.approx((rim - compression).sum() * 1e-4, rel=1e-3)


def test_who_treads_twice_counts_twice_and_bends_more_for_good(steps):
    once, twice = tramplings(steps), tramplings([*steps, *shifted(steps, 400)])
    x, y = places_of(steps[1])
    single, two = once.latest(x, y), twice.latest(x, y)
    np.testing.assert_allclose(twice.by.passes[two], 2 * once.by.passes[single])
    np.testing.assert_allclose(twice.by.lasting[two], 2 * once.by.lasting[single])
    np.testing.assert_allclose(twice.sink[two], 2 * once.sink[single], atol=1e-9)
    before = twice.latest(x, y, 300.0)
    np.testing.assert_allclose(twice.by.start[before], once.by.start[single])


def test_passes_of_a_cell_follow_each_other_in_time(steps):
    table = tramplings([*shifted(steps, 400), *steps, *shifted(steps, 90)])
    slot = np.repeat(np.arange(len(table.first) - 1), np.diff(table.first))
    same = slot[1:] == slot[:-1]
    assert same.sum() > 50
    assert (np.diff(table.active)[same] >= 0).all()
    assert (np.diff(table.by.start)[same] >= 0).all()
    assert (np.diff(table.by.passes)[same] >= 0).all()


def test_blades_lean_where_the_foot_travels_and_outward_beside_it(steps):
    table = tramplings(steps)
    step = steps[1]
    under = table.latest(*places_of(step))
    assert (table.direction[under] @ (np.cos(step.heading), np.sin(step.heading))).min() > 0
    np.testing.assert_allclose(np.linalg.norm(table.direction, axis=1), 1.0, atol=1e-6)


def test_legs_part_tall_grass_to_both_sides_of_their_way_and_leave_short_grass(steps):
    first, after = (step for step in steps if step.sole == steps[0].sole)
    ahead = after.position[:2] - first.position[:2]
    ahead /= np.linalg.norm(ahead)
    aside, middle = np.array((-ahead[1], ahead[0])), (first.position[:2] + after.position[:2]) / 2
    table = tramplings([first, after])
    tall, short = Plant(1.5, 0.5, 20.0, 0.4, 100.0), replace(GRASS, height=SWING_HEIGHT)
    for side in (-1.0, 1.0):
        for away in (0.08, 0.11):
            number = table.latest(*(middle + side * away * aside)[:, None])[0]
            by = Pass(*(values[number] for values in vars(table.by).values()))
            assert table.direction[number] @ aside == pytest.approx(side)
            assert 10.0 < angle(by, tall, (by.start + by.end) / 2) < 40.0
            assert angle(by, short, (by.start + by.end) / 2) == 0.0
            closing = angle(by, tall, by.end + 25.0 * np.array([5.0, 60.0, 300.0]))
            assert (np.diff(closing) < 0).all()
            assert closing[-1] < 0.1
    assert table.latest(*(middle + 0.4 * aside)[:, None])[0] == -1


def test_without_a_print_there_is_no_table(steps):
    assert tramplings([]) is None
