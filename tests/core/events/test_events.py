"""The events of a bake: the phases of a walk in closed form, of slides, jumps and balls, and of measured gaits."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.debris.step_throws import throws_of
from softground_addon.core.events.events import COLUMNS, as_edited, between, events
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.record.edits import UNCHANGED, StepEdit, step_id
from softground_addon.core.record.footprints import FootprintRecorder, quantised
from softground_addon.core.record.moved_carve import moved_carve
from softground_addon.core.record.record import BakeRecord
from tests.core.walkers import GRAVITY, MASS, foot_sole, loads_of, pose, pressed, walk

SNOW = GroundMaterial(youngs_modulus=0.25e6, poisson_ratio=0.05, characteristic_time=0.2)
PERIOD = 1.1


@pytest.fixture(scope="module")
def baked():
    loads = walk(steps=4, period=PERIOD)
    loads = replace(loads, contacts=replace(loads.contacts, clearance=loads.contacts.clearance + 0.03))
    return loads, pressed(loads, SNOW, cell_size=0.02)[1]


@pytest.fixture(scope="module")
def table(baked):
    loads, footprints = baked
    return events([loads], footprints, surface="snow", first_frame=1.0)


def of(table, phase, contact="foot.L"):
    return [row for row in table if row["phase"] == phase and row["contact"] == contact]


def test_a_walk_strikes_rolls_and_leaves_when_its_closed_form_says(baked, table):
    """Toes come down from 20 degrees over 0.15 of a stance; the heel rises to 35 over its last 0.4: flat is below 5."""
    step, stance = baked[0].motion.time_step, 0.62 * PERIOD
    assert all(set(row) == set(COLUMNS) for row in table)
    strikes = of(table, "heel_strike")
    assert [row["time_s"] for row in strikes] == pytest.approx([0.1, 0.1 + PERIOD], abs=step)
    for phase, part in (("foot_flat", 0.15 * 15 / 20), ("heel_off", 0.6 + 0.4 * 5 / 35), ("toe_off", 1.0)):
        times = [row["time_s"] for row in of(table, phase)]
        assert times == pytest.approx([row["time_s"] + part * stance for row in strikes], abs=1.5 * step)
    assert [row["duration_s"] for row in strikes] == pytest.approx([stance] * 2, abs=step)


def test_forces_areas_and_depths_are_those_of_the_steps(baked, table):
    loads, footprints = baked
    steps = {step_id(footprint): footprint for footprint in footprints}
    for row in table:
        assert row["area_m2"] == pytest.approx(steps[row["step"]].area_m2, abs=1e-6)
        assert row["depth_m"] == pytest.approx(steps[row["step"]].max_depth_m, abs=1e-6)
        assert row["peak_bw"] == pytest.approx(row["peak_force_n"] / (MASS * GRAVITY), abs=1e-4)
    for name, step in steps.items():
        rows = [row for row in table if row["step"] == name and row["phase"] not in ("toe_off",)]
        assert max(row["peak_force_n"] for row in rows) == pytest.approx(step.peak_force_n, abs=0.006)
        impulse = step.load_n.sum() * loads.motion.time_step
        assert sum(row["impulse_ns"] for row in rows) == pytest.approx(impulse, rel=1e-3)


def test_a_contact_that_is_there_from_the_start_has_not_landed():
    loads = walk(steps=4)
    begun = slice(40, None)
    motion = loads.motion.of(begun)
    cut = replace(loads, motion=motion, contacts=loads.contacts.during(begun), forces=loads.forces.during(begun))
    rows = events([cut], [], surface="snow", first_frame=motion.frames[0])
    assert rows[0]["phase"] not in ("heel_strike", "land")
    assert rows[0]["time_s"] > 0


def on_hard(loads):
    """The same loads, with the left foot's contacts on a hard floor, as `loads.missing_ground` says it."""
    hard = loads.contacts.touching & np.array([sole.sole.side == "L" for sole in loads.motion.soles])
    return replace(loads, contacts=replace(loads.contacts, touching=loads.contacts.touching & ~hard, hard=hard))


def test_a_step_on_a_hard_floor_has_the_events_of_one_on_soft_ground_and_no_print(baked, table):
    loads, footprints = baked
    pressed_ones = [step for step in footprints if step.sole == "foot.R"]
    rows = events([on_hard(loads)], pressed_ones, surface="snow", first_frame=1.0)
    same = ("time_s", "contact", "phase", "side", "position", "peak_force_n", "impulse_ns", "duration_s")
    assert [[row[name] for name in same] for row in rows] == [[row[name] for name in same] for row in table]
    for row, soft in zip(rows, table, strict=True):
        if row["contact"] == "foot.L":
            assert (row["step"], row["depth_m"], row["area_m2"], row["surface"]) == ("", 0.0, 0.0, "hard")
        else:
            assert row == soft


def test_a_hard_floor_throws_nothing(baked):
    loads, footprints = baked
    throws = throws_of([on_hard(loads)], footprints, surface="snow")
    assert throws
    assert {footprints[throw.number].sole for throw in throws} == {"foot.R"}


def test_a_foot_that_brushes_the_ground_as_it_swings_scuffs():
    loads = walk(steps=4, period=PERIOD)
    time = loads.motion.times
    clearance = np.repeat((0.03 * np.abs(time - 1.0) / 0.1)[:, None], 2, axis=1)
    brushed = replace(loads, contacts=replace(loads.contacts, clearance=clearance))
    (scuff,) = [row for row in events([brushed], [], surface="snow", first_frame=1.0) if row["phase"] == "scuff"]
    assert scuff["contact"] == "foot.L"
    assert scuff["time_s"] == pytest.approx(1.0, abs=0.01)
    assert scuff["slide_speed"] > 1.0


