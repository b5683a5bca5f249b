"""The curves that are played, against the ramps and contacts that they are made from."""

import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.playback.keyframe_tables import NO_CONTACT, keyframe_tables
from softground_addon.core.playback.playback_curves import (
    LENGTH,
    LOADING,
    NARROW,
    TICK,
    carves_together,
    curves,
    playback_curves_at,
)
from softground_addon.core.playback.ramps import QUANTUM, Ramps
from softground_addon.core.playback.vertex_histories import (
    CARVED_TOLERANCE,
    PointContacts,
    VertexHistories,
    vertex_histories,
)
from softground_addon.core.record.footprints import FootprintRecorder, quantised
from softground_addon.core.record.pressed_ground import PressedGround
from softground_addon.core.relief.steps import StepRelief
from tests.core.walkers import pressed, walk

NO_RAMPS = Ramps.joined([], 2)
POINTS = 4
RATE = 30.0


def random_ramps(rng, count):
    start = rng.integers(0, 400, count) / 4
    point, change = np.sort(rng.integers(0, POINTS, count)), rng.integers(-40000, 10000, (count, 2)) * QUANTUM
    return Ramps.joined([Ramps(point, start, start + rng.integers(1, 60, count) / 4, change)], 2)


def random_contacts(rng, count):
    point, start = rng.integers(0, POINTS, count), rng.permutation(200)[:count] / 2
    order = np.lexsort((start, point))
    end = start + rng.integers(0, 40, count) / 2
    return PointContacts(point[order], start[order], end[order], rng.uniform(1, 9, count))


def unpacked(spans, lines):
    position, contact = lines.position.unpacked(), lines.contact.unpacked()
    return spans, SimpleNamespace(size=lines.size, position=position, contact=contact)


def points_of(spans, lines, place):
    """The points of a place's curve from its start to its end: all of them are at whole ticks."""
    first = np.concatenate([[0], np.cumsum(lines.size)])[spans.curve[place]]
    points = np.arange(first, first + lines.size[spans.curve[place]])
    along = lines.position[points, 0].astype(float)
    end = spans.offset[place] + float(spans.end[place]) - float(spans.start[place])
    return points[(along >= spans.offset[place]) & (along <= end + 0.25)]


def sampled(spans, lines, place, frame):
    """What a sampled spline gives for a place: time along it, height, compression and contact."""
    first = np.concatenate([[0], np.cumsum(lines.size)])[spans.curve[place]]
    points = slice(first, first + lines.size[spans.curve[place]])
    position, contact = lines.position[points].astype(float), lines.contact[points].astype(float)
    step = np.linalg.norm(np.diff(lines.position[points], axis=0), axis=1)  # single precision, as Blender has it
    along = np.concatenate([np.zeros(1, dtype=np.float32), np.cumsum(step, dtype=np.float32)]).astype(float)
    values = np.concatenate([position[:, 1:] / NARROW, contact[:, None]], axis=-1)
    length = float(spans.offset[place]) + max(frame - float(spans.start[place]), 0.0)
    after = int(np.searchsorted(along, length, side="right"))
    if after in (0, len(along)):
        return values[min(after, len(along) - 1)]
    share = (length - along[after - 1]) / (along[after] - along[after - 1])
    return values[after - 1] + share * (values[after] - values[after - 1])


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.integers(0, 20))
def test_they_hold_the_ramps_and_the_contacts_at_any_time(seed, ramps, contacts):
    rng = np.random.default_rng(seed)
    movement, contacts = random_ramps(rng, ramps), random_contacts(rng, contacts)
    spans, lines = unpacked(*curves(VertexHistories(movement, contacts, 0.0), RATE))
    steepest = np.abs(movement.change / (movement.end - movement.start)[:, None]).sum(initial=0.0)
    along = lines.position[:, 0]
    assert (np.diff(along)[np.diff(np.repeat(np.arange(len(lines.size)), lines.size)) == 0] >= 0).all()
    for place, point in enumerate(spans.point):
        for frame in rng.uniform(spans.start[place], spans.end[place], 15):
            height, sunk, contact = sampled(spans, lines, place, frame)
            assert [height, sunk] == pytest.approx(movement.at(frame, POINTS)[point], abs=2 * QUANTUM + steepest * TICK)
            begun = np.flatnonzero((contacts.point == point) & (contacts.start <= frame))
            if not len(begun):
                assert contact == -NO_CONTACT
                continue
            start, end = contacts.start[begun[-1]], contacts.end[begun].max()
            passed = np.clip((frame - start) / (end - start), 0.0, 1.0) if end > start else 0.0
            loaded = np.clip(min(passed, 1.0 - passed) / LOADING, 0.0, 1.0)
            pressure, age = contacts.pressure[begun[-1]] * loaded, max(frame - end, 0.0) / RATE
            steep = contacts.pressure[begun[-1]] / (LOADING * (end - start)) if end > start else 0.0
            assert contact == pytest.approx(pressure - age, abs=1e-4 + steep * TICK)


