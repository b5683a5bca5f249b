"""The table that is played, against the ramps and contacts that it is made from."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.playback.keyframe_tables import NO_CONTACT, keyframe_tables
from softground_addon.core.playback.ramps import QUANTUM, Ramps
from softground_addon.core.playback.vertex_histories import PointContacts, VertexHistories, vertex_histories
from tests.core.walkers import pressed, walk

NO_RAMPS = Ramps.joined([], 2)


def contacts_of(point, start, end, pressure):
    order = np.lexsort((start, point))
    return PointContacts(*(np.asarray(values)[order] for values in (point, start, end, pressure)))


def no_contacts():
    return PointContacts(np.zeros(0, dtype=np.intp), *np.zeros((3, 0)))


def row_at(table, place, frame):
    """The last row of a place that is not after the frame, by plain counting; None before the first."""
    rows = slice(table.first[place], table.first[place + 1])
    passed = np.count_nonzero(table.frame[rows] <= frame)
    return rows.start + passed - 1 if passed else None


def looked_up(table, values, place, frame):
    row = row_at(table, place, frame)
    if row is None:
        return np.zeros(2)
    if row == table.first[place + 1] - 1:
        return values[row]
    share = (frame - table.frame[row]) / (table.frame[row + 1] - table.frame[row])
    return values[row] + share * (values[row + 1] - values[row])


def random_ramps(rng, count, points):
    start = rng.integers(0, 400, count) / 4
    return Ramps.joined(
        [
            Ramps(
                np.sort(rng.integers(0, points, count)),
                start,
                start + rng.integers(1, 60, count) / 4,
                rng.integers(-40000, 10000, (count, 2)) * QUANTUM,
            )
        ],
        2,
    )


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(0, 60), st.integers(1, 6))
def test_it_holds_the_sum_of_all_ramps_at_any_time(seed, count, points):
    rng = np.random.default_rng(seed)
    ramps = random_ramps(rng, count, points)
    table = keyframe_tables(VertexHistories(ramps, no_contacts(), 0.0))
    for frame in [*rng.uniform(-5, 130, 12), *rng.choice(np.append(ramps.end, 0.0), 4)]:
        expected = ramps.at(frame, points)
        for place, point in enumerate(table.point):
            assert looked_up(table, table.movement, place, frame) == pytest.approx(expected[point], abs=QUANTUM)
    ended = ramps.at(1e6, points)
    assert table.movement[table.first[1:] - 1].tolist() == ended[table.point].tolist(), "at rest it is exact"
    assert (np.diff(table.frame)[np.diff(np.repeat(table.point, np.diff(table.first))) == 0] > 0).all()


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 25))
def test_it_tells_the_latest_contact_that_has_begun(seed, count):
    rng = np.random.default_rng(seed)
    start = rng.permutation(200)[:count] / 2
    contacts = contacts_of(
        rng.integers(0, 4, count), start, start + rng.integers(0, 40, count) / 2, rng.uniform(1, 9, count)
    )
    table = keyframe_tables(VertexHistories(NO_RAMPS, contacts, 0.0))
    for frame in rng.uniform(-5, 130, 15):
        for place, point in enumerate(table.point):
            begun = (contacts.point == point) & (contacts.start <= frame)
            row = row_at(table, place, frame)
            if not begun.any():
                assert row is None or table.contact_start[row] == NO_CONTACT
                continue
            last = np.flatnonzero(begun)[-1]
            assert table.contact_start[row] == contacts.start[last]
            assert table.contact_end[row] == contacts.end[begun].max()
            assert table.pressure[row] == contacts.pressure[last]


def test_a_walk_takes_few_rows():
    _, footprints = pressed(walk(steps=6), GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005))
    x, y = np.random.default_rng(0).uniform((-0.3, -0.3), (2.5, 0.3), (4000, 2)).T
    over_time = vertex_histories(footprints, x, y, blur_sigma=0.005)
    table = keyframe_tables(over_time)
    assert len(table.frame) <= 7 * len(table.point)
    assert np.diff(table.first).max() <= 40


def test_nothing_makes_an_empty_table():
    table = keyframe_tables(VertexHistories(NO_RAMPS, no_contacts(), 0.0))
    assert len(table.point) == len(table.frame) == 0