def standing_feet(path, touching):
    """Both feet flat on a path of places (N, 3), in contact where told."""
    soles = [foot_sole("foot.L", "L"), foot_sole("foot.R", "R")]
    poses = [np.repeat(pose(path + np.array([0, y, 0]))[:, None], 2, axis=1) for y in (0.1, -0.1)]
    force = np.where(touching, MASS * GRAVITY / 2, 0.0)[:, None].repeat(2, 1)
    return loads_of(soles, poses, force, touching[:, None].repeat(2, 1), 120.0)


def test_feet_that_slide_while_they_stand_tell_so():
    time = np.arange(241) / 120
    x = np.interp(time, [0.5, 1.0], [0.0, 1.0])  # 2 m/s for half a second
    path = np.stack([x, 0 * x, 0 * x], -1)
    rows = events([standing_feet(path, time >= 0)], [], surface="sand", first_frame=1.0)
    start, end = of(rows, "slide_start")[0], of(rows, "slide_end")[0]
    assert (start["time_s"], end["time_s"]) == pytest.approx((0.5, 1.0), abs=0.02)
    assert start["slide_speed"] == pytest.approx(2.0, rel=1e-3)


def test_both_feet_out_of_a_jump_land_at_the_speed_of_the_fall():
    time = np.arange(121) / 120
    height = np.where(time < 0.6, GRAVITY / 2 * (0.6**2 - np.minimum(time, 0.6) ** 2), 0.0)
    path = np.stack([0 * time, 0 * time, height], -1)
    rows = events([standing_feet(path, time >= 0.6)], [], surface="sand", first_frame=1.0)
    assert {row["phase"] for row in rows if row["time_s"] < 0.62} == {"land"}
    for row in rows:
        if row["phase"] == "land":
            assert row["landing_speed"] == pytest.approx(GRAVITY * 0.6, rel=0.02)


def test_muted_steps_have_no_events_and_moved_ones_take_them_along(baked, table):
    _, footprints = baked
    muted, moved = map(step_id, footprints[:2])
    elsewhere = replace(footprints[1], position=footprints[1].position + np.array([1, 2, 0]))
    record = BakeRecord(footprints, {}, {muted: StepEdit(mute=True), moved: StepEdit(turn_deg=1.0)}, {1: elsewhere})
    rows = as_edited(table, record.steps)
    assert {row["step"] for row in rows} == {step_id(footprint) for footprint in footprints[1:]}
    for before, after in zip(
        [row for row in table if row["step"] == moved], [row for row in rows if row["step"] == moved], strict=True
    ):
        assert np.subtract(after["position"], before["position"]) == pytest.approx([1, 2, 0], abs=2e-5)


def test_a_copy_has_the_events_of_its_step_when_it_presses(baked, table):
    _, footprints = baked
    count, footprint = len(footprints), footprints[1]
    later = replace(footprint, start_frame=footprint.start_frame + 6, end_frame=footprint.end_frame + 6)
    record = BakeRecord(footprints, {}, {step_id(footprint, 1): StepEdit(shift_frames=6)}, {1 + count: later})
    rows = as_edited(table, record.steps)
    of_step, of_copy = ([row for row in rows if row["step"] == step_id(footprint, copy)] for copy in (0, 1))
    assert [row for row in rows if row["step"] != step_id(footprint, 1)] == table
    assert [row["phase"] for row in of_copy] == [row["phase"] for row in of_step] != []
    assert [row["frame"] - 6 for row in of_copy] == pytest.approx([row["frame"] for row in of_step], abs=1e-5)
    assert [row["time_s"] - 6 / 30 for row in of_copy] == pytest.approx([row["time_s"] for row in of_step], abs=1e-5)
    assert rows == sorted(rows, key=lambda row: row["frame"])


@pytest.mark.parametrize(("filled", "scale", "wades"), [(0.0, 1.0, True), (0.3, 1.0, False), (0.0, 0.1, False)])
def test_a_cut_of_which_nothing_is_left_is_no_wading(baked, table, filled, scale, wades):
    """A sole has pressed it level since, or the step is so small now that no cell shows it."""
    footprints = baked[1]
    recorder, cell = FootprintRecorder(0.02, 1.0), Window(20, 20, 1, 1)
    for frame, cut in ((10.0, 0.3), (20.0, -filled)):
        recorder.add(frame, cell, quantised(np.array([[[cut]], [[0.0]]])), np.zeros((1, 1), bool))
    span = {"character": "Walker", "sole": "foot.L", "start_frame": 10.0, "end_frame": 20.0, "heading": 0.0}
    volumes = {"compressed_m3": 0.3 * 0.02**2, "rim_m3": 0.0, "unplaced_rim_m3": 0.0}
    arrays = {"position": footprints[0].position, "load_frames": np.zeros(0), "load_n": np.zeros(0)}
    carve = recorder.footprint(**span, **volumes, **arrays, area_m2=0.0, peak_force_n=0.0)
    carve = moved_carve(carve, np.array([0.41, 0.414, 0.0]) + 0.03, UNCHANGED, StepEdit(scale=scale))
    rows = as_edited(table, BakeRecord(footprints, {}).steps, {0: carve})
    assert ([row["phase"] for row in rows if row["phase"] == "wade"] == ["wade"]) == wades
    assert all(np.isfinite(row["position"]).all() for row in rows)


def test_times_count_from_the_first_frame_that_is_asked_for(table):
    later = between(table, 20, 40, 30.0)
    assert later
    assert all(row["time_s"] == pytest.approx((row["frame"] - 20) / 30, abs=2e-6) for row in later)
