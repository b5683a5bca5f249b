"""What the ground can do beyond the paper: each option in numbers, and what holds with all of them on."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import FIRM_RATIO, GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.pressing.deformation import compress, compression_rate, target_compression
from softground_addon.core.pressing.rim import LEANING_DISTANCE, in_contact, lean_of_landing, leaning, rim_weights
from softground_addon.core.record.footprints import QUANTUM, recompose
from tests.core.pressing.test_ground_invariants import Hills, random_loads
from tests.core.pressing.test_pressure import rolling
from tests.core.walkers import BALL, FOOT_LENGTH, box_sole, equilibrium_depth, loads_of, pose, pressed, standing, walk
from tests.tiers import slow_but_one

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
SAND = GroundMaterial(0.33e6, 0.5, 0.05)
REPOSE = np.radians(32.0)
OPTIONS = {
    "rim_bias": 0.8,
    "repose_angle": REPOSE,
    "shortest_time": 0.01,
    "hardening": 10.0,
    "crust_stress": 5e3,
    "firm_depth": 0.02,
}


def test_every_option_is_off_by_default():
    assert all(getattr(SNOW, name) == 0 for name in OPTIONS)


# Rim bias


def disc(rows=41, columns=41, radius=6):
    y, x = np.mgrid[:rows, :columns]
    coverage = (np.hypot(x - columns // 2, y - rows // 2) <= radius).astype(float)[None]
    return coverage, x - columns // 2, y - rows // 2


@given(st.floats(0, 1), st.floats(-np.pi, np.pi))
def test_the_rim_leans_by_one_plus_b_cos_theta_and_keeps_its_volume(bias, heading):
    coverage, x, y = disc()
    toward = bias * np.array([[np.cos(heading), np.sin(heading)]])
    even = rim_weights(coverage, in_contact(coverage), 4.0)[0]
    leaning = rim_weights(coverage, in_contact(coverage), 4.0, toward=toward)[0]
    assert leaning.sum() == pytest.approx(1.0)
    assert leaning.min() >= 0
    ring = even > 0
    expected = 1 + bias * np.cos(np.arctan2(y, x) - heading)
    assert leaning[ring] / even[ring] == pytest.approx(expected[ring], abs=0.02)


def test_a_step_without_contact_has_no_rim_that_leans():
    nothing = np.zeros((1, 5, 5), np.float32)
    assert not rim_weights(nothing, in_contact(nothing), 2.0, toward=np.array([[0.5, 0.0]])).any()


def test_a_sole_that_slides_piles_up_the_rim_ahead_and_one_that_stands_does_not():
    sole = box_sole(0.1, 0.1)
    count = 61
    touching = np.ones((count, 1), bool)
    ahead = {}
    for name, speed in (("slides", 0.4), ("stands", 0.0)):
        x = speed * np.arange(count) / 120
        transforms = pose(np.stack([x, 0 * x, 0 * x], -1))[:, None]
        loads = loads_of([sole], [transforms], np.full((count, 1), 300.0), touching, 30.0)
        ground, (footprint,) = pressed(loads, replace(SAND, rim_bias=1.0), 0.01)
        rim = ground.read(footprint.window)[1]
        columns, _ = footprint.window.centres(0.01)
        ahead[name] = rim[:, columns > x[-1] + 0.05].sum() / rim[:, columns < x[0] - 0.05].sum()
        assert footprint.rim_m3 == pytest.approx(footprint.compressed_m3, rel=1e-9)
    assert ahead["stands"] == pytest.approx(1.0, rel=0.05)
    assert ahead["slides"] > 4


@given(st.lists(st.tuples(*2 * [st.floats(-0.05, 0.05)]), min_size=1, max_size=6), st.integers(1, 9))
def test_the_lean_depends_on_the_way_of_the_sole_and_not_on_the_steps_it_is_sampled_in(moves, parts):
    corners = np.concatenate([np.zeros((1, 3)), np.cumsum([(*move, 0.01) for move in moves], axis=0)])
    fine = np.stack(
        [np.interp(np.arange(len(moves) * parts + 1) / parts, np.arange(len(corners)), c) for c in corners.T]
    )
    start = np.array([0.6, -0.3])
    whole = leaning(corners, 0.27, start)
    assert leaning(fine.T, 0.27, start)[parts - 1 :: parts] == pytest.approx(whole, abs=1e-6)
    assert np.linalg.norm(whole, axis=1).max() <= 1 + 1e-12


def test_a_sole_that_moves_turns_its_lean_by_an_exponential_of_the_distance():
    distance = 2 * LEANING_DISTANCE * 0.27
    (lean,) = leaning(np.array([[0, 0, 0], [0, distance, 0]]), 0.27, np.array([1.0, 0.0]))
    assert lean == pytest.approx([np.exp(-2), 1 - np.exp(-2)])


@pytest.mark.parametrize(("way", "expected"), [((0, 0, -0.02), 0), ((0.02, 0, -0.02), 0.5**0.5), ((0.02, 0, 0), 1)])
def test_a_rim_leans_the_way_that_the_sole_comes_seen_from_above(way, expected):
    path = np.outer(np.arange(2), way)
    assert lean_of_landing(path, 0.27) == pytest.approx([expected, 0], abs=0.015)
    assert not lean_of_landing(0 * path, 0.27).any()


@pytest.mark.parametrize("material", [SAND, replace(SAND, poisson_ratio=0.35, characteristic_time=0.15)])
@pytest.mark.parametrize("heading", [0.0, 2.5])
def test_the_rim_of_a_walking_foot_is_highest_at_its_toes(material, heading):
    """Without a bias it is highest where the heel struck."""
    at = {}
    for bias in (0.0, 0.6):
        ground, steps = pressed(walk(heading=heading, steps=4), replace(material, rim_bias=bias), 0.01)
        x, y = np.meshgrid(*steps[1].window.centres(0.01))
        along = (x - steps[1].position[0]) * np.cos(heading) + (y - steps[1].position[1]) * np.sin(heading)
        of_print = along.ravel()[steps[1].contact_cells]
        compression, rim = ground.read(steps[1].window)
        highest = along.ravel()[np.argmax(rim - compression)]
        at[bias] = (highest - of_print.min()) / np.ptp(of_print)
        assert steps[1].rim_m3 == pytest.approx(2 * material.poisson_ratio * steps[1].compressed_m3, rel=1e-9)
    assert at[0.0] < 0.5
    assert at[0.6] > BALL / FOOT_LENGTH + 0.1


# Time from the speed of landing


def test_the_time_follows_the_speed_of_landing_between_its_limits():
    material = replace(SNOW, shortest_time=0.02)
    # 2·0.03/0.5 = 0.12 s; slower than 0.3 m/s the characteristic time counts, faster than 3 m/s the shortest.
    for speed, time in ((0.5, 0.12), (0.1, 0.2), (0.0, 0.2), (10.0, 0.02)):
        assert compression_rate(0.01, material, 0.03, speed) == pytest.approx(0.01 / time)
    assert compression_rate(0.01, SNOW, 0.03, 5.0) == 0.01 / 0.2


def landing(speed, frame_rate=30.0):
    """A box that comes down at a speed, then stands for 0.1 s under 500 N."""
    per_frame = {24.0: 5, 30.0: 4, 60.0: 2, 120.0: 1}[frame_rate]
    count = round(0.5 * frame_rate) * per_frame + 1
    time = np.arange(count) / (per_frame * frame_rate) - 0.25
    height = np.maximum(0.0, -speed * time)
    transforms = pose(np.stack([0 * time, 0 * time, height], -1))[:, None]
    touching = ((time > -1e-9) & (time < 0.1))[:, None]
    return loads_of([box_sole(0.25, 0.09)], [transforms], 500.0 * touching, touching, frame_rate)


def test_a_fast_landing_sinks_in_at_once_where_a_slow_one_takes_its_time():
    material = replace(SNOW, shortest_time=0.01)
    expected = equilibrium_depth(500.0, 0.25 * 0.09, SNOW)
    slow, fast = (pressed(landing(speed), material)[1][0].max_depth_m for speed in (0.05, 2.0))
    assert slow == pytest.approx(expected * 13 / 24, rel=0.02)  # 13 steps of 1/120 s in a time of 0.2 s
    assert fast == pytest.approx(expected, rel=0.02)


# Hardening


def stamping(times, *, contact=0.1, force=500.0, frame_rate=30.0):
    """A box that presses the same spot several times, each time for a part of the characteristic time."""
    steps = round(contact * 120)
    count = 4 * round(30.0 * (0.3 + 0.3 * times)) + 1
    touching = np.zeros((count, 1), bool)
    for number in range(times):
        start = 12 + 36 * number
        touching[start : start + steps] = True
    transforms = np.tile(pose((0.003, 0.001, 0)), (count, 1, 1, 1))
    return loads_of([box_sole(0.25, 0.09)], [transforms], force * touching, touching, frame_rate)


@pytest.mark.parametrize("contact", [0.05, 0.1, 0.15, 0.25])
def test_with_hardening_a_second_step_adds_less_than_three_tenths_of_the_first(contact):
    first, second = pressed(stamping(2, contact=contact), replace(SNOW, hardening=10.0))[1]
    assert second.compressed_m3 < 0.3 * first.compressed_m3
    untouched, again = pressed(stamping(2, contact=contact), SNOW)[1]
    assert first.compressed_m3 == untouched.compressed_m3
    if contact <= 0.1:  # half of the time it would take: without hardening the second step adds as much again
        assert again.compressed_m3 == pytest.approx(untouched.compressed_m3, rel=0.01)


@pytest.mark.parametrize("hardening", [0.0, 1.0, 10.0, 1000.0])
def test_twenty_steps_on_one_spot_come_to_rest_above_the_depth_of_a_lasting_load(hardening):
    ground, footprints = pressed(stamping(20), replace(SNOW, hardening=hardening))
    added = [footprint.compressed_m3 for footprint in footprints]
    assert (np.diff(added) <= 1e-12).all()
    window = footprints[0].window
    limit = equilibrium_depth(500.0, box_sole(0.25, 0.09).patches[0].area, SNOW)
    assert ground.read(window)[0].max() <= limit * (1 + 1e-9)


@given(st.floats(0, 0.1), st.floats(0, 0.1), st.floats(0.01, 3), st.floats(0, 100))
def test_hardened_ground_gives_less_never_back_and_never_beyond_the_target(compacted, more, rate, hardening):
    before = np.array([compacted + more * 0.1])
    plain = compress(before, np.ones(1), 0.05, rate)
    hard = compress(before, np.ones(1), 0.05, rate, compacted=np.array([compacted]), hardening=hardening)
    assert before <= hard <= plain + 1e-15


# Crust


def test_a_crust_carries_what_does_not_break_it():
    area = box_sole(0.25, 0.09).patches[0].area
    crusty = replace(SNOW, crust_stress=20e3)
    ground, footprints = pressed(standing(box_sole(0.25, 0.09), [[0, 0, 0]], 19e3 * area), crusty)
    assert not ground.tiles
    assert not any(footprint.compressed_m3 for footprint in footprints)
    _, (footprint,) = pressed(standing(box_sole(0.25, 0.09), [[0, 0, 0]], 21e3 * area), crusty)
    assert footprint.max_depth_m == pytest.approx(21e3 / 0.25e6 * 0.3, rel=0.01)


def test_a_broken_crust_stays_broken():
    sole = box_sole(0.25, 0.09)
    area = sole.patches[0].area
    crusty = replace(SNOW, crust_stress=20e3)
    count = 4 * 90 + 1
    touching = np.zeros((count, 1), bool)
    touching[10:16] = touching[100:300] = True
    force = np.where(np.arange(count) < 50, 25e3, 15e3)[:, None] * area * touching
    transforms = np.tile(pose((0, 0, 0)), (count, 1, 1, 1))
    _, (breaking, following) = pressed(loads_of([sole], [transforms], force, touching, 30.0), crusty)
    assert breaking.max_depth_m == pytest.approx(0.25 * 25e3 / 0.25e6 * 0.3, rel=0.01)
    assert breaking.max_depth_m + following.max_depth_m == pytest.approx(15e3 / 0.25e6 * 0.3, rel=0.01)


# Firm layer


def test_below_its_firm_depth_the_ground_is_stiffer():
    material = replace(SNOW, firm_depth=0.02)
    # 25 kPa would press 3 cm: 2 cm, and of the third one part in ten.
    depth = target_compression(np.array([10e3, 25e3, 1e9]), material)
    assert depth == pytest.approx([0.012, 0.02 + 0.01 / FIRM_RATIO, 0.3])
    sole = box_sole(0.25, 0.09)
    _, (footprint,) = pressed(standing(sole, [[0, 0, 0]], 25e3 * sole.patches[0].area), material)
    assert footprint.max_depth_m == pytest.approx(0.021, rel=0.01)


# Angle of repose


def slopes(state, cell):
    height = state[1] - state[0]
    return max(abs(np.diff(height, axis=axis)).max() for axis in (0, 1)) / cell


@pytest.mark.parametrize("cell", [0.01, 0.005])
def test_a_walk_in_dry_sand_leaves_no_slope_steeper_than_its_angle_of_repose(cell):
    sand = replace(SAND, repose_angle=REPOSE)
    loads = walk(steps=3, heading=0.3)
    ground, footprints = pressed(loads, sand, cell)
    loose, _ = pressed(loads, SAND, cell)
    for footprint in footprints:
        window = footprint.window
        assert slopes(ground.read(window), cell) <= 1.03 * np.tan(REPOSE)
        assert slopes(loose.read(window), cell) > 1.5 * np.tan(REPOSE)
    assert ground.volumes() == pytest.approx(loose.volumes(), rel=1e-6)


def test_the_slopes_do_not_depend_on_the_frame_rate():
    sand = replace(SAND, repose_angle=REPOSE)
    reference, footprints = pressed(walk(steps=1, frame_rate=120.0), sand)
    window = footprints[0].window
    for rate in (24.0, 30.0, 60.0):
        ground, _ = pressed(walk(steps=1, frame_rate=rate), sand)
        assert ground.read(window) == pytest.approx(reference.read(window), abs=1e-4)


# All of them

ALL = replace(SAND, **OPTIONS)


def check_every_frame(loads, terrain, material, cell_size, pressure):
    """What must hold at each frame whatever is on; the ground and the record."""
    footprints, previous = [], {}
    for result in simulate(loads, SoftGround(terrain, material, pressure=pressure), cell_size):
        footprints += result.footprints
        for window in result.ground.tile_windows():
            state = result.ground.read(window)
            assert np.isfinite(state).all()
            assert (state[0] >= previous.get(window, 0.0)).all(), "compression only grows"
            assert state[0].max() <= material.layer_depth
            previous[window] = state[0]
    compressed, rim = result.ground.volumes()
    unplaced = sum(footprint.unplaced_rim_m3 for footprint in footprints)
    raised = sum(footprint.rim_m3 for footprint in footprints)
    assert rim == pytest.approx(raised, rel=1e-6, abs=1e-15)
    assert rim + unplaced == pytest.approx(2 * material.poisson_ratio * compressed, rel=1e-6, abs=1e-15)
    recomposed = recompose(footprints, cell_size=cell_size)
    for window in result.ground.tile_windows():
        assert recomposed.read(window) == pytest.approx(result.ground.read(window), abs=QUANTUM)
    return result.ground, footprints


@settings(max_examples=12)
@example(77, replace(SAND, rim_bias=0.5, repose_angle=0.8, crust_stress=1e5, hardening=1.0), 0.05, "UNIFORM", 0.16)
@given(
    st.integers(0, 2**32 - 1),
    st.builds(
        GroundMaterial,
        youngs_modulus=st.floats(5e4, 5e6),
        poisson_ratio=st.floats(0, 0.5),
        characteristic_time=st.floats(0.01, 0.5),
        layer_depth=st.floats(0.02, 0.3),
        rim_bias=st.floats(0, 1),
        repose_angle=st.sampled_from([0.0, 0.4, 0.8]),
        shortest_time=st.sampled_from([0.0, 0.02]),
        hardening=st.sampled_from([0.0, 1.0, 20.0]),
        crust_stress=st.sampled_from([0.0, 1e4, 1e5]),
        firm_depth=st.sampled_from([0.0, 0.01, 1.0]),
    ),
    st.sampled_from([0.02, 0.05]),
    st.sampled_from(["UNIFORM", "CENTRE_OF_PRESSURE"]),
    st.floats(0, 0.3),
)
def test_volumes_limits_and_the_record_hold_with_every_option(seed, material, cell, pressure, height):
    check_every_frame([random_loads(seed)], Hills(height, 0.1), material, cell, pressure)


@pytest.mark.parametrize("pressure", slow_but_one(["CENTRE_OF_PRESSURE", "UNIFORM"]))
def test_a_walk_with_every_option_on_does_not_depend_on_frame_rate_cell_size_or_heading(pressure):
    reference, _ = check_every_frame([rolling(walk(steps=2))], FlatTerrain(), ALL, 0.01, pressure)
    for rate in (24.0, 60.0, 120.0):
        ground, _ = check_every_frame([rolling(walk(steps=2, frame_rate=rate))], FlatTerrain(), ALL, 0.01, pressure)
        assert ground.volumes() == pytest.approx(reference.volumes(), rel=0.01)
    for cell in (0.005, 0.02):
        ground, _ = check_every_frame([rolling(walk(steps=2))], FlatTerrain(), ALL, cell, pressure)
        assert ground.volumes() == pytest.approx(reference.volumes(), rel=0.02)
    ground, _ = check_every_frame([rolling(walk(steps=2, heading=0.7))], FlatTerrain(), ALL, 0.01, pressure)
    assert ground.volumes() == pytest.approx(reference.volumes(), rel=0.01)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
def test_without_load_no_bit_changes(pressure):
    loads = standing(box_sole(0.25, 0.09), [[0, 0, 0]], 0.0)
    ground, footprints = check_every_frame([loads], Hills(0.2, 0.0), ALL, 0.01, pressure)
    assert not ground.tiles
    assert not footprints