def test_at_the_end_nothing_presses_any_more_and_all_is_told_without_a_look():
    rng = np.random.default_rng(1)
    movement, contacts = random_ramps(rng, 9), random_contacts(rng, 20)
    spans, lines = unpacked(*curves(VertexHistories(movement, contacts, 0.0), RATE))
    for place, point in enumerate(spans.point):
        height, _, contact = sampled(spans, lines, place, spans.end[place])
        assert contact <= 0.0
        assert spans.last_height[place] == height == movement.at(1e6, POINTS)[point, 0]
        assert spans.last_contact[place] == max(contacts.end[contacts.point == point], default=NO_CONTACT)


def test_a_contact_adds_three_points_at_most_to_those_of_its_timeline():
    rng = np.random.default_rng(2)
    contacts = random_contacts(rng, 150)
    over_time = VertexHistories(random_ramps(rng, 40), contacts, 0.0)
    _, lines = unpacked(*curves(over_time, RATE))
    assert len(lines.position) <= len(keyframe_tables(over_time).frame) + 3 * len(contacts.point)


def test_nothing_makes_no_polylines():
    nobody = PointContacts(np.zeros(0, dtype=np.intp), *np.zeros((3, 0)))
    none = unpacked(*curves(VertexHistories(NO_RAMPS, nobody, 0.0), RATE))
    for spans, lines in (none, at([], np.zeros(3), np.zeros(3))):
        assert len(spans.point) == len(lines.size) == len(lines.contact) == 0
        assert lines.position.shape == (0, 3)


def at(footprints, x, y, time_stretch=1.0):
    curves = playback_curves_at(footprints, x, y, blur_sigma=0.005, frame_rate=RATE, time_stretch=time_stretch)
    return unpacked(*curves)


def test_made_part_by_part_they_are_the_same(monkeypatch):
    _, footprints = pressed(walk(steps=5), GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005))
    x, y = np.random.default_rng(0).uniform((-0.3, -0.3), (2.5, 0.3), (3000, 2)).T
    whole, its_lines = unpacked(*curves(vertex_histories(footprints, x, y, blur_sigma=0.005), RATE))
    monkeypatch.setattr("softground_addon.core.playback.playback_curves.CONTACTS_AT_ONCE", 400)
    parts, lines = at(footprints, x, y)
    assert parts.error == pytest.approx(whole.error)
    assert len(lines.size) > len(its_lines.size)
    order = np.argsort(parts.point)
    for name in ("point", "start", "end", "last_height", "last_contact"):
        np.testing.assert_array_equal(getattr(parts, name)[order], getattr(whole, name))
    for place, number in enumerate(order.tolist()):
        mine, theirs = points_of(parts, lines, number), points_of(whole, its_lines, place)
        along = lines.position[mine, 0] - parts.offset[number], its_lines.position[theirs, 0] - whole.offset[place]
        np.testing.assert_array_equal(*along)
        np.testing.assert_array_equal(lines.position[mine, 1:], its_lines.position[theirs, 1:])
        np.testing.assert_array_equal(lines.contact[mine], its_lines.contact[theirs])


