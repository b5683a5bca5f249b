"""The polylines that are played, against the ramps and contacts that they are made from."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.deformation import GroundMaterial
from softground_addon.core.histories import Histories, Visits, histories
from softground_addon.core.polylines import LOADING, STRING, TICK, polylines, polylines_at
from softground_addon.core.ramps import QUANTUM, Ramps
from softground_addon.core.timelines import NO_VISIT, timelines
from tests.core.walkers import pressed, walk

NO_RAMPS = Ramps.joined([], 2)
POINTS = 4


def random_ramps(rng, count):
    start = rng.integers(0, 400, count) / 4
    point, change = np.sort(rng.integers(0, POINTS, count)), rng.integers(-40000, 10000, (count, 2)) * QUANTUM
    return Ramps.joined([Ramps(point, start, start + rng.integers(1, 60, count) / 4, change)], 2)


def random_visits(rng, count):
    point, start = rng.integers(0, POINTS, count), rng.permutation(200)[:count] / 2
    order = np.lexsort((start, point))
    end = start + rng.integers(0, 40, count) / 2
    return Visits(point[order], start[order], end[order], rng.uniform(1, 9, count))


def sampled(lines, place, frame):
    """What a sampled spline gives: the ends beyond the ends, between points what lies between."""
    points = slice(lines.first[place], lines.first[place + 1])
    since, state = lines.frame[points].astype(float), lines.state[points].astype(float)
    after = int(np.searchsorted(since, frame - lines.start[place], side="right"))
    if after in (0, len(since)):
        return state[min(after, len(since) - 1)]
    share = (frame - lines.start[place] - since[after - 1]) / (since[after] - since[after - 1])
    return state[after - 1] + share * (state[after] - state[after - 1])


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.integers(0, 20))
def test_they_hold_the_ramps_and_the_contacts_at_any_time(seed, ramps, contacts):
    rng = np.random.default_rng(seed)
    movement, visits = random_ramps(rng, ramps), random_visits(rng, contacts)
    lines = polylines(Histories(movement, visits, 0.0))
    assert (np.diff(lines.frame)[np.diff(np.repeat(lines.point, np.diff(lines.first))) == 0] >= 0).all()
    for place, point in enumerate(lines.point):
        for frame in rng.uniform(lines.start[place], lines.end[place], 15):
            height, sunk, contact_end, pressure = sampled(lines, place, frame)
            assert [height, sunk] == pytest.approx(movement.at(frame, POINTS)[point], abs=2 * QUANTUM)
            begun = np.flatnonzero((visits.point == point) & (visits.start <= frame))
            if not len(begun):
                assert (contact_end, pressure) == (NO_VISIT, 0.0)
                continue
            start, end = visits.start[begun[-1]], visits.end[begun].max()
            passed = np.clip((frame - start) / (end - start), 0.0, 1.0) if end > start else 0.0
            loaded = np.clip(min(passed, 1.0 - passed) / LOADING, 0.0, 1.0)
            assert contact_end == pytest.approx(end, abs=1e-4)
            assert pressure == pytest.approx(visits.pressure[begun[-1]] * loaded, abs=1e-4)


def test_at_the_end_nothing_presses_any_more():
    rng = np.random.default_rng(1)
    lines = polylines(Histories(random_ramps(rng, 9), random_visits(rng, 20), 0.0))
    assert (lines.state[lines.first[1:] - 1, 3] == 0.0).all()


def test_a_contact_adds_three_points_at_most_to_those_of_its_timeline():
    rng = np.random.default_rng(2)
    visits = random_visits(rng, 150)
    over_time = Histories(random_ramps(rng, 40), visits, 0.0)
    assert len(polylines(over_time).frame) <= len(timelines(over_time).frame) + 3 * len(visits.point)


def test_nothing_makes_no_polylines():
    nobody = Visits(np.zeros(0, dtype=np.intp), *np.zeros((3, 0)))
    lines = polylines(Histories(NO_RAMPS, nobody, 0.0))
    assert lines.first.tolist() == [0]
    assert lines.state.shape == (0, 4)


def test_made_part_by_part_they_are_the_same(monkeypatch):
    _, footprints = pressed(walk(steps=5), GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005))
    x, y = np.random.default_rng(0).uniform((-0.3, -0.3), (2.5, 0.3), (3000, 2)).T
    whole = polylines(histories(footprints, x, y, blur_sigma=0.005))
    monkeypatch.setattr("softground_addon.core.polylines.VISITS_AT_ONCE", 400)
    parts = polylines_at(footprints, x, y, blur_sigma=0.005)
    assert parts.error == pytest.approx(whole.error)
    order = np.argsort(parts.point)
    np.testing.assert_array_equal(parts.point[order], whole.point)
    np.testing.assert_array_equal(parts.start[order], whole.start)
    np.testing.assert_array_equal(parts.end[order], whole.end)
    for place, number in enumerate(order.tolist()):
        mine, theirs = (slice(*lines.first[k : k + 2]) for lines, k in ((parts, number), (whole, place)))
        np.testing.assert_array_equal(parts.frame[mine], whole.frame[theirs])
        np.testing.assert_allclose(parts.state[mine], whole.state[theirs], rtol=1e-6, atol=1e-6)


def trodden(footprint, times):
    """A footprint that is left again and again in the same place, ten frames apart."""

    def later(number):
        frames = {name: getattr(footprint, name) + 10.0 * number for name in ("contact_start", "contact_end")}
        for name in ("compression", "rim"):
            changes = getattr(footprint, name)
            frames[name] = replace(changes, frames=changes.frames + 10.0 * number)
        return replace(footprint, **frames)

    return [later(number) for number in range(times)]


def test_ground_that_is_stepped_on_again_and_again_takes_little_more_memory_than_what_is_played(monkeypatch):
    monkeypatch.setattr("softground_addon.core.polylines.VISITS_AT_ONCE", 1000)
    _, footprints = pressed(walk(steps=2), GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005))
    window, size = footprints[0].window, footprints[0].cell_size
    x, y = (grid.ravel() for grid in np.meshgrid(*window.centres(size)))

    def played_and_peak(times):
        steps = trodden(footprints[0], times)
        tracemalloc.start()
        try:
            lines = polylines_at(steps, x, y, blur_sigma=0.005)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        return lines.frame.nbytes + lines.state.nbytes, peak

    (few, before), (many, after) = played_and_peak(6), played_and_peak(12)
    assert after - before < 1.5 * (many - few)


def test_on_another_clock_everything_happens_at_its_frames_and_what_never_comes_stays_away():
    visits = Visits(np.array([0]), np.array([4.0]), np.array([6.0]), np.array([1e4]))
    heights = Ramps(
        np.array([0, 1]), np.array([2.0, 2.0]), np.array([8.0, 8.0]), np.array([[-0.01, 0.01], [-0.02, 0.02]])
    )
    lines = polylines(Histories(heights, visits, 0.0))
    slow = lines.stretched(0.5)
    for name in ("frame", "start", "end"):
        assert getattr(slow, name).tolist() == (getattr(lines, name) / 2).tolist()
    assert slow.state[:, :2].tolist() == lines.state[:, :2].tolist()
    assert set(lines.state[:, 2].tolist()) == {6.0, NO_VISIT}
    assert set(slow.state[:, 2].tolist()) == {3.0, NO_VISIT}


def test_strung_together_no_place_reaches_into_another_and_all_times_are_known_to_a_tick():
    rng = np.random.default_rng(3)
    start = rng.uniform(0, 2000, 600)
    heights = Ramps(np.arange(600), start, start + rng.uniform(0.25, 90, 600), rng.integers(1, 9, (600, 2)) * QUANTUM)
    lines = polylines(Histories(heights, random_visits(rng, 0), 0.0))
    string, offset = lines.end_to_end()
    assert string.tolist() == sorted(string.tolist())
    assert set(string.tolist()) == set(range(string[-1] + 1))
    last = lines.frame[lines.first[1:] - 1]
    for number in range(string[-1] + 1):
        begin, end = offset[string == number], (offset + last)[string == number]
        assert begin[0] == 0.0
        assert (begin[1:] >= end[:-1] + 1.0).all()
        assert begin[-1] <= STRING
        assert (np.spacing(end) <= TICK).all()
    assert string[-1] < len(start) * 46 / STRING + 2
