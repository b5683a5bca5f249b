"""The record as ramps and contacts, against the record put together frame by frame."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.playback.ramps import QUANTUM, TOLERANCE
from softground_addon.core.playback.vertex_histories import CARVED_TOLERANCE, SHADING_TOLERANCE, vertex_histories
from softground_addon.core.record.footprints import FootprintRecorder, quantised
from softground_addon.core.record.pressed_ground import PressedGround
from tests.core.walkers import box_sole, loads_of, pose, pressed, standing, walk

SNOW = GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005)
SAND = GroundMaterial(330e3, 0.45, 0.1, blur_sigma=0.01)


def places_around(footprints, count, seed=0):
    """Random places over and around the footprints."""
    low = np.min([print_.position[:2] for print_ in footprints], axis=0) - 0.4
    high = np.max([print_.position[:2] for print_ in footprints], axis=0) + 0.4
    return np.random.default_rng(seed).uniform(low, high, (count, 2)).T


def shown(footprints, frame, material, x, y, cell_size=0.01):
    """Displayed height, compression and age at a frame, by recomposing and blurring the whole ground."""
    ground = PressedGround.at(
        footprints, frame=frame, frame_rate=30.0, cell_size=cell_size, blur_sigma=material.blur_sigma
    )
    return ground.sample(x, y)


def largest_difference(footprints, material, frames, x, y):
    result = vertex_histories(footprints, x, y, blur_sigma=material.blur_sigma)
    height = compression = 0.0
    for frame in frames:
        sample = shown(footprints, frame, material, x, y)
        shown_height, shown_compression = result.movement.at(frame, len(x)).T
        height = max(height, np.abs(shown_height - sample.display).max())
        compression = max(compression, np.abs(shown_compression - sample.compression).max())
    return height, compression, result.error


@pytest.mark.parametrize("material", [SNOW, SAND])
def test_heights_are_those_of_the_record_within_the_tolerance_at_any_frame(material):
    _, footprints = pressed(walk(steps=4), material)
    x, y = places_around(footprints, 4000)
    frames = [*range(1, 91, 4), 17.3, 33.5, 61.25]
    height, compression, error = largest_difference(footprints, material, frames, x, y)
    assert height <= error <= TOLERANCE * 1.001
    assert compression <= SHADING_TOLERANCE


def test_the_end_is_exact_to_rounding():
    _, footprints = pressed(walk(steps=6), SNOW)
    x, y = places_around(footprints, 4000)
    height, compression, _ = largest_difference(footprints, SNOW, [1.0, 500.0], x, y)
    assert max(height, compression) <= 4 * QUANTUM  # half a quantum for each footprint that reaches a place


@settings(max_examples=6)
@given(st.integers(0, 2**16), st.sampled_from([24.0, 30.0, 60.0]))
def test_crossing_trails_share_the_tolerance(seed, frame_rate):
    rng = np.random.default_rng(seed)
    trails = [
        walk(
            steps=3,
            frame_rate=frame_rate,
            heading=rng.uniform(-np.pi, np.pi),
            origin=(*rng.uniform(-0.3, 0.3, 2), 0.0),
            name=f"walker {number}",
        )
        for number in range(3)
    ]
    _, footprints = pressed(trails, SAND)
    x, y = places_around(footprints, 1500, seed)
    frames = rng.uniform(1, 80, 12)
    height, _, error = largest_difference(footprints, SAND, frames, x, y)
    assert height <= error <= TOLERANCE * 1.001


def test_a_sole_dragged_over_many_blocks_is_followed():
    count = 241
    path = np.stack([np.linspace(0, 3.0, count), np.zeros(count), np.zeros(count)], axis=-1)
    sole = box_sole(0.2, 0.08)
    loads = loads_of([sole], [pose(path)[:, None]], np.full((count, 1), 400.0), np.ones((count, 1), bool), 30.0)
    _, footprints = pressed(loads, SNOW)
    x, y = places_around(footprints, 3000)
    x = x * 4
    height, _, error = largest_difference(footprints, SNOW, [1, 10, 20.5, 33, 47, 61], x, y)
    assert height <= error <= TOLERANCE * 1.001


def test_contacts_tell_the_age_of_every_place():
    _, footprints = pressed(walk(steps=4), SNOW)
    x, y = places_around(footprints, 3000)
    contacts = vertex_histories(footprints, x, y, blur_sigma=SNOW.blur_sigma).contacts
    for frame in (1.0, 22.0, 40.0, 63.0, 90.0):
        latest = np.full(len(x), -np.inf)
        begun = contacts.start <= frame
        np.maximum.at(latest, contacts.point[begun], np.minimum(contacts.end[begun], frame))
        age = np.where(np.isfinite(latest), (frame - latest) / 30.0, -1.0)
        np.testing.assert_allclose(age, shown(footprints, frame, SNOW, x, y).age, atol=1e-9)


def test_pressure_is_the_peak_force_over_the_area():
    _, footprints = pressed(standing(box_sole(0.2, 0.1), [0.0, 0.0, 0.0], 400.0), SNOW)
    contacts = vertex_histories(footprints, np.zeros(1), np.zeros(1), blur_sigma=0.005).contacts
    assert contacts.pressure == pytest.approx([400.0 / 0.02], rel=0.05)


def test_untouched_places_have_no_history():
    _, footprints = pressed(walk(steps=2), SNOW)
    result = vertex_histories(footprints, np.array([50.0, -50.0]), np.array([0.0, 7.0]), blur_sigma=0.005)
    assert not len(result.movement.point)
    assert not len(result.contacts.point)
    assert result.error == 0.0


def test_a_bake_without_footprints_has_no_history():
    result = vertex_histories([], np.zeros(3), np.zeros(3), blur_sigma=0.005)
    assert result.movement.at(5.0, 3).tolist() == [[0.0, 0.0]] * 3


def test_carved_ground_is_at_rest_once_it_hardly_moves_any_more():
    carve, window = FootprintRecorder(0.01, 1.0), Window(0, 0, 12, 9)
    for frame, (cut, loose) in {10: (0.1, 0.01), 14: (0.1, 0.0), 30: (0.0, 0.002), 45: (0.001, -0.001)}.items():
        change = quantised(np.stack([np.full((9, 12), cut), np.full((9, 12), loose)]))
        carve.add(float(frame), window, change, np.zeros((9, 12), bool))
    nothing = np.zeros(0)
    footprint = carve.footprint(
        **{
            "character": "",
            "sole": "",
            "start_frame": 10.0,
            "end_frame": 45.0,
            "position": np.zeros(3),
            "heading": 0.0,
        },
        **dict.fromkeys(("area_m2", "peak_force_n", "compressed_m3", "rim_m3", "unplaced_rim_m3"), 0.0),
        **{"load_frames": nothing, "load_n": nothing},
    )
    x, y = np.random.default_rng(0).uniform((-0.02, -0.02), (0.14, 0.11), (300, 2)).T
    height, compression, error = largest_difference([footprint], SNOW, np.arange(8.0, 50.0, 0.5), x, y)
    assert height <= error * 1.001 <= CARVED_TOLERANCE * 1.001
    assert compression <= CARVED_TOLERANCE
    movement = vertex_histories([footprint], x, y, blur_sigma=SNOW.blur_sigma).movement
    assert movement.end.max() == 14.0
    shown_last, last = movement.at(50.0, len(x)).T, shown([footprint], 50.0, SNOW, x, y)
    assert shown_last == pytest.approx(np.array([last.display, last.compression]), abs=2 * QUANTUM)