def trodden(footprint, times):
    """A footprint that is left again and again in the same place, ten frames apart."""

    def later(number):
        frames = {name: getattr(footprint, name) + 10.0 * number for name in ("contact_start", "contact_end")}
        for name in ("compression", "rim"):
            changes = getattr(footprint, name)
            frames[name] = replace(changes, frames=changes.frames + 10.0 * number)
        return replace(footprint, **frames)

    return [later(number) for number in range(times)]


def test_ground_that_is_stepped_on_again_and_again_takes_less_memory_than_what_is_played(monkeypatch):
    monkeypatch.setattr("softground_addon.core.playback.playback_curves.CONTACTS_AT_ONCE", 1000)
    monkeypatch.setattr("softground_addon.core.playback.playback_curves.SMALL", 0)  # as beyond a few megabytes
    monkeypatch.setattr("softground_addon.core.playback.vertex_histories.ROOM", 0)
    _, footprints = pressed(walk(steps=2), GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005))
    window, size = footprints[0].window, footprints[0].cell_size
    x, y = (grid.ravel() for grid in np.meshgrid(*window.centres(size)))

    def played_and_peak(times):
        steps = trodden(footprints[0], times)
        tracemalloc.start()
        try:
            _, lines = playback_curves_at(steps, x, y, blur_sigma=0.005, frame_rate=RATE)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        return lines.position.unpacked().nbytes + lines.contact.unpacked().nbytes, peak

    (few, before), (more, after) = played_and_peak(6), played_and_peak(12)
    assert after - before < 0.5 * (more - few)


def test_what_is_small_is_not_packed_and_plays_the_same(monkeypatch):
    _, footprints = pressed(walk(steps=3), GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005))
    x, y = np.random.default_rng(4).uniform((-0.3, -0.3), (1.6, 0.3), (2000, 2)).T
    spans, lines = playback_curves_at(footprints, x, y, blur_sigma=0.005, frame_rate=RATE)
    monkeypatch.setattr("softground_addon.core.playback.playback_curves.SMALL", 0)
    monkeypatch.setattr("softground_addon.core.playback.vertex_histories.ROOM", 0)
    its_spans, packed = playback_curves_at(footprints, x, y, blur_sigma=0.005, frame_rate=RATE)
    assert packed.position.nbytes < lines.position.nbytes
    np.testing.assert_array_equal(packed.position.unpacked(), lines.position.unpacked())
    np.testing.assert_array_equal(packed.contact.unpacked(), lines.contact.unpacked())
    np.testing.assert_array_equal(its_spans.offset, spans.offset)


def test_on_another_clock_everything_happens_at_its_frames_and_what_never_comes_stays_away():
    _, footprints = pressed(walk(steps=3), GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005))
    x, y = np.random.default_rng(4).uniform((-0.3, -0.3), (1.6, 0.3), (300, 2)).T
    factor = 2.5
    spans, lines = at(footprints, x, y)
    slow, slow_lines = at(footprints, x, y, factor)
    assert slow.frame_rate == factor * spans.frame_rate
    for name in ("start", "end"):
        np.testing.assert_allclose(getattr(slow, name), factor * getattr(spans, name), rtol=1e-6)
    touched = spans.last_contact < NO_CONTACT
    np.testing.assert_allclose(slow.last_contact[touched], factor * spans.last_contact[touched], rtol=1e-6)
    assert (slow.last_contact[~touched] == NO_CONTACT).all()
    for place in range(0, len(spans.point), 7):
        for frame in np.linspace(spans.start[place], spans.end[place], 9)[1:-1] + 0.01:
            expected = sampled(spans, lines, place, frame)
            assert sampled(slow, slow_lines, place, factor * frame) == pytest.approx(expected, rel=1e-3, abs=1e-5)


def test_end_to_end_no_place_reaches_into_another_and_all_times_are_known_to_a_tick():
    rng = np.random.default_rng(3)
    start = rng.uniform(0, 2000, 600)
    heights = Ramps(np.arange(600), start, start + rng.uniform(0.25, 90, 600), rng.integers(1, 9, (600, 2)) * QUANTUM)
    spans, lines = unpacked(*curves(VertexHistories(heights, random_contacts(rng, 0), 0.0), RATE))
    assert spans.curve.tolist() == sorted(spans.curve.tolist())
    assert set(spans.curve.tolist()) == set(range(len(lines.size)))
    assert lines.size.sum() == len(lines.position)
    last = spans.end - spans.start
    for number in range(len(lines.size)):
        begin = spans.offset[spans.curve == number]
        end = (spans.offset + last)[spans.curve == number]
        assert begin[0] == 0.0
        assert (begin[1:] >= end[:-1] + 1.0).all()
        assert begin[-1] <= LENGTH
        assert (np.spacing(end) <= TICK).all()
    assert len(lines.size) < len(start) * 47 / LENGTH + 2


