"""The record: the ground at any frame from its footprints alone."""

import tracemalloc
import zlib
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.record.footprint_arrays import from_arrays, to_parts
from softground_addon.core.record.footprints import (
    LARGEST_AMOUNT,
    QUANTUM,
    FootprintRecorder,
    last_contact,
    recompose,
)
from softground_addon.core.record.pressed_ground import PressedGround, sample_at
from tests.core.walkers import box_sole, loads_of, pose, pressed, walk

MUD = GroundMaterial(0.3e6, 0.35, 0.15)
EVERYWHERE = Window(-40, -60, 400, 220)


def overlapping_walks():
    """Two characters whose trails cross, and one who treads on the spot."""
    count = 4 * 80 + 1
    phase = np.arange(count) % 60
    touching = (phase < 45)[:, None]
    force = np.where(touching, 200.0 + 3.0 * np.arange(count)[:, None], 0.0)
    sole = box_sole(0.3, 0.12)
    treading = loads_of([sole], [np.tile(pose((0.6, 0.1, 0), 0.3), (count, 1, 1, 1))], force, touching, 30.0)
    return [walk(steps=4), walk(steps=4, heading=0.4, origin=(0.1, -0.3, 0), name="other"), treading]


@pytest.fixture(scope="module")
def bake():
    """State at every frame and the record of walks that overlap."""
    states, footprints = {}, []
    for result in simulate(overlapping_walks(), SoftGround(FlatTerrain(), MUD), 0.01):
        states[result.frame] = result.ground.read(EVERYWHERE)
        footprints += result.footprints
    return states, footprints


def test_the_ground_recomposed_at_random_frames_in_random_order_is_the_simulations(bake):
    states, footprints = bake
    rng = np.random.default_rng(3)
    assert len(footprints) == 14
    for frame in rng.permutation(list(states)):
        shuffled = [footprints[i] for i in rng.permutation(len(footprints))]
        ground = recompose(shuffled, frame)
        assert np.abs(ground.read(EVERYWHERE) - states[frame]).max() <= QUANTUM / 2 + 1e-15
        heights = [(1.0 + state[1] - state[0]).astype(np.float32) for state in (ground.read(EVERYWHERE), states[frame])]
        assert (np.abs(heights[0] - heights[1]) <= np.spacing(heights[0])).all()


def test_the_order_of_the_footprints_changes_no_bit(bake):
    _, footprints = bake
    for frame in (20.0, 33.3, 200.0):
        first, other = recompose(footprints, frame), recompose(footprints[::-1], frame)
        assert np.array_equal(first.read(EVERYWHERE), other.read(EVERYWHERE))


def test_between_frames_the_ground_moves_in_a_straight_line(bake):
    states, footprints = bake
    for frame, part in ((12, 0.25), (30, 0.5), (41, 0.9)):
        expected = (1 - part) * states[frame] + part * states[frame + 1]
        assert np.abs(recompose(footprints, frame + part).read(EVERYWHERE) - expected).max() < 1e-7


def test_before_the_first_frame_there_is_nothing_and_after_the_last_all(bake):
    states, footprints = bake
    assert not recompose(footprints, -10.0).tiles
    assert np.abs(recompose(footprints).read(EVERYWHERE) - states[max(states)]).max() < QUANTUM


def test_the_volumes_of_the_footprints_add_up_to_those_of_the_ground(bake):
    _, footprints = bake
    compressed, rim = recompose(footprints).volumes()
    assert sum(footprint.compressed_m3 for footprint in footprints) == pytest.approx(compressed, rel=1e-6)
    assert sum(footprint.rim_m3 for footprint in footprints) == pytest.approx(rim, rel=1e-6)
    assert rim == pytest.approx(0.7 * compressed, rel=1e-6)
    for footprint in footprints:
        cell_area = footprint.cell_size**2
        assert footprint.tile(footprint.compression).sum() * cell_area == pytest.approx(
            footprint.compressed_m3, rel=1e-5
        )


