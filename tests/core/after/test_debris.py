"""What steps throw: how much, how far, with what energy, and that the ground lacks it afterwards."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.after import debris, flight, phases
from softground_addon.core.after.events import events
from softground_addon.core.after.thrown_matter import MATTER
from softground_addon.core.ground.presets import find
from softground_addon.core.record.footprints import recompose
from tests.core.walkers import GRAVITY, MASS, foot_sole, loads_of, pose, pressed

SAND = find("dry_sand").material


def jump(speed, seconds=1.2):
    """Both feet come down at a speed [m/s], press with twice the weight, and stand."""
    time = np.arange(round(seconds * 120) + 1) / 120
    height = np.maximum(0.5 - time, 0.0) * speed
    path = np.stack([0 * time, 0 * time, height], -1)
    soles = [foot_sole("foot.L", "L"), foot_sole("foot.R", "R")]
    poses = [np.repeat(pose(path + np.array([0, y, 0]))[:, None], 2, axis=1) for y in (0.15, -0.15)]
    touching = (time >= 0.5)[:, None].repeat(2, 1)
    return loads_of(soles, poses, np.where(touching, MASS * GRAVITY, 0.0), touching, 120.0)


def flat(x, y):
    return np.zeros_like(x)


@pytest.fixture(scope="module")
def record():
    return pressed(jump(2.0), SAND, cell_size=0.02)[1]


def thrown(speed, record, height=flat, surface="sand"):
    return debris.throw([jump(speed)], record, surface=surface, height=height)


@pytest.mark.parametrize("speed", [0.4, 1.5, 4.0])
def test_a_landing_throws_what_the_formula_says_by_hand(record, speed):
    loads = jump(speed)
    heard = thrown(speed, record)
    for number, one in enumerate(record):
        radius = np.sqrt(one.area_m2 / 2 / np.pi)
        share = np.clip(0.05 * (speed**2 / (GRAVITY * radius) - 1), 0, 0.3)
        total = np.concatenate([[0], np.cumsum(np.asarray(one.compression.amounts, float))])
        volumes = np.diff(total[np.asarray(one.compression.first)])
        start = next(p for p in phases.phases(loads) if p.kind == "land").at / 1.0 + 1.0
        early = volumes[np.asarray(one.compression.frames) <= start + 12 + 1e-6].sum() / volumes.sum()
        assert heard.volume[number] == pytest.approx(share * early * one.rim_m3, rel=1e-6, abs=1e-15)
    spheres = np.bincount(heard.step, 4 / 3 * np.pi * heard.radius**3, len(record))
    assert spheres == pytest.approx(heard.volume, rel=1e-9, abs=1e-15)
    assert (len(heard.birth) == 0) == (speed < 0.5)


def test_flights_are_the_closed_form(record):
    """Against steps of a millisecond of m·dv/dt = -m·g - (m·g/v_s)·v."""
    random = np.random.default_rng(1)
    start, velocity = random.random((20, 3)), 3 * random.standard_normal((20, 3))
    drag = 0.05 + random.random(20)
    place, speed = start.copy(), velocity.copy()
    for _ in range(4000):
        half = speed + (np.array([0, 0, -GRAVITY]) - speed / drag[:, None]) * 0.5e-4
        place += half * 1e-4
        speed += (np.array([0, 0, -GRAVITY]) - half / drag[:, None]) * 1e-4
    assert flight.position(start, velocity, drag, np.full(20, 0.4), GRAVITY) == pytest.approx(place, abs=1e-5)


def test_without_drag_reach_and_height_are_those_of_ballistics():
    angle, speed = np.radians(45.0), 2.0
    velocity = np.array([[speed * np.cos(angle), 0, speed * np.sin(angle)]])
    start, drag = np.zeros((1, 3)), np.array([1e4])
    time = flight.landing_times(start, velocity, drag, GRAVITY, flat)
    place = flight.position(start, velocity, drag, time, GRAVITY)
    assert place[0, 0] == pytest.approx(speed**2 / GRAVITY, rel=1e-3)
    top = flight.position(start, velocity, drag, time / 2, GRAVITY)
    assert top[0, 2] == pytest.approx((speed * np.sin(angle)) ** 2 / (2 * GRAVITY), rel=1e-3)


def test_what_has_come_down_lies_on_the_ground(record):
    ground = recompose(record)

    def height(x, y):
        compression, rim = ground.sample(x, y)
        return rim - compression

    heard = thrown(4.0, record, height)
    places = flight.position(heard.start, heard.velocity, heard.drag_time, heard.time, GRAVITY)
    assert len(places) > 100
    assert places[:, 2] == pytest.approx(height(places[:, 0], places[:, 1]), abs=1e-4)
    assert (np.diff(heard.birth) >= 0).all()


@pytest.mark.parametrize("speed", [1.5, 2.0, 4.0])
def test_a_cloud_has_less_than_a_hundredth_of_the_landings_energy(record, speed):
    heard = thrown(speed, record)
    mass = 4 / 3 * np.pi * heard.radius**3 * MATTER["sand"].density
    cloud = (mass * (heard.velocity**2).sum(axis=1)).sum() / 2
    assert 0 < cloud < 0.01 * MASS * speed**2 / 2


def test_the_rim_lacks_what_was_thrown(record):
    heard = thrown(4.0, record)
    for one, volume in zip(record, heard.volume, strict=True):
        assert volume > 0
        left = debris.booked(one, volume)
        change = left.tile(left.rim).sum() * left.cell_size**2
        before = one.tile(one.rim).sum() * one.cell_size**2
        assert change + volume == pytest.approx(before, rel=1e-6)
        assert left.rim_m3 + volume == pytest.approx(one.rim_m3, rel=1e-12)
        assert left.compression is one.compression


def test_events_tell_the_mass_that_each_phase_throws(record):
    heard = thrown(4.0, record)
    rows = events([jump(4.0)], record, surface="sand", first_frame=1.0, thrown=heard.masses)
    total = sum(row["thrown_kg"] for row in rows)
    assert total == pytest.approx(heard.volume.sum() * MATTER["sand"].density, abs=2e-6)
    assert all(row["thrown_kg"] == 0 for row in rows if row["phase"] not in ("land", "toe_off"))


def test_changed_steps_throw_nothing_and_the_same_bake_throws_the_same(record):
    once, again = thrown(4.0, record), thrown(4.0, record)
    assert all(np.array_equal(getattr(once, name), getattr(again, name)) for name in ("start", "velocity", "radius"))
    part = debris.throw([jump(4.0)], record, surface="sand", height=flat, without={0})
    assert part.volume[0] == 0
    assert set(part.step) == {1}


def test_a_sole_that_leaves_sheds_its_film_as_it_swings():
    loads = jump(0.4)
    lifted = replace(loads, contacts=replace(loads.contacts, touching=loads.contacts.touching.copy()))
    lifted.contacts.touching[100:] = False
    lifted.forces.forces[100:] = 0.0
    _, record = pressed(lifted, SAND, cell_size=0.02)
    heard = debris.throw([lifted], record, surface="wet_sand", height=flat)
    assert set(heard.kind) == {2}
    film = MATTER["wet_sand"].film * sum(one.area_m2 for one in record)
    assert heard.volume.sum() <= film
    assert heard.birth.min() >= lifted.motion.frames[99]
    shed = np.sort(heard.birth - heard.birth.min()) / 120
    assert np.median(shed) == pytest.approx(0.1, abs=0.06)


def test_flights_come_down_on_uneven_ground():
    """On terraces with steep steps: above the ground until the landing, on it then, by the closed form."""
    random = np.random.default_rng(3)
    count = 2000
    start = np.column_stack([random.uniform(-1, 1, (count, 2)), np.full(count, 0.2)])
    velocity, drag = random.normal(0, 2, (count, 3)), random.uniform(0.02, 1.0, count)

    def terraces(x, y):
        return 0.1 * np.tanh(40 * np.sin(8 * x)) + 0.05 * y

    time = flight.landing_times(start, velocity, drag, GRAVITY, terraces)
    place = flight.position(start, velocity, drag, time, GRAVITY)
    assert place[:, 2] == pytest.approx(terraces(place[:, 0], place[:, 1]), abs=1e-4)
    before = flight.position(start, velocity, drag, time - 1e-4, GRAVITY)
    assert (before[:, 2] > terraces(before[:, 0], before[:, 1]) - 1e-4).all()


def test_what_nothing_catches_is_in_the_air_to_the_end():
    velocity, drag = np.array([[1.0, 0, 2.0], [0, 0, -30.0]]), np.array([1e4, 0.05])
    time = flight.landing_times(np.zeros((2, 3)), velocity, drag, GRAVITY, lambda x, y: np.full_like(x, np.nan))
    assert time == pytest.approx(flight.LONGEST_FLIGHT)
