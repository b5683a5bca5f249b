"""What steps throw: how much, how far, with what energy, and that the ground lacks it afterwards."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.debris import debris, flight, step_throws
from softground_addon.core.events import phases
from softground_addon.core.events.events import as_edited, events
from softground_addon.core.ground.presets import find
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.record import throws
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.record.footprints import recompose
from softground_addon.core.record.record import BakeRecord, dump, load
from softground_addon.core.record.throws import ThrowKind
from tests.core.prop_bodies import prop_sole, sphere
from tests.core.walkers import GRAVITY, MASS, foot_sole, loads_of, pose, pressed, walk

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


class Heard:
    """What a bake throws: its pieces, its record, and the volume of each footprint [m³]."""

    def __init__(self, loads, record, height=flat, surface="sand"):
        if not record.throws:
            record = replace(record, throws=step_throws.throws_of(loads, record.footprints, surface=surface))
        pieces = debris.sources(record.throws, record.steps, surface=surface, gravity=GRAVITY)
        self.pieces = debris.throw(pieces, surface=surface, gravity=GRAVITY, height=height)
        self.record = replace(record, thrown=debris.volumes(pieces))
        self.volume = np.array([sum(self.record.thrown.get(n, {}).values()) for n in range(len(record.footprints))])

    def __getattr__(self, name):
        return getattr(self.pieces, name)


def thrown(speed, record, height=flat, surface="sand"):
    return Heard([jump(speed)], BakeRecord(record, {}), height, surface)


@pytest.mark.parametrize("speed", [0.4, 1.5, 4.0])
def test_a_landing_throws_what_the_formula_says_by_hand(record, speed):
    loads = jump(speed)
    heard = thrown(speed, record)
    for number, throw in enumerate(record):
        radius = np.sqrt(throw.area_m2 / 2 / np.pi)
        share = np.clip(0.05 * (speed**2 / (GRAVITY * radius) - 1), 0, 0.3)
        total = np.concatenate([[0], np.cumsum(np.asarray(throw.compression.amounts, float))])
        volumes = np.diff(total[np.asarray(throw.compression.first)])
        start = next(p for p in phases.phases(loads) if p.kind == "land").at / 1.0 + 1.0
        early = volumes[np.asarray(throw.compression.frames) <= start + 12 + 1e-6].sum() / volumes.sum()
        assert heard.volume[number] == pytest.approx(share * early * throw.compressed_m3, rel=1e-6, abs=1e-15)
    spheres = np.bincount(heard.step, 4 / 3 * np.pi * heard.radius**3, len(record))
    assert spheres == pytest.approx(heard.volume, rel=1e-9, abs=1e-15)
    assert (len(heard.birth) == 0) == (speed < 0.5)


@pytest.mark.parametrize(("speed", "litres"), [(0.4, (0.0, 0.0)), (1.2, (0.1, 0.6)), (4.0, (0.6, 2.0))])
def test_in_powder_what_the_ground_swallows_cannot_fly_and_all_that_it_leaves_can(speed, litres):
    """A walk throws nothing, a run a plume at each foot, a jump all that its rims would hold; the sums are exact."""
    loads, powder = jump(speed), find("fresh_snow").material
    _, record = pressed(loads, powder, cell_size=0.02)
    heard = Heard([loads], BakeRecord(record, {}), surface="snow")
    for step, thrown_volume in zip(heard.record.steps, heard.volume, strict=True):
        rim = 2 * powder.poisson_ratio * step.baked.compressed_m3
        assert step.footprint.rim_m3 + thrown_volume == pytest.approx(rim, rel=1e-6)
        on_ground = step.footprint.tile(step.footprint.rim).sum() * step.footprint.cell_size**2
        assert on_ground + thrown_volume == pytest.approx(rim, rel=1e-6)
        assert (step.footprint.rim_m3 < 1e-9) == (speed == 4.0)
    low, high = litres
    assert low <= 1e3 * heard.volume.max() <= high


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


@pytest.mark.parametrize("speed", [1.5, 4.0])
def test_a_cloud_rises_and_reaches_on_average_as_the_closed_forms_of_ballistics_integrate_to(record, speed):
    """Without drag: from the ring's area between .5 and 1.2 radii, at .7·sqrt(g·R)·(r/R)^(-1/.55), 35 to 55° up."""
    heard = thrown(speed, record)
    throw = record[0]
    ring = (heard.kind == ThrowKind.LANDING) & (heard.step == 0)
    radius = np.sqrt(throw.area_m2 / 2 / np.pi)
    distance, angle = np.meshgrid(
        np.sqrt(np.linspace(0.5**2, 1.2**2, 2001)), np.radians(debris.CORONA + debris.SPREAD * np.linspace(-1, 1, 201))
    )
    starts = np.minimum(0.7 * np.sqrt(GRAVITY * radius) * distance ** (-1 / 0.55), speed)
    heights, reaches = (starts * np.sin(angle)) ** 2 / (2 * GRAVITY), starts**2 * np.sin(2 * angle) / GRAVITY
    start, velocity = heard.start[ring] * (1, 1, 0), heard.velocity[ring]
    drag = np.full(len(start), 1e4)
    time = flight.landing_times(start, velocity, drag, GRAVITY, flat)
    came_down = flight.position(start, velocity, drag, time, GRAVITY)
    top = flight.position(start, velocity, drag, time / 2, GRAVITY)
    assert len(start) > 1000
    assert top[:, 2].mean() == pytest.approx(heights.mean(), rel=0.03)
    assert np.linalg.norm((came_down - start)[:, :2], axis=1).mean() == pytest.approx(reaches.mean(), rel=0.03)