def test_contact_times_are_those_of_the_simulation():
    # One foot that stands from frame 6 to 16 and another that stands from 21 to the end.
    touching = np.zeros((4 * 30 + 1, 2), bool)
    touching[20:61, 0] = touching[80:, 1] = True
    transforms = [np.tile(pose((x, 0, 0)), (len(touching), 1, 1, 1)) for x in (0.0, 1.0)]
    sole = box_sole(0.2, 0.1)
    _, footprints = pressed(loads_of([sole, sole], transforms, 500.0 * touching, touching, 30.0), MUD)
    x, y = np.array([0.0, 0.15, 1.0]), np.zeros(3)

    def last(frame):
        return last_contact(footprints, frame, 0.01).nearest(x, y)[0].tolist()

    assert last(5.0) == [-np.inf, -np.inf, -np.inf]
    assert last(10.5) == [10.5, -np.inf, -np.inf]
    assert last(19.0) == [16.0, -np.inf, -np.inf]
    assert last(25.0) == [16.0, -np.inf, 25.0]
    assert last(99.0) == [16.0, -np.inf, 31.0]


def test_contact_lasts_after_the_ground_has_stopped_giving_way():
    count = 4 * 60 + 1
    touching = np.ones((count, 1), bool)
    sole = box_sole(0.2, 0.1)
    loads = loads_of([sole], [np.tile(pose((0, 0, 0)), (count, 1, 1, 1))], 500.0 * touching, touching, 30.0)
    _, (footprint,) = pressed(loads, MUD)
    assert footprint.compression.frames[-1] < 10
    assert last_contact([footprint], 60.0, 0.01).nearest(np.zeros(1), np.zeros(1))[0] == 60.0


def same(first, other):
    for field in fields(first):
        a, b = getattr(first, field.name), getattr(other, field.name)
        if is_dataclass(a):
            same(a, b)
        elif isinstance(a, np.ndarray):
            assert np.array_equal(a, b)
            assert a.dtype == b.dtype
        elif isinstance(a, tuple) and a and is_dataclass(a[0]):
            for pair in zip(a, b, strict=True):
                same(*pair)
        else:
            assert a == b


def to_arrays(footprints):
    """The record as it is stored: each array in one piece."""
    names, soles, arrays = to_parts(footprints)
    return (
        names,
        soles,
        {
            key: np.concatenate([np.zeros(0, array.kind), *array.parts]).astype(array.kind)
            for key, array in arrays.items()
        },
    )


def test_the_record_comes_back_from_flat_arrays_as_it_went_in(bake):
    _, footprints = bake
    for restored, original in zip(from_arrays(*to_arrays(footprints)), footprints, strict=True):
        same(restored, original)
    assert from_arrays(*to_arrays([])) == []


def test_the_record_takes_below_fifteen_kilobytes_a_step(bake):
    _, footprints = bake
    for material in (MUD, GroundMaterial(0.25e6, 0.05, 0.2), GroundMaterial(2.25e6, 0.5, 0.05)):
        _, footprints = pressed(walk(steps=4, heading=0.6), material)
        _, _, arrays = to_arrays(footprints)
        assert sum(len(zlib.compress(values.tobytes())) for values in arrays.values()) < 15_000 * len(footprints)


def test_looked_up_part_by_part_the_ground_is_the_same(bake, monkeypatch):
    _, footprints = bake
    x, y = np.random.default_rng(8).uniform((-0.5, -0.7), (3.8, 1.7), (5000, 2)).T
    when = {"frame": 60.5, "frame_rate": 30.0, "cell_size": 0.01, "blur_sigma": 0.006}
    whole = PressedGround.at(footprints, **when).sample(x, y)
    assert (whole.raw != 0).sum() > 200
    monkeypatch.setattr("softground_addon.core.record.pressed_ground.PART", 300)
    parts = sample_at(footprints, x, y, **when)
    for field in fields(whole):
        np.testing.assert_array_equal(getattr(parts, field.name), getattr(whole, field.name))
    nowhere = sample_at(footprints, x[:0], y[:0], **when)
    assert len(nowhere.raw) == len(nowhere.age) == 0


