"""The command line: one shot in, a baked shot and a report out, and exit codes that a farm can trust."""

import contextlib
import io
import json
import os
import signal
import subprocess
import time

import bpy
import pytest

from softground_addon.blender.command_line import cli, cli_arguments
from softground_addon.blender.compat import action_curves, slot_of
from softground_addon.blender.ground import ground_mesh
from tests.blender import command_line, shots


def run(shot, *options):
    """Run the command in this process, with its file opened first, as `blender --command` does."""
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    return cli.run_in_blender(["bake", "--progress", "none", *map(str, options)])


@pytest.mark.slow
def test_it_sets_up_bakes_saves_and_reports_by_itself(shot, tmp_path):
    report, baked = tmp_path / "report.json", tmp_path / "baked.blend"
    original = shot.read_bytes()
    assert run(shot, "--preset", "dry_sand", "--report", report, "--save", baked) == 0
    content = json.loads(report.read_text(encoding="utf-8"))
    assert content["schema_version"] == 1
    assert content["inputs"]["preset"] == "Dry Sand"
    assert content["inputs"]["frames"] == [1, 40]
    assert len(content["steps"]) >= 3
    assert set(content["steps"][0]) == {
        "id", "contact", "character", "frame_start", "frame_end", "position", "area_m2", "peak_force_n", "max_depth_m",
        "compressed_m3", "rim_m3",
    }  # fmt: skip
    assert set(content["timings"]) == {"sample", "simulate", "write", "frames_per_second"}
    bpy.ops.wm.open_mainfile(filepath=str(baked))
    assert ground_mesh.is_baked(bpy.context.scene.softground.ground)
    assert shot.read_bytes() == original
    assert {path.name for path in tmp_path.iterdir()} == {"shot.blend", "baked.blend", "report.json"}


@pytest.mark.slow
def test_the_bpy_module_runs_the_same_command(shot, tmp_path):
    report = tmp_path / "report.json"
    assert run(shot, "--report", report) == 0
    here = json.loads(report.read_text(encoding="utf-8"))
    done = command_line.run("bake", shot, "--report", report)
    assert done.returncode == 0, done.stderr
    assert "steps, deepest" in done.stdout
    written = json.loads(report.read_text(encoding="utf-8"))
    assert here["steps"] == written["steps"]
    assert here["input_hash"] == written["input_hash"]


def test_options_reach_the_bake(shot, tmp_path):
    report = tmp_path / "report.json"
    options = ("--frames", "5-30", "--cell-size", "0.02", "--set", "material.youngs_modulus=5e5", "--report", report)
    assert run(shot, *options, "--set", "characters[0].mass=100", "--set", "keep_forces=true") == 0
    content = json.loads(report.read_text(encoding="utf-8"))
    assert content["inputs"]["frames"] == [5, 30]
    assert content["inputs"]["cell_size_m"] == pytest.approx(0.02)
    assert content["inputs"]["material"]["youngs_modulus"] == 5e5
    assert content["inputs"]["characters"][0]["mass_kg"] == 100
    assert content["forces"]["frames"] == list(range(5, 31))
    forces = content["forces"]["characters"]["Walker"]
    assert all(len(force) == 26 for force in forces.values())


@pytest.mark.parametrize("form", [("--frames", "-30--5"), ("--frames=-30--5",)])
def test_frames_may_be_negative(scene, tmp_path, form):
    armature = shots.walker(scene, frames=40)
    for curve in action_curves(armature.animation_data.action, slot_of(armature.animation_data)):
        for key in curve.keyframe_points:
            key.co_ui[0] -= 40
    shot, report = tmp_path / "shot.blend", tmp_path / "report.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    assert run(shot, *form, "--report", report, "--cell-size", "0.02") == 0
    content = json.loads(report.read_text(encoding="utf-8"))
    assert content["inputs"]["frames"] == [-30, -5]
    assert set(content["gaps_mm"]) == {"before", "after"}


def test_an_armature_that_stands_still_is_passed_over(scene, tmp_path):
    walker = shots.walker(scene, frames=30)
    still = shots.walker(scene, frames=30)
    still.animation_data_clear()
    path, report = tmp_path / "shot.blend", tmp_path / "report.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    name = walker.name
    assert run(path, "--report", report, "--cell-size", "0.02") == 0
    assert [c["armature"] for c in json.loads(report.read_text(encoding="utf-8"))["inputs"]["characters"]] == [name]


def test_in_place_replaces_the_opened_file_and_keeps_its_compression(shot):
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    bpy.ops.wm.save_as_mainfile(filepath=str(shot), compress=True)
    assert run(shot, "--in-place") == 0
    assert shot.read_bytes()[:7] != b"BLENDER"
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    assert ground_mesh.is_baked(bpy.context.scene.softground.ground)