@pytest.mark.parametrize("ground", ["dry_sand", "snow", "fresh_snow", "mud", "soil"])
@pytest.mark.parametrize("speed", [1.5, 2.0, 4.0])
def test_a_cloud_has_less_than_a_hundredth_of_the_landings_energy(ground, speed):
    preset = find(ground)
    heard = thrown(speed, pressed(jump(speed), preset.material, cell_size=0.02)[1], surface=preset.surface)
    mass = 4 / 3 * np.pi * heard.radius**3 * SURFACES[preset.surface].density
    cloud = (mass * (heard.velocity**2).sum(axis=1)).sum() / 2
    assert 0 < cloud < 0.01 * MASS * speed**2 / 2


@pytest.mark.parametrize("surface", ["sand", "snow"])
def test_plumes_are_fine_and_their_mist_comes_down_last(record, surface):
    """Dry sand has no clumps: half of its pieces are finer than 1 mm, drawn as they are; powder hangs in the air."""
    heard = thrown(4.0, record, surface=surface)
    diameter = 2e3 * heard.radius
    assert np.median(diameter) < (1.0 if surface == "sand" else 1.5)
    assert diameter.max() < (6.0 if surface == "sand" else 30.0)
    fine = diameter <= np.percentile(diameter, 20)
    assert 4 / 3 * np.pi * (heard.radius[fine] ** 3).sum() < 0.01 * heard.volume.sum()
    assert np.median(heard.drag_time[fine]) < np.median(heard.drag_time[~fine])


def test_all_steps_of_a_long_run_share_the_pieces_that_a_bake_has(record):
    bare = replace(thrown(4.0, record).record, thrown={})
    pieces = debris.sources(bare.throws, bare.steps, surface="sand", gravity=GRAVITY) * 60
    heard = debris.throw(pieces, surface="sand", gravity=GRAVITY, height=flat)
    assert 0.5 * debris.ALL_PIECES < len(heard.birth) <= debris.ALL_PIECES
    assert 4 / 3 * np.pi * (heard.radius**3).sum() == pytest.approx(sum(each.volume for each in pieces), rel=1e-9)


def test_a_slice_asks_for_the_ground_under_few_of_many_pieces(record):
    bare = replace(thrown(4.0, record).record, thrown={})
    pieces, asked = debris.sources(bare.throws, bare.steps, surface="sand", gravity=GRAVITY) * 60, [0]

    def counted(x, y):
        asked[-1] += len(x)
        return flat(x, y)

    for _ in debris.throw.slices(pieces, surface="sand", gravity=GRAVITY, height=counted):
        asked.append(0)
    assert sum(asked) > debris.ALL_PIECES
    assert max(asked) <= 2 * debris.TOGETHER


def test_the_rim_lacks_what_was_thrown(record):
    heard = thrown(4.0, record)
    for throw, volume in zip(record, heard.volume, strict=True):
        assert volume > 0
        booked = throws.booked(throw, volume)
        change = booked.tile(booked.rim).sum() * booked.cell_size**2
        before = throw.tile(throw.rim).sum() * throw.cell_size**2
        assert change + volume == pytest.approx(before, rel=1e-6)
        assert booked.rim_m3 + volume == pytest.approx(throw.rim_m3, rel=1e-12)
        assert booked.compression is throw.compression


def test_events_tell_the_mass_that_each_phase_throws(record):
    heard = thrown(4.0, record)
    table = events([jump(4.0)], record, surface="sand", first_frame=1.0)
    assert not any(row["thrown_kg"] for row in table)
    rows = as_edited(table, heard.record.steps)
    total = sum(row["thrown_kg"] for row in rows)
    assert total == pytest.approx(heard.volume.sum() * SURFACES["sand"].density, abs=2e-6)
    assert all(row["thrown_kg"] == 0 for row in rows if row["phase"] not in ("land", "toe_off"))


