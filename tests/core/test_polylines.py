"""The polylines that are played, against the ramps and contacts that they are made from."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.histories import Histories, Visits
from softground_addon.core.polylines import LOADING, polylines
from softground_addon.core.ramps import QUANTUM, Ramps
from softground_addon.core.timelines import NO_VISIT, timelines

NO_RAMPS = Ramps.joined([])
POINTS = 4


def random_ramps(rng, count):
    start = rng.integers(0, 400, count) / 4
    point, change = np.sort(rng.integers(0, POINTS, count)), rng.integers(-40000, 10000, count) * QUANTUM
    return Ramps.joined([Ramps(point, start, start + rng.integers(1, 60, count) / 4, change)])


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


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.integers(0, 20))
def test_they_hold_the_ramps_and_the_contacts_at_any_time(seed, ramps, contacts):
    rng = np.random.default_rng(seed)
    heights, compression, visits = random_ramps(rng, ramps), random_ramps(rng, ramps // 2), random_visits(rng, contacts)
    table = timelines(Histories(heights, compression, visits, 0.0))
    lines = polylines(table)
    assert (np.diff(lines.frame)[np.diff(np.repeat(table.point, np.diff(lines.first))) == 0] >= 0).all()
    for place, point in enumerate(table.point):
        for frame in rng.uniform(lines.start[place], lines.end[place], 15):
            height, sunk, contact_end, pressure = sampled(lines, place, frame)
            assert height == pytest.approx(heights.at(frame, POINTS)[point], abs=2 * QUANTUM)
            assert sunk == pytest.approx(compression.at(frame, POINTS)[point], abs=2 * QUANTUM)
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
    lines = polylines(timelines(Histories(random_ramps(rng, 9), NO_RAMPS, random_visits(rng, 20), 0.0)))
    assert (lines.state[lines.first[1:] - 1, 3] == 0.0).all()


def test_a_contact_adds_three_points_at_most_to_those_of_its_timeline():
    rng = np.random.default_rng(2)
    visits = random_visits(rng, 150)
    table = timelines(Histories(random_ramps(rng, 40), NO_RAMPS, visits, 0.0))
    assert len(polylines(table).frame) <= len(table.frame) + 3 * len(visits.point)


def test_nothing_makes_no_polylines():
    nobody = Visits(np.zeros(0, dtype=np.intp), *np.zeros((3, 0)))
    lines = polylines(timelines(Histories(NO_RAMPS, NO_RAMPS, nobody, 0.0)))
    assert lines.first.tolist() == [0]
    assert lines.state.shape == (0, 4)
