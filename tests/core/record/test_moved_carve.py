"""A carve goes where its step goes: nothing of it is lost, level floors stay level."""

import numpy as np
import pytest

from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.record.edits import UNCHANGED, StepEdit
from softground_addon.core.record.footprints import FootprintRecorder, quantised, recompose
from softground_addon.core.record.moved_carve import moved_carve

CELL, PIVOT = 0.01, np.array([0.3, 0.25, 0.0])


@pytest.fixture(scope="module")
def carve():
    """A hole of 20 by 12 cm, 30 cm deep, that is cut in two frames, and loose matter beside it that slides."""
    recorder, hole = FootprintRecorder(CELL, 1.0), Window(20, 20, 20, 12)
    for frame, (cut, loose) in {10.0: (0.2, 0.0), 11.0: (0.1, 0.0)}.items():
        change = quantised(np.stack([np.full((12, 20), cut), np.full((12, 20), loose)]))
        recorder.add(frame, hole, change, np.zeros((12, 20), bool))
    for frame, by in ((11.0, 0.02), (14.0, -0.0073)):
        lying = quantised(np.stack([np.zeros((12, 5)), np.full((12, 5), by)]))
        recorder.add(frame, Window(41, 20, 5, 12), lying, np.zeros((12, 5), bool))
    volumes = {"compressed_m3": 240 * 0.3 * CELL**2, "rim_m3": 60 * 0.0127 * CELL**2, "unplaced_rim_m3": 0.0}
    span = {"character": "Walker", "sole": "foot.L", "start_frame": 10.0, "end_frame": 14.0, "heading": 0.0}
    arrays = {"position": PIVOT, "load_frames": np.zeros(0), "load_n": np.zeros(0)}
    return recorder.footprint(**span, **volumes, **arrays, area_m2=0.0, peak_force_n=0.0)


def volumes(footprint, frame=np.inf):
    ways = (footprint.compression, footprint.rim)
    return np.array([footprint.tile(changes, frame).sum() for changes in ways]) * CELL**2


@pytest.mark.parametrize(
    ("edit", "larger"),
    [
        (StepEdit(move_m=(0.1234, -0.0567)), 1.0),
        (StepEdit(turn_deg=37.0, move_m=(0.05, 0.02)), 1.0),
        (StepEdit(scale=1.3, turn_deg=-12.0), 1.69),
        (StepEdit(scale=0.6), 0.36),
    ],
)
def test_its_volumes_go_along_and_its_floor_stays_level(carve, edit, larger):
    moved = moved_carve(carve, PIVOT, UNCHANGED, edit)
    assert volumes(moved) == pytest.approx(larger * volumes(carve), rel=1e-6)
    assert [moved.compressed_m3, moved.rim_m3] == pytest.approx(volumes(moved), rel=1e-6)
    depth = moved.tile(moved.compression)
    assert depth.max() == pytest.approx(0.3, rel=0.03)  # the outline falls between cells
    assert np.median(depth[depth > 0.01]) == pytest.approx(depth.max(), rel=1e-6)


def test_it_goes_where_its_step_goes(carve):
    moved = moved_carve(carve, PIVOT, UNCHANGED, StepEdit(move_m=(0.2, 0.1), turn_deg=90.0))
    ground = recompose([moved])
    compression, rim = ground.nearest(*(PIVOT[:2] + (0.2, 0.1) + [(0.0, 0.08), (0.0, 0.14)]).T)
    assert compression == pytest.approx([0.3, 0.0], rel=0.02)
    assert rim[1] == pytest.approx(0.0127, rel=0.05)


def test_whole_cells_and_whole_frames_are_exact(carve):
    moved = moved_carve(carve, PIVOT, UNCHANGED, StepEdit(move_m=(0.07, -0.03), shift_frames=5))
    before, after = recompose([carve], 11.5), recompose([moved], 16.5)
    x, y = np.random.default_rng(0).uniform(0.0, 0.6, (2, 500))
    assert after.nearest(x + 0.07, y - 0.03) == pytest.approx(before.nearest(x, y), abs=1e-8)


def test_it_is_untouched_where_its_step_is_as_when_it_was_baked(carve):
    edit = StepEdit(move_m=(0.1, 0.0), strength=2.0)
    assert moved_carve(carve, PIVOT, edit, StepEdit(move_m=(0.1, 0.0))) is carve
    moved = moved_carve(carve, PIVOT, UNCHANGED, edit)
    back = moved_carve(moved, PIVOT, edit, UNCHANGED)
    x, y = np.random.default_rng(0).uniform(0.0, 0.6, (2, 500))
    assert recompose([back]).nearest(x, y) == pytest.approx(recompose([carve]).nearest(x, y), abs=1e-8)