def test_the_same_bake_throws_the_same(record):
    once, again = thrown(4.0, record), thrown(4.0, record)
    assert all(np.array_equal(getattr(once, name), getattr(again, name)) for name in ("start", "velocity", "radius"))


def test_edited_steps_throw_where_when_and_as_much_as_they_press(record):
    """A muted step throws nothing; what a moved and turned one throws moves and turns with it."""
    count, throw = len(record), record[0]
    turned = replace(throw, position=throw.position + np.array([0.5, -0.2, 0.1]), heading=throw.heading + np.pi / 2)
    later = replace(record[1], start_frame=record[1].start_frame + 6, end_frame=record[1].end_frame + 6)
    edits = {
        step_id(throw): StepEdit(move_m=(0.5, -0.2), turn_deg=90.0),
        step_id(record[1]): StepEdit(mute=True),
        step_id(record[1], 1): StepEdit(shift_frames=6),
    }
    plain = thrown(4.0, record)
    edited = replace(plain.record, edits=edits, pressed_again={0: turned, 1: None, 1 + count: later}, thrown={})
    heard = Heard([], edited)
    assert set(heard.step) == {0, 1 + count}
    before, after = plain.step == 0, heard.step == 0
    offset, way = (plain.start - throw.position)[before], plain.velocity[before]
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    # each ring is drawn anew around its middle: its pieces are as far from it, and as fast
    assert heard.radius[after] == pytest.approx(plain.radius[before], rel=1e-6)
    middle = (heard.start[after] - turned.position)[:, :2].mean(axis=0)
    assert middle == pytest.approx((offset @ quarter.T)[:, :2].mean(axis=0), abs=0.02)
    assert np.linalg.norm(heard.velocity[after], axis=1) == pytest.approx(np.linalg.norm(way, axis=1), rel=1e-4)
    assert heard.birth[heard.step == 1 + count].min() >= plain.birth[plain.step == 1].min() + 5
    assert heard.volume[0] == pytest.approx(plain.volume[0], rel=1e-6)
    assert heard.volume[1] == 0
    for step, volume in ((heard.record.steps[0], heard.volume[0]), (heard.record.steps[2], plain.volume[1])):
        assert step.footprint.rim_m3 + sum(step.thrown.values()) == pytest.approx(step.baked.rim_m3, rel=1e-12)
        assert sum(step.thrown.values()) == pytest.approx(volume, rel=1e-6)


def test_what_is_thrown_comes_back_with_the_record_and_forged_rows_are_refused(record):
    booked = thrown(4.0, record).record
    content = dump(booked)
    again = load(content)
    assert dump(again) == content
    assert again.thrown == booked.thrown
    assert [throws.to_json(throw) for throw in again.throws] == [throws.to_json(throw) for throw in booked.throws]
    for throw, other in zip(booked.throws, again.throws, strict=True):
        assert np.array_equal(throw.samples, other.samples)
    row = throws.to_json(booked.throws[0])
    samples = {"shape": [1, 10], "samples": throws.to_json(replace(booked.throws[0], samples=np.full((1, 10), np.nan)))}
    for forged in (
        {"number": len(record)},
        {"number": True},
        {"kind": 3},
        {"first": float("nan")},
        {"shape": [10**9, 10]},
        {"shape": [2, 10]},
        {"samples": "%"},
        {"samples": samples["samples"]["samples"]},
    ):
        with pytest.raises((ValueError, TypeError)):
            throws.from_json(row | forged, len(record))


def test_a_step_that_is_twice_as_large_throws_from_twice_as_far(record):
    (way,) = [
        throw for throw in thrown(4.0, record).record.throws if throw.number == 0 and throw.kind == ThrowKind.LANDING
    ]
    larger = way.placed(record[0], record[0], StepEdit(scale=2.0))
    points, velocities = way.followed()
    assert larger.followed()[0] - record[0].position == pytest.approx(2 * (points - record[0].position), abs=1e-6)
    assert larger.followed()[1] == pytest.approx(2 * velocities, abs=1e-6)
    assert larger.speed == 2 * way.speed


