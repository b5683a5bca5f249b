"""The events of a bake in Blender: in the report, in exported files, as points and as markers."""

import csv
import json

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import baked_ground
from tests.blender import shots


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    """A walk of two seconds, baked and saved, and its report."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    result = jobs.run(bake_job.bake(scene))
    path = tmp_path_factory.mktemp("events") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path, result.report


@pytest.fixture
def scene(baked):
    bpy.ops.wm.open_mainfile(filepath=str(baked[0]))
    return bpy.context.scene


def test_the_report_and_the_record_have_the_same_events(baked, scene):
    table = baked_ground.events_of(scene.softground.ground)
    assert json.loads(json.dumps(baked[1]["events"])) == table
    steps = {step["id"]: step for step in baked[1]["steps"]}
    strikes = [row for row in table if row["phase"] == "heel_strike"]
    assert len(strikes) >= 2
    for row in strikes:
        assert row["frame"] == pytest.approx(steps[row["step"]]["frame_start"], abs=0.5)  # from where it is loaded
        assert row["peak_force_n"] <= steps[row["step"]]["peak_force_n"] + 1e-6


@pytest.mark.parametrize("kind", ["events-json", "events-midi", "events-reaper", "events-edl", "events-otio"])
def test_the_command_line_writes_every_format(baked, tmp_path, kind, capsys):
    target = tmp_path / "out"
    assert cli.run_standalone(["export", str(baked[0]), "--format", kind, "--output", str(target)]) == 0
    (written,) = tmp_path.iterdir()
    assert str(written) in capsys.readouterr().out
    strikes = sum(row["phase"] == "heel_strike" for row in baked[1]["events"])
    if kind == "events-reaper":
        rows = list(csv.DictReader(written.open(encoding="utf-8")))
        assert sum(row["#"].startswith("R") for row in rows) == strikes
    elif kind != "events-midi":
        text = written.read_text(encoding="utf-8").replace("heel_strike", "heel strike")
        assert text.count("heel strike") >= strikes


def test_frames_that_are_asked_for_cut_the_events(scene, tmp_path):
    path = tmp_path / "part.jsonl"
    bpy.ops.softground.export(filepath=str(path), format="EVENTS_JSON", frame_start=20, frame_end=40)
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    assert rows
    assert all(20 <= row["frame"] <= 40 for row in rows)
    assert rows[0]["time_s"] == pytest.approx((rows[0]["frame"] - 20) / 24, abs=1e-5)


def test_events_are_points_with_attributes(scene):
    table = baked_ground.events_of(scene.softground.ground)
    for _ in range(2):  # the second takes the place of the first
        assert bpy.ops.softground.event_points() == {"FINISHED"}
    (points,) = [obj for obj in scene.objects if obj.name.startswith("SoftGround Events")]
    place = np.empty(3 * len(table), np.float32)
    points.data.vertices.foreach_get("co", place)
    assert place.reshape(-1, 3) == pytest.approx(np.array([row["position"] for row in table]), abs=1e-5)
    attributes = points.data.attributes
    for name in ("frame", "peak_force_n", "depth_m"):
        values = [item.value for item in attributes[name].data]
        assert values == pytest.approx([row[name] for row in table], rel=1e-5)
    phases, contacts = points["phases"].split(", "), points["contacts"].split(", ")
    assert [phases[item.value] for item in attributes["phase"].data] == [row["phase"] for row in table]
    assert [contacts[item.value] for item in attributes["contact"].data] == [row["contact"] for row in table]


def test_markers_stand_at_strikes_and_leave_the_users_own(scene):
    scene.timeline_markers.new("mine", frame=7)
    for _ in range(2):
        assert bpy.ops.softground.event_markers(phases={"heel_strike"}) == {"FINISHED"}
    table = baked_ground.events_of(scene.softground.ground)
    wanted = sorted(round(row["frame"]) for row in table if row["phase"] == "heel_strike")
    assert sorted(marker.frame for marker in scene.timeline_markers if marker.name != "mine") == wanted
    assert scene.timeline_markers["mine"].frame == 7
