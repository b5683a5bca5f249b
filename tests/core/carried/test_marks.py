"""Marks on hard floors: they lie on them, in the shape of the sole, and weigh what the soles have left."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from softground_addon.core.carried.ageing import aged
from softground_addon.core.carried.hard_print import BEDDING, CLEARANCE, bedded, laid, sole_grid, swept
from softground_addon.core.carried.marks import _pieces, marks_of
from softground_addon.core.events.events import events
from softground_addon.core.ground import surfaces
from softground_addon.core.ground.hard_ground import HardOnSoft, Reach
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.surfaces import LIQUIDS
from softground_addon.core.ground.terrain import MeshTerrain
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.record.record import BakeRecord
from softground_addon.core.weather import weather
from tests.core.ground.test_hard_ground import SNOW, lifted, slab, standing_on
from tests.core.prop_bodies import rolling
from tests.core.walkers import box_sole, foot_sole, pose, pressed, walk

FLOOR = 0.1


@cache
def crossing(steps=12, onto=2.5, ends=9.0):
    """A walk from soft ground onto a floor, its record and the ground."""
    flat = walk(steps=steps).motion
    motion = lifted(flat, FLOOR, onto, ends)
    terrain = standing_on([motion], slab((onto, ends), (-1, 1), FLOOR))
    loads = estimate_loads(motion, terrain, force_model="IMPULSE", material=SNOW)
    _, footprints = pressed(loads, SNOW, terrain=terrain)
    return loads, footprints, terrain


def marks(surface="mud", muted=(), wet=None, **options):
    loads, footprints, terrain = crossing()
    terrain = replace(terrain, wet=wet or {})
    steps = BakeRecord(footprints, {}).steps
    steps = [replace(step, footprint=None) if step.index in muted else step for step in steps]
    return marks_of([loads], steps, terrain, surface=surface, **options)


def mass_of_steps(laid_marks):
    return np.bincount(laid_marks.step, laid_marks.mass * laid_marks.area)


def test_faces_that_share_vertices_are_there_at_once_and_weigh_the_same():
    whole = marks()
    cut = whole.in_turn()
    births = cut.birth[cut.faces]
    assert (np.ptp(births, axis=1) == 0).all()
    latest = whole.birth[whole.faces].max(axis=1)
    assert (births[:, 0] >= latest).all()
    for step in np.unique(whole.step):
        of_step = whole.step[whole.faces[:, 0]] == step
        assert births[of_step].min() < births[of_step].max() == latest[of_step].max()
    assert (cut.position[cut.faces] == whole.position[whole.faces]).all()
    assert (cut.step[cut.faces] == whole.step[whole.faces]).all()
    assert cut.mass @ cut.area == pytest.approx(whole.mass @ whole.area, rel=1e-12)
    assert len(cut.mass) < 1.5 * len(whole.mass)


@pytest.mark.parametrize("force", [5.0, 800.0, 3000.0])
def test_an_elastic_sole_bears_the_force_whatever_its_shape(force):
    chance = np.random.default_rng(1)
    gap, area = 0.02 * chance.random((20, 60)), 1e-4 * chance.random(60)
    gap[:, 50:] = np.inf
    pressure = bedded(gap + 3.0, area, np.full(20, force))
    assert pressure @ area == pytest.approx(np.full(20, force), rel=1e-9)
    assert not pressure[:, 50:].any()
    level = gap + pressure / BEDDING
    for row, pressed_row in zip(level, pressure > 0, strict=True):
        assert np.ptp(row[pressed_row]) < 1e-9
        assert (row[:50][~pressed_row[:50]] >= row[pressed_row].max() - 1e-12).all()
    assert not bedded(np.full((1, 4), np.inf), np.ones(4), np.array([force])).any()


def test_the_grid_of_a_sole_has_its_area_and_its_outline():
    sole = box_sole(0.3, 0.1)
    grid = sole_grid(sole, pose(np.zeros((1, 3))))
    assert grid.area.sum() == pytest.approx(0.03, rel=0.05)
    along, across, distance = grid.sole.T
    inside = (np.abs(across) < 0.05) & (np.abs(along - 0.15) < 0.15)
    assert ((distance < 0) == inside).all()
    assert len(grid.faces) < 300
    foot = foot_sole("foot", "L")
    assert sole_grid(foot, np.tile(pose(np.zeros(3)), (2, 1, 1))).area.sum() == pytest.approx(foot.area, rel=0.05)


def test_a_sole_over_an_edge_leaves_its_mark_on_the_floor_alone():
    sole = box_sole(0.3, 0.1)
    grid = sole_grid(sole, pose(np.zeros((1, 3))))
    hard = MeshTerrain.joined([slab((-1, 0.05), (-1, 1), 0.0), slab((0.05, 1), (-1, 1), -0.2)])
    terrain = HardOnSoft(FlatTerrain(-1.0), hard, Reach.of(np.array([[0.0, 0.0, 0.5]]), 1.0))
    floor_print = laid(grid, pose(np.zeros((3, 1, 3))), np.full(3, 700.0), terrain, 0.02)
    corners = floor_print.position[floor_print.faces]
    assert len(floor_print.faces)
    assert corners[..., 0].max() < 0.05 + 1e-9
    assert corners[..., 2] == pytest.approx(CLEARANCE)
    assert floor_print.pressure @ grid.area == pytest.approx(700.0, rel=0.1)


def test_a_walk_out_of_mud_leaves_marks_that_fade_and_every_gram_is_booked():
    laid_marks = marks(shed={0: 0.01 / 1700.0, 3: 0.02 / 1700.0})
    of_steps = mass_of_steps(laid_marks)
    assert len(of_steps) >= 4
    for foot in (of_steps[: len(of_steps) // 2], of_steps[len(of_steps) // 2 :]):
        assert (np.diff(foot[1:]) < 0).all()  # the first is half on the edge
    carried = laid_marks.carried
    assert of_steps.sum() == pytest.approx(carried.left_behind, abs=1e-9)
    assert carried.picked_up == pytest.approx(carried.left_behind + carried.shed + carried.on_soles, abs=1e-9)
    assert carried.shed == pytest.approx(0.03)
    assert 0.005 < of_steps[0] < 0.03


def test_marks_lie_on_the_floor_under_the_feet_that_press_them():
    loads, _, _ = crossing()
    laid_marks = marks()
    assert laid_marks.position[:, 2] == pytest.approx(FLOOR + CLEARANCE)
    for number in np.unique(laid_marks.step):
        of_step = laid_marks.step == number
        along, across, _ = laid_marks.sole[of_step].T
        place = laid_marks.position[of_step]
        assert np.polyfit(along, place[:, 0], 1)[0] == pytest.approx(1.0, abs=0.06)
        assert np.polyfit(across, place[:, 1], 1)[0] == pytest.approx(1.0, abs=0.03)
        heel, toes = along < 0.05, along > 0.22
        assert laid_marks.birth[of_step][heel].min() < laid_marks.birth[of_step][toes].min()
    assert laid_marks.birth.min() >= loads.motion.frames[0]


def test_a_sole_that_slides_on_leaves_a_mark_for_each_of_its_lengths():
    hard, slid = np.ones(40, bool), np.linspace(0.0, 3.5, 40)
    hard[:4] = False
    pieces = list(_pieces(hard, slid))
    assert [piece.start for piece in pieces[1:]] == [piece.stop for piece in pieces[:-1]]
    assert (pieces[0].start, pieces[-1].stop) == (4, 40)
    assert len(pieces) == 4
    assert [len(list(_pieces(hard, 0.0 * slid))), len(list(_pieces(~hard, slid)))] == [1, 1]


def rolled(turns=3.6, onto=1.0, radius=0.2, slide=False):
    """Marks of a wheel that rolls out of mud onto a floor, and the motion."""
    speed = 1.5
    loads = rolling(30.0, speed, (onto + turns * 2 * np.pi * radius) / speed, radius, slide=slide)
    # The floor is level with the mud that it lies on.
    floor = HardOnSoft(FlatTerrain(-0.05), slab((onto, 99), (-1, 1), 0.0), Reach.of(np.zeros((1, 3)) + 0.5, 99.0))
    hard = loads.motion.soles[0].transforms[:, 0, 0, 3] > onto
    contacts = replace(loads.contacts, touching=loads.contacts.touching & ~hard[:, None], hard=hard[:, None])
    loads = replace(loads, contacts=contacts)
    name, sole = loads.motion.name, loads.motion.soles[0].sole.name
    found = marks_of([loads], [], floor, surface="mud", brought={name: ("mud", 1.0)})
    assert sole == found.floors.soles[0].of[1]
    return found, loads


def test_a_wheel_leaves_a_strip_that_fades_by_the_closed_form_with_each_turn():
    found, _ = rolled()
    place, of_turn = found.position[:, 0], mass_of_steps(found)
    for number in range(3):
        of_step = place[found.step == number]
        assert np.ptp(of_step) == pytest.approx(2 * np.pi * 0.2, abs=0.03)
        assert number == 0 or abs(of_step.min() - place[found.step == number - 1].max()) < 0.03
    assert np.diff(np.log(of_turn[:3])) == pytest.approx(np.log(of_turn[1] / of_turn[0]), abs=0.01)
    assert of_turn[3] < of_turn[2]
    across = found.position[found.mass > 0, 1]
    assert np.ptp(across) == pytest.approx(0.06, abs=0.02)
    carried = found.carried
    assert of_turn.sum() == pytest.approx(carried.left_behind, abs=1e-9)
    assert carried.brought == pytest.approx(carried.left_behind + carried.on_soles, abs=1e-9)
    assert np.polyfit(place[found.step == 1], found.birth[found.step == 1], 1)[0] == pytest.approx(30 / 1.5, rel=0.05)


def test_a_body_that_slides_on_smears_and_one_that_rests_leaves_its_underside():
    smeared, _ = rolled(slide=True)
    assert len(np.unique(smeared.step)) > 5
    loads = rolled()[1]
    still = replace(loads.motion, soles=(loads.motion.soles[0].of(np.full(60, len(loads.motion.frames) - 1)),))
    print_ = swept(
        still.soles[0].sole.prop,
        still.soles[0].transforms[:, 0],
        np.full(60, 400.0),
        HardOnSoft(FlatTerrain(-1.0), slab((-9, 99), (-1, 1), 0.0), Reach.of(np.zeros((1, 3)), 99.0)),
        0.05,
    )[1]
    pressed_x = print_.position[print_.pressure > 0, 0]
    pushed = 400.0 / (BEDDING * 0.06)  # Winkler's foundation under a cylinder: F = (4/3) k b sqrt(2 R) d^1.5
    half = np.sqrt(2 * 0.2 * (0.75 * pushed / np.sqrt(2 * 0.2)) ** (2 / 3))
    assert np.ptp(pressed_x) == pytest.approx(2 * half, abs=0.03)


def test_without_what_sticks_or_without_a_floor_there_are_no_marks():
    loads, footprints, terrain = crossing()
    assert marks("sand") is None
    assert marks_of([loads], BakeRecord(footprints, {}).steps, terrain.ground, surface="mud") is None


def test_dirty_soles_leave_marks_though_they_step_into_nothing():
    loads, footprints, _ = crossing()
    muted = range(len(footprints))
    clean, dirty = marks(muted=muted), marks(muted=muted, brought={loads.motion.name: ("mud", 0.8)})
    assert not clean.mass.any()
    assert dirty.carried.brought > 0 == dirty.carried.picked_up
    assert mass_of_steps(dirty).sum() == pytest.approx(dirty.carried.brought - dirty.carried.on_soles, abs=1e-9)


@pytest.mark.parametrize("kind", ["mud", "snow", "paint"])
def test_soles_bring_any_kind_onto_a_floor_beside_ground_that_does_not_stick(kind):
    loads, _, _ = crossing()
    found = marks("sand", brought={loads.motion.name: (kind, 1.0)})
    assert found.floors.kind == kind
    assert found.carried.brought > 0 == found.carried.picked_up
    assert mass_of_steps(found).sum() == pytest.approx(found.carried.brought - found.carried.on_soles, abs=1e-9)
    assert marks("sand", brought={loads.motion.name: (kind, 0.0)}) is None


def test_a_muted_step_takes_nothing_up_and_all_muted_leave_a_clean_floor():
    count = len(crossing()[1])
    whole, fewer, none = marks(), marks(muted=(0, 1)), marks(muted=range(count))
    assert fewer.carried.picked_up < whole.carried.picked_up
    assert fewer.carried.left_behind < whole.carried.left_behind
    assert not none.mass.any()
    assert none.carried.picked_up == 0.0


@pytest.mark.parametrize("liquid", LIQUIDS)
def test_soles_that_step_into_a_puddle_carry_it_on_and_leave_no_mark_in_it(liquid):
    puddle = slab((3.0, 4.2), (-1, 1), FLOOR)
    laid_marks = marks("sand", wet={liquid: puddle})
    film, of_steps = LIQUIDS[liquid].carried, mass_of_steps(laid_marks)
    assert laid_marks.floors.kind == liquid
    assert len(of_steps) >= 3
    assert (np.diff(of_steps) < 0).all()
    inside = (laid_marks.position[:, 0] > 3.0) & (laid_marks.position[:, 0] < 4.2)
    assert np.bincount(laid_marks.step, inside, len(of_steps)).max() < 0.5 * np.bincount(laid_marks.step).max()
    carried = laid_marks.carried
    assert of_steps.sum() == pytest.approx(carried.left_behind, abs=1e-9)
    assert carried.picked_up == pytest.approx(carried.left_behind + carried.on_soles, abs=1e-9)
    assert laid_marks.mass.max() <= film.most * film.deposited
    assert marks("sand") is None


def test_of_mud_and_a_puddle_what_is_most_is_left():
    puddle = {"water": slab((3.0, 4.2), (-1, 1), FLOOR)}
    assert marks("mud", wet=puddle).floors.kind == "mud"
    assert mass_of_steps(marks("mud", wet=puddle)) == pytest.approx(mass_of_steps(marks("mud")))


def test_edited_steps_change_what_marks_weigh_as_if_they_were_laid_anew():
    _, footprints, _ = crossing()
    steps = BakeRecord(footprints, {}).steps
    whole = marks()
    for muted in ((0,), (0, 1, 2), range(len(steps)), ()):
        edited = [replace(step, footprint=None) if step.index in muted else step for step in steps]
        updated, anew = whole.with_steps(edited, {1: 1e-5}), marks(muted=muted, shed={1: 1e-5})
        assert updated.mass == pytest.approx(anew.mass, abs=1e-12)
        carried = updated.carried
        assert carried == anew.carried
        assert carried.picked_up == pytest.approx(carried.left_behind + carried.shed + carried.on_soles, abs=1e-9)
        assert mass_of_steps(updated).sum() == pytest.approx(carried.left_behind, abs=1e-9)


def test_a_step_that_is_shifted_before_earlier_contacts_with_the_floor_leaves_marks_there():
    loads, footprints, terrain = crossing()
    late = [replace(step, end_frame=step.end_frame + 500, start_frame=step.start_frame + 500) for step in footprints]
    steps = BakeRecord(late, {}).steps
    found = marks_of([loads], steps, terrain, surface="mud")
    assert not found.mass.any()
    early = [replace(step, footprint=before) for step, before in zip(steps, footprints, strict=True)]
    moved, usual = found.with_steps(early, {}), marks()
    assert moved.carried == usual.carried
    assert np.sort(moved.mass[moved.mass > 0]) == pytest.approx(np.sort(usual.mass[usual.mass > 0]))


def test_events_on_a_floor_know_what_soles_bring_less_with_each_step_and_none_if_steps_are_muted():
    loads, footprints, _ = crossing()
    table = events([loads], footprints, surface="mud", first_frame=1.0)
    steps, found = BakeRecord(footprints, {}).steps, marks()
    rows = found.floors.with_films(table, steps)
    hard = [row for row in rows if row["surface"] == "hard" and row["phase"] == "heel_strike"]
    assert len(hard) > 3
    assert {row["carried"] for row in hard} == {"mud"}
    for contact in {row["contact"] for row in hard}:
        film = [row["film"] for row in hard if row["contact"] == contact]
        assert np.diff(film).max() < 0
    assert not [row for row in rows if row["surface"] != "hard" and row["carried"]]
    muted = [replace(step, footprint=None) for step in steps]
    assert not any(row["film"] for row in found.floors.with_films(table, muted))


def test_more_may_stick_and_it_may_go_farther():
    usual, more, farther = (mass_of_steps(marks(carried=scaled)) for scaled in ((1.0, 1.0), (2.0, 1.0), (1.0, 3.0)))
    assert more == pytest.approx(2 * usual)
    one_foot = slice(1, 3)  # of equal steps each leaves the same share
    assert np.divide(*farther[one_foot]) < np.divide(*usual[one_foot])
    assert np.count_nonzero(farther) >= np.count_nonzero(usual)
    found = marks(carried=(2.0, 3.0))
    carried = found.carried
    assert carried.picked_up == pytest.approx(carried.left_behind + carried.on_soles, abs=1e-9)
    assert found.with_steps(BakeRecord(crossing()[1], {}).steps, {}).mass == pytest.approx(found.mass)


@pytest.mark.parametrize("ground", ["sand", "snow"])
def test_marks_of_a_region_come_back_when_its_steps_are_muted_no_more(ground):
    loads, footprints, terrain = crossing()
    steps = BakeRecord([replace(step, surface="mud") for step in footprints], {}).steps
    muted = [replace(step, footprint=None) for step in steps]
    laid_marks = marks_of([loads], muted, terrain, surface=ground)
    assert not laid_marks.mass.any()
    assert laid_marks.with_steps(steps, {}).mass == pytest.approx(marks().mass)


DRYING = 0.3
"""[mm/h]"""


@pytest.mark.parametrize("kind", ["snow", "mud", "water"])
@pytest.mark.parametrize("temperature", [-5.0, 0.0, 8.0])
def test_marks_age_without_a_warning_where_nothing_lies_or_melts(kind, temperature):
    mass, age = np.array([0.0, 1e-12, 0.2, 0.2]), np.array([0.0, 1e4, 0.0, 1e8])
    with np.errstate(all="raise", under="ignore"):
        now = aged(mass, age, surfaces.sticking(kind), DRYING, 0.0, temperature)
    frozen = kind == "snow" and temperature <= 0
    assert now.wetness.tolist() == [1.0, float(frozen), 1.0, float(frozen)]
    assert np.broadcast_to(now.melted, 4)[3] == (kind == "snow" and temperature > 0)


@pytest.mark.parametrize("kind", ["snow", "mud", "water"])
def test_marks_dry_by_the_law_of_weather_and_snow_once_it_has_melted(kind):
    surface, mass, age = surfaces.sticking(kind), 0.2, np.array([0.1, 0.5, 1.0, 1.5, 3.0]) * 3600.0
    water, melting = mass * surface.carried.water / 1000.0, weather.melting_rate(8.0)
    until = water / melting if kind == "snow" else 0.0
    now = aged(np.full(5, mass), age, surface, DRYING, 0.0, 8.0)
    lost = np.maximum(age - until, 0.0) * DRYING * 1e-3 / 3600.0
    assert now.wetness == pytest.approx(weather.wetness(lost * weather.SURFACE_FILM / water), abs=1e-12)
    if kind == "snow":
        assert now.melted == pytest.approx(np.minimum(age / until, 1.0), rel=1e-12)