def test_a_sole_that_slides_under_load_throws_what_it_drags_off_ahead_of_itself():
    """At 2 m/s for half a second: width, 2 mm and the way by hand; 0.7 of its speed, 30 to 50° up."""
    time = np.arange(241) / 120
    x = np.interp(time, [0.5, 1.0], [0.0, 1.0])
    soles = [foot_sole("foot.L", "L"), foot_sole("foot.R", "R")]
    poses = [np.repeat(pose(np.stack([x, 0 * x + y, 0 * x], -1))[:, None], 2, axis=1) for y in (0.1, -0.1)]
    touching = np.ones((len(time), 2), bool)
    loads = loads_of(soles, poses, np.full((len(time), 2), MASS * GRAVITY / 2), touching, 120.0)
    _, record = pressed(loads, SAND, cell_size=0.02)
    heard = Heard([loads], BakeRecord(record, {}))
    assert set(heard.kind) == {1}
    by_hand = sum(np.sqrt(throw.area_m2) / 2 * 2e-3 * 1.0 for throw in record)
    assert heard.volume.sum() == pytest.approx(by_hand, rel=0.03)
    speed = np.linalg.norm(heard.velocity, axis=1)
    assert speed.mean() == pytest.approx(0.7 * 2.0 * 0.95, rel=0.03)  # between 0.7 and 1.2 of it at random
    flies = speed > 0.1  # all but what is left as the sole stops
    rise = np.degrees(np.arcsin(heard.velocity[flies, 2] / speed[flies]))
    assert 29.9 < rise.min() < 31
    assert 49 < rise.max() < 50.1
    assert heard.velocity[:, 0].mean() > 3 * abs(heard.velocity[:, 1].mean())
    at = np.interp(heard.birth, loads.motion.frames, time)
    assert 0.48 < at.min() < at.max() < 1.03
    rows = as_edited(events([loads], record, surface="sand", first_frame=1.0), heard.record.steps)
    assert {row["phase"] for row in rows if row["thrown_kg"]} == {"slide_start"}


def test_a_sole_that_leaves_sheds_its_film_as_it_swings():
    loads = jump(0.4)
    lifted = replace(loads, contacts=replace(loads.contacts, touching=loads.contacts.touching.copy()))
    lifted.contacts.touching[100:] = False
    lifted.forces.forces[100:] = 0.0
    _, record = pressed(lifted, SAND, cell_size=0.02)
    heard = Heard([lifted], BakeRecord(record, {}), surface="wet_sand")
    assert set(heard.kind) == {2}
    film = SURFACES["wet_sand"].thrown.film * sum(throw.area_m2 for throw in record)
    assert heard.volume.sum() <= film
    assert heard.birth.min() >= lifted.motion.frames[99]
    shed = np.sort(heard.birth - heard.birth.min()) / 120
    assert np.median(shed) == pytest.approx(0.1, abs=0.06)
    for side in (0.15, -0.15):  # where the feet are; their landmarks lie along their middle
        across = heard.start[np.sign(heard.start[:, 1]) == np.sign(side), 1] - side
        assert 0.02 < np.abs(across).max() < 0.06


def test_boots_leave_mud_with_a_few_drops_of_many_sizes_in_lumps():
    """5 to 15 g of each, most of it in the larger half of the sizes, none in a single piece; lumps lie apart."""
    loads = walk(steps=6)
    _, record = pressed(loads, SAND, cell_size=0.02)
    heard = Heard([loads], BakeRecord(record, {}), surface="mud")
    places = flight.position(heard.start, heard.velocity, heard.drag_time, heard.time, GRAVITY)
    for number in np.unique(heard.step[heard.kind == ThrowKind.SHED]):
        of_step = (heard.step == number) & (heard.kind == ThrowKind.SHED)
        grams = 4 / 3 * np.pi * heard.radius[of_step] ** 3 * SURFACES["mud"].density * 1e3
        assert 5 < grams.sum() < 15
        assert grams.max() < 0.5 * grams.sum()
        assert 20 < of_step.sum() < 200
        assert len(np.unique(np.round(heard.birth[of_step] * 4))) <= 2 * SURFACES["mud"].thrown.lumps
        assert np.ptp(places[of_step, 1]) > 0.1  # a foot is as wide
    diameter = 2e3 * heard.radius[heard.kind == ThrowKind.SHED]
    assert np.percentile(diameter, 99) > 4 * np.percentile(diameter, 10)


def test_a_ball_that_bounces_sheds_from_the_lower_half_of_its_surface():
    radius, time = 0.1, np.arange(121) / 120
    path = np.stack([0 * time, 0 * time, radius + np.maximum(time - 0.5, 0.0) * 2.0], -1)
    touching = (time <= 0.5)[:, None]
    ball = prop_sole(*sphere(radius, rings=16))
    loads = loads_of([ball], [pose(path)[:, None]], np.where(touching, 300.0, 0.0), touching, 120.0)
    loads.contacts.touching[:60] = False  # it has come, before it leaves
    _, record = pressed(loads, SAND, cell_size=0.02)
    heard = Heard([loads], BakeRecord(record, {}), surface="wet_sand")
    shed = heard.kind == ThrowKind.SHED
    assert shed.sum() > 20
    middle = np.stack([np.interp(heard.birth[shed], loads.motion.frames, path[:, axis]) for axis in range(3)], -1)
    below = heard.start[shed] - middle
    assert np.linalg.norm(below, axis=1) == pytest.approx(radius, abs=0.03)  # a step goes 2 cm, and lumps are 2 cm wide
    assert below[:, 2].max() < 0.02
    assert np.ptp(below[:, 0]) > radius / 2


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