def test_a_dry_run_saves_nothing(shot, tmp_path):
    original = shot.read_bytes()
    assert run(shot, "--dry-run", "--in-place", "--report", tmp_path / "report.json") == 0
    assert shot.read_bytes() == original
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["steps"]


def test_help_names_formats_as_they_are_written(capsys):
    with pytest.raises(SystemExit):
        cli_arguments.parse(["export", "--help"], standalone=True)
    printed = capsys.readouterr().out
    assert "events-json" in printed
    assert "EVENTS_JSON" not in printed
    assert (
        cli_arguments.parse(["export", "a.blend", "--format", "EVENTS_JSON"], standalone=True).format == "events-json"
    )


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), "Nothing would be kept"),
        (("--dry-run", "--scene", "Gone"), "no scene 'Gone'.*'Scene'"),
        (("--dry-run", "--preset", "lava"), "no preset 'lava'"),
        (("--dry-run", "--preset", "gone.json"), "gone.json"),
        (("--dry-run", "--frames", "all"), "not a frame range"),
        (("--dry-run", "--frames", "9-3"), "empty"),
        (("--dry-run", "--cell-size", "0"), "from 0.0001"),
        (("--dry-run", "--cell-size", "nan"), "from 0.0001"),
        (("--dry-run", "--set", "material.density=3"), "no setting 'material.density'.*youngs_modulus"),
        (("--dry-run", "--set", "material.youngs_modulus=soft"), "takes a number"),
        (("--dry-run", "--set", "characters[7].mass=3"), "no setting"),
        (("--dry-run", "--set", "characters[0].force_model=MAGIC"), "WHOLE_BODY, IMPULSE"),
        (("--dry-run", "--set", "ground=Nothing"), "no object of that name"),
        (("--dry-run", "--set", "__class__=1"), "no setting|no path"),
        (("--dry-run", "--set", "nonsense"), "PATH=VALUE"),
        (("--save", "/nowhere/at/all.blend"), "does not exist"),
        (("--progress", "fireworks"), "invalid choice"),
    ],
)
def test_bad_options_exit_with_2_and_say_what_to_do(shot, capfd, options, says):
    import re

    assert run(shot, *options) == 2
    assert re.search(says, capfd.readouterr().err)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--in-place", "--report", "shot.blend"), "Two results"),
        (("--in-place", "--report", "SHOT.blend"), "Two results"),
        (("--save", "new.blend", "--report", "New.BLEND"), "Two results"),
        (("--dry-run", "--report", "Shot.Blend"), "would be overwritten"),
        (("--save", "new.blend", "--report", "new.blend"), "Two results"),
        (("--dry-run", "--report", "a.json", "--receipt", "./a.json"), "Two results"),
        (("--dry-run", "--report", "shot.blend"), "is read by this bake"),
        (("--dry-run", "--receipt", "link.blend"), "is read by this bake"),
        (("--save", "rig.blend"), "is read by this bake"),
        (("--dry-run", "--ground", "Floor=mud.json", "--report", "mud.json"), "is read by this bake"),
    ],
)
def test_no_result_is_written_over_another_or_over_what_is_read(scene, tmp_path, monkeypatch, capfd, options, says):
    shots.walker(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "rig.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "rig.blend"), link=True) as (_, linked):
        linked.objects = ["Walker"]
    bpy.context.scene.collection.objects.link(linked.objects[0])
    shot = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    (tmp_path / "link.blend").symlink_to(shot)
    (tmp_path / "mud.json").write_text("{}", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert run(shot, *options) == 2
    assert says in capfd.readouterr().err
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
def test_a_broken_or_missing_file_exits_with_2(tmp_path):
    broken = tmp_path / "broken.blend"
    broken.write_bytes(b"BLENDER-v405" + b"\x00" * 100)
    for path in (broken, tmp_path / "missing.blend"):
        done = command_line.run("bake", path, "--dry-run")
        assert done.returncode == 2
        assert "Traceback" not in done.stderr
        assert path.name in done.stderr


def test_a_scene_without_or_with_several_armatures_exits_with_2(scene, tmp_path, capfd):
    path = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert run(path, "--dry-run") == 2
    assert "no armature" in capfd.readouterr().err
    for _ in range(2):
        shots.walker(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert run(path, "--dry-run") == 2
    assert "several armatures ('Walker', 'Walker.001')" in capfd.readouterr().err


@pytest.mark.slow
def test_an_interrupted_bake_exits_with_130_and_writes_nothing(scene, tmp_path):
    shots.walker(scene, frames=1500)
    path = tmp_path / "long.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    original = path.read_bytes()
    process = command_line.begin(
        "bake", path, "--in-place", "--progress", "plain", stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("sample"):
            break
    time.sleep(0.05)
    os.kill(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130, errors
    assert "interrupted" in errors
    assert path.read_bytes() == original
    assert [entry.name for entry in tmp_path.iterdir()] == ["long.blend"]


@pytest.mark.parametrize("style", ["plain", "json", "openjd", "none"])
def test_progress_comes_in_the_asked_style(shot, capfd, style):
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    capfd.readouterr()
    assert cli.run_in_blender(["bake", "--dry-run", "--progress", style]) == 0
    lines = [line for line in capfd.readouterr().out.splitlines() if line]
    if style == "none":
        assert lines == []
    elif style == "json":
        seen = [json.loads(line) for line in lines]
        assert [*dict.fromkeys(step["stage"] for step in seen)] == ["sample", "simulate", "write", "done"]
        assert seen[-1]["overall"] == 1.0
        assert seen[-1]["totals"]["steps"] >= 1
    elif style == "openjd":
        values = [float(line.split()[1]) for line in lines if line.startswith("openjd_progress: ")]
        assert values == sorted(values)
        assert values[-1] == 100.0
    else:
        assert lines[-1].endswith(" s")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--frames=1-99999999999999"], "not a frame range"),
        (["--frames", "-1048575-3"], "not a frame range"),
        (
            ["--frames=-1048574-1048574", "--dry-run"],
            "2,097,149 frames from -1048574 to 1048574",
        ),
        (["--save=a\udcff.blend"], "not UTF-8 text"),
        (["--cell-size=0.0001", "--dry-run"], "GB of memory and"),
    ],
)
def test_what_would_take_for_ever_is_refused_with_what_it_would_take(shot, capfd, monkeypatch, options, says):
    monkeypatch.setattr("softground_addon.core.loads.cell_limits.machine_memory", lambda: 6e9)
    started = time.perf_counter()
    assert run(shot, *options) == 2
    printed = capfd.readouterr().err
    assert says in printed
    assert "Traceback" not in printed
    assert time.perf_counter() - started < 60


def test_a_key_at_the_beginning_of_time_is_told_of(scene, tmp_path, capfd, monkeypatch):
    monkeypatch.setattr("softground_addon.core.loads.cell_limits.machine_memory", lambda: 16e9)
    armature = shots.walker(scene, frames=20)
    curve = next(iter(action_curves(armature.animation_data.action)))
    curve.keyframe_points.insert(float("-inf"), 0.0)
    curve.keyframe_points.insert(1e9, 0.0)
    shot = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    assert run(shot, "--dry-run") == 2
    assert "look for a key that lies far away" in capfd.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="pipes")
@pytest.mark.parametrize("output", ["closed", "full"])
def test_an_output_that_nobody_reads_stops_no_bake(shot, tmp_path, output):
    """As in `softground bake ... | head -1`."""
    report = tmp_path / "report.json"
    if output == "full":
        stdout = os.open("/dev/full", os.O_WRONLY)
    else:
        reading, stdout = os.pipe()
        os.close(reading)
    process = command_line.begin("bake", shot, "--report", report, stdout=stdout, stderr=subprocess.PIPE)
    os.close(stdout)
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
    assert json.loads(report.read_text())["steps"]


def test_letters_that_an_output_does_not_have_stop_no_bake():
    """A pipe on Windows takes those of one code page."""
    pipe = io.TextIOWrapper(io.BytesIO(), encoding="cp1252", newline="")
    with contextlib.redirect_stdout(cli._Unbroken(pipe)):
        print("Läufer 雪: 3 steps", flush=True)
    assert pipe.buffer.getvalue() == "Läufer \\u96ea: 3 steps\n".encode("cp1252")


def test_a_library_of_the_shot_is_not_written_over(scene, tmp_path, capfd):
    """The shot links a file, and that one, in turn, the shot."""
    shot, library = tmp_path / "shot.blend", tmp_path / "library.blend"
    shots.walker(scene, frames=20)
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    for file, other in ((library, shot), (shot, library)):
        bpy.ops.wm.open_mainfile(filepath=str(file))
        with bpy.data.libraries.load(str(other), link=True) as (_, wanted):
            wanted.objects = ["Walker"]
        bpy.context.scene.collection.children.link(bpy.data.collections.new("Linked"))
        bpy.data.collections["Linked"].objects.link(wanted.objects[0])
        bpy.ops.wm.save_as_mainfile(filepath=str(file))
    before = library.read_bytes()
    (tmp_path / "again.blend").symlink_to(library)
    for name in ("library.blend", "again.blend"):
        assert run(shot, "--save", tmp_path / name) == 2
        assert "would be overwritten" in capfd.readouterr().err
    assert library.read_bytes() == before