def test_footprints_take_less_than_half_the_memory_of_their_arrays(bake):
    _, footprints = bake
    tracemalloc.start()
    try:
        copies = [replace(footprint) for footprint in footprints]
        taken = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    arrays = to_arrays(copies)[2].values()
    assert taken < sum(values.nbytes for values in arrays) / 2


@pytest.mark.parametrize("damage", ["cut", "longer", "missing", "names", "nan"])
@pytest.mark.parametrize("key", sorted(to_parts([])[2]))
def test_a_record_that_was_cut_short_or_edited_is_refused_with_a_remedy(bake, key, damage):
    names, soles, arrays = to_arrays(bake[1][:4])
    if damage == "cut":
        arrays[key] = arrays[key][: len(arrays[key]) // 2]
    elif damage == "longer":
        arrays[key] = np.concatenate([arrays[key], arrays[key][-1:]])
    elif damage == "missing":
        del arrays[key]
    elif damage == "names":
        names = names[:-1]
    else:
        arrays[key] = np.full(len(arrays[key]), np.nan)
    with pytest.raises(InputError, match="bake again"):
        from_arrays(names, soles, arrays)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("compression.cells", 2**30),
        ("rim.cells", -1),
        ("contact_cells", 2**30),
        ("compression.first", -5),
        ("compression.frames", 1e9),
        ("window", 0),
        ("window", 2**31 - 1),
        ("load_n.count", -1),
    ],
)
def test_a_record_with_one_impossible_number_is_refused(bake, key, value):
    names, soles, arrays = to_arrays(bake[1][:4])
    arrays[key] = arrays[key].copy()
    arrays[key][2] = value
    with pytest.raises(InputError, match="bake again"):
        from_arrays(names, soles, arrays)


@pytest.mark.parametrize(
    ("name", "value"),
    [("cell_size", value) for value in (1e-7, 0.0, -0.01, 100.0)]
    + [("frame_step", value) for value in (0.0, -1.0, 1e-9, 1e6)]
    + [("start_frame", -1e9), ("end_frame", 1e9), ("area_m2", -1.0), ("peak_force_n", 1e300)],
)
def test_a_record_whose_numbers_are_far_from_what_they_can_be_is_refused(bake, name, value):
    names, soles, arrays = to_arrays([replace(each, **{name: value}) for each in bake[1][:4]])
    with pytest.raises(InputError, match=rf"{name} is .*bake again"):
        from_arrays(names, soles, arrays)


def test_footprints_of_different_cell_sizes_are_refused_and_none_need_a_size(bake):
    _, footprints = bake
    with pytest.raises(InputError, match="bake them again at one cell size"):
        recompose([footprints[0], replace(footprints[1], cell_size=0.02)])
    with pytest.raises(InputError):
        recompose([])
    assert not recompose([], cell_size=0.01).tiles


def test_a_change_too_large_for_one_whole_number_is_recorded_in_parts():
    recorder = FootprintRecorder(1.0, 1.0)
    change = np.zeros((2, 1, 2), np.int64)
    change[0, 0, 1], change[1, 0, 0] = 5 * LARGEST_AMOUNT // 2, LARGEST_AMOUNT
    recorder.add(3.0, Window(7, -2, 2, 1), change, np.array([[False, True]]))
    what = {
        "character": "giant", "sole": "foot", "start_frame": 3.0, "end_frame": 3.0, "position": np.zeros(3),
        "heading": 0.0, "area_m2": 1.0, "peak_force_n": 1.0, "compressed_m3": 0.0, "rim_m3": 0.0,
        "unplaced_rim_m3": 0.0, "load_frames": np.zeros(1), "load_n": np.zeros(1),
    }  # fmt: skip
    footprint = recorder.footprint(**what)
    assert recompose([footprint], 3.0).read(Window(7, -2, 2, 1)) == pytest.approx(change * QUANTUM)
    assert recompose([footprint], 2.5).read(Window(7, -2, 2, 1)) == pytest.approx(change * QUANTUM / 2)
    assert len(footprint.contact_cells) == 1