def carved(column, start, rng, contact=0):
    """A carve of 40 x 20 cells, from a frame on; one that touches is a print."""
    recorder, window = FootprintRecorder(0.01, 1.0), Window(column, -10, 40, 20)
    for frame in range(start, start + 20, 2):
        change = rng.uniform(-0.01, 0.03, (2, 20, 40)) * (rng.random((20, 40)) < 0.4)
        recorder.add(float(frame), window, quantised(change), np.full((20, 40), contact > 0))
    numbers = dict.fromkeys(("area_m2", "peak_force_n", "compressed_m3", "rim_m3", "unplaced_rim_m3", "heading"), 0.0)
    made = {"character": "", "sole": "", "position": np.zeros(3), "load_frames": np.zeros(0), "load_n": np.zeros(0)}
    return recorder.footprint(**numbers, **made, start_frame=float(start), end_frame=start + 20.0)


def test_carves_of_the_same_ground_share_one_tolerance_and_their_last_heights_are_exact():
    rng = np.random.default_rng(3)
    carves = [carved(20 * number, 10 + 8 * number, rng) for number in range(4)]
    x, y = rng.uniform((0.0, -0.1), (1.0, 0.1), (400, 2)).T
    given = {"blur_sigma": 0.01, "frame_rate": RATE}
    spans, lines = unpacked(*playback_curves_at(carves, x, y, **given))
    assert spans.error <= CARVED_TOLERANCE * 1.001
    alone = sum(len(playback_curves_at([carve], x, y, **given)[1].position) for carve in carves)
    assert len(lines.position) < alone
    for frame in (14.0, 21.5, 33.0):
        expected = PressedGround.at(carves, frame=frame, frame_rate=RATE, cell_size=0.01, blur_sigma=0.01).sample(x, y)
        shown = np.zeros(len(x))
        until = np.minimum(frame, spans.end)
        shown[spans.point] = [sampled(spans, lines, place, at)[0] for place, at in enumerate(until)]
        assert np.abs(shown - expected.display).max() <= spans.error + 1e-6
    last = PressedGround.at(carves, frame=80.0, frame_rate=RATE, cell_size=0.01, blur_sigma=0.01).sample(x, y).display
    assert np.bincount(spans.point, spans.last_height, len(x)) == pytest.approx(last, abs=5 * QUANTUM)


def test_relief_of_carves_that_are_worked_out_together_is_all_there_in_the_end():
    rng = np.random.default_rng(4)
    carves = [carved(20 * number, 10 + 8 * number, rng) for number in range(3)]
    x, y = rng.uniform((0.0, -0.1), (0.8, 0.1), (200, 2)).T
    point = np.arange(200)
    relief = [StepRelief(point[n::2], np.full((len(point[n::2]), 2), 2.0**-10), np.zeros(100)) for n in (0, 1, 0)]
    given = {"blur_sigma": 0.01, "frame_rate": RATE}
    spans = playback_curves_at(carves, x, y, relief=relief, **given)[0]
    without = playback_curves_at(carves, x, y, **given)[0]
    last = [np.bincount(each.point, each.last_height, 200) for each in (spans, without)]
    assert last[0] - last[1] == pytest.approx(np.where(point % 2, 1, 2) * 2.0**-10, abs=4 * QUANTUM)


def test_carves_far_apart_in_place_or_time_are_worked_out_on_their_own():
    rng = np.random.default_rng(5)
    near = [carved(0, 10, rng), carved(20, 14, rng), carved(10, 12, rng, contact=1)]
    far = [carved(0, 900, rng), carved(400, 910, rng)]
    assert carves_together([*near, *far]) == [[0, 1], [2], [3], [4]]
