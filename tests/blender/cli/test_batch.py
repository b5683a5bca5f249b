"""`softground batch` on real shots: the same results however it is run, killed and resumed."""

import fcntl
import hashlib
import json
import os
import random
import signal
import subprocess
import time
from pathlib import Path

import bpy
import numpy as np
import pytest

from softground_addon.batch import command
from softground_addon.batch import manifest as manifests
from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import ground_mesh
from tests.benchmarks.bars import below
from tests.blender import command_line, fingerprints, shots


@pytest.fixture
def night(scene, tmp_path):
    """A folder of shots that differ, and a manifest of them all."""

    def make(count, frames=30):
        for number in range(count):
            bpy.ops.wm.read_factory_settings(use_empty=True)
            shots.walker(bpy.context.scene, frames=frames, speed=1.0 + 0.02 * number)
            bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{number:03}.blend"))
        path = tmp_path / "night.toml"
        path.write_text(
            'defaults.save = "baked/{name}.blend"\ndefaults.report = "baked/{name}.json"\n'
            'shots = [{ files = "0*.blend" }]\n'
        )
        return path

    return make


def run(*arguments, timeout=600):
    return command_line.run("batch", *arguments, timeout=timeout)


def begin(*arguments, **how):
    return command_line.begin("batch", *arguments, **how)


def results(folder):
    """What the bakes of a folder gave, as bytes: every mesh, the records, and the reports without their timings."""
    hashes = {}
    for path in sorted(folder.glob("*.blend")):
        bpy.ops.wm.open_mainfile(filepath=str(path))
        meshes = {mesh.name: fingerprints.of_mesh(mesh) | {"properties": None} for mesh in bpy.data.meshes}
        records = [bytes(mesh[ground_mesh.RECORD]) for mesh in bpy.data.meshes if ground_mesh.RECORD in mesh.keys()]  # noqa: SIM118
        assert len(records) == 1
        report = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        del report["timings"]
        hashes[path.stem] = hashlib.sha256(repr((meshes, records, report)).encode()).hexdigest()
    return hashes


@pytest.mark.slow
def test_shots_baked_side_by_side_are_those_baked_one_by_one(night, capfd):
    manifest = night(2)
    done = run(manifest, "--jobs", 2)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 done" in done.stdout
    summary = json.loads((manifest.parent / "night.batch" / "batch.json").read_text())
    assert summary["totals"]["done"] == 2
    side_by_side = results(manifest.parent / "baked")
    assert len(set(side_by_side.values())) == 2
    for number in range(2):
        bpy.ops.wm.open_mainfile(filepath=str(manifest.parent / f"{number:03}.blend"))
        target = manifest.parent / "baked" / f"{number:03}"
        assert cli.run_in_blender(["bake", f"--save={target}.blend", f"--report={target}.json"]) == 0
    assert results(manifest.parent / "baked") == side_by_side


@pytest.mark.slow
def test_an_interrupted_batch_exits_with_130_and_goes_on_where_it_stopped(night):
    manifest = night(3, frames=60)
    process = begin(manifest, "--progress", "json", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("{") and json.loads(line)["ended"] == 1:
            break
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130, errors
    assert "run the same command again" in errors
    state = manifest.parent / "night.batch"
    assert json.loads((state / "batch.json").read_text())["totals"] | {"skipped": 0} == {
        "done": 1, "skipped": 0, "refused": 0, "failed": 0, "crashed": 0, "interrupted": 2,
    }  # fmt: skip
    assert sorted(path.name for path in (manifest.parent / "baked").iterdir()) == ["000.blend", "000.json"]
    again = run(manifest)
    assert again.returncode == 0, again.stderr
    assert "2 done, 1 skipped" in again.stdout


@pytest.mark.slow
def test_a_worker_ends_by_itself_when_its_batch_is_killed(night):
    manifest = night(1, frames=1500)
    process = begin(manifest, "--progress", "json", stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    process.kill()
    process.communicate()
    (lock,) = (manifest.parent / "night.batch").glob("*.lock")
    with lock.open() as held:  # the worker holds it until it ends
        fcntl.flock(held, fcntl.LOCK_EX)
    assert not list((manifest.parent / "baked").iterdir())


@pytest.mark.slow
def test_a_bad_shot_does_not_keep_the_others_from_being_baked(night):
    manifest = night(2)
    (manifest.parent / "0bad.blend").write_bytes(b"BLENDER-v405" + b"\0" * 100)
    done = run(manifest)
    assert done.returncode == 2, done.stdout
    assert "2 done, 1 refused" in done.stdout
    assert "could not be opened" in done.stdout
    manifest.write_text(manifest.read_text() + "[defaults.set]\n'material.density' = 3\n")
    done = run(manifest)
    assert "3 refused" in done.stdout
    assert "no setting 'material.density'" in done.stdout


@pytest.mark.slow
def test_a_shot_baked_in_place_is_baked_once(night):
    manifest = night(1)
    manifest.write_text("shots = [{ file = '000.blend', in_place = true }]")
    assert run(manifest).returncode == 0
    baked = (manifest.parent / "000.blend").read_bytes()
    assert "1 skipped" in run(manifest).stdout
    assert (manifest.parent / "000.blend").read_bytes() == baked


@pytest.mark.slow
def test_changed_edits_bake_the_shot_again(night):
    path = night(1)
    edits, report = path.with_name("000.edits.json"), path.parent / "baked/000.json"
    path.write_text(path.read_text().replace("shots =", "defaults.edits = '{name}.edits.json'\nshots =", 1))
    edits.write_text('{"schema_version": 1, "steps": {}}')
    plain = result_of(path, report, "done")
    assert result_of(path, report, "skipped") == plain
    step = plain["steps"][1]["id"]
    edits.write_text(json.dumps({"schema_version": 1, "steps": {step: {"strength": 0.5}}}))
    half = result_of(path, report, "done")
    assert half["input_hash"] != plain["input_hash"]
    assert half["steps"][1]["max_depth_m"] == pytest.approx(0.5 * plain["steps"][1]["max_depth_m"], rel=1e-3)
    edits.write_text('{"schema_version": 1, "steps": {}}')
    assert result_of(path, report, "done")["input_hash"] == plain["input_hash"]


def result_of(path, report, status):
    """The report of the only shot of a batch, which ends so."""
    assert run(path, "--progress=none").returncode == 0
    (outcome,) = json.loads(path.with_suffix(".batch").joinpath("batch.json").read_text())["shots"]
    assert outcome["status"] == status
    return json.loads(report.read_text())


@pytest.mark.slow
def test_a_changed_library_bakes_the_shot_again(night, capfd):
    manifest = night(1)

    def run_here():
        assert cli.run_in_blender(["batch", str(manifest)]) == 0
        return capfd.readouterr().out

    rig = manifest.parent / "rig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(rig))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(rig), link=True) as (_, linked):
        linked.objects = ["Walker"]
    bpy.context.scene.collection.objects.link(linked.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(manifest.parent / "000.blend"))
    assert "1 done" in run_here()
    assert "1 skipped" in run_here()
    rig.write_bytes(rig.read_bytes() + b"\0")
    assert "1 done" in run_here()


@pytest.mark.parametrize(
    ("text", "options", "says"),
    [
        ("shots = 3", (), "has no shots"),
        ("shots = [{ file = 'gone.blend', in_place = true }]", (), "gone.blend"),
        (None, ("--shot", "99"), "no shot '99'"),
        (None, ("--jobs", "0"), "not a number of processes"),
        (None, ("--timeout", "nan"), "not a number of seconds"),
        (None, ("--state", "/dev/null/x"), "choose another --state"),
        (None, ("--report", "/nowhere/at/all.json"), "does not exist"),
    ],
)
def test_bad_input_exits_with_2_before_anything_is_baked(night, capfd, text, options, says):
    manifest = night(1)
    if text:
        manifest.write_text(text)
    assert cli.run_in_blender(["batch", str(manifest), *options]) == 2
    assert says in capfd.readouterr().err
    assert not (manifest.parent / "baked").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "options", "says"),
    [
        ("save = 'b.blend'", ("--report", "000.blend"), "'--report' would write over the shot"),
        ("save = 'b.blend'", ("--report", "../{}/000.BLEND"), "'--report' would write over the shot"),
        ("save = 'b.blend'", ("--report", "night.toml"), "'--report' would write over the manifest"),
        ("save = 'b.blend'", ("--report", "b.blend"), "both write"),
        ("save = 'b.blend', preset = 'bog.json'", ("--report", "bog.json"), "a preset of '000'"),
        ("save = 'b.blend'", ("--report", "night.batch/000.receipt.json"), "the receipt of '000'"),
        ("save = 'night.batch/000.log'", (), "the log of '000'"),
        ("report = 'state/000.lock'", ("--state", "state"), "the lock of '000'"),
        ("report = 'night.batch/batch.json'", (), "both write"),
        ("report = 'night.batch'", (), "the state folder"),
    ],
)
def test_no_result_replaces_what_the_batch_reads_or_keeps(night, capfd, monkeypatch, line, options, says):
    path = night(1)
    path.write_text(f"shots = [{{ file = '000.blend', {line} }}]")
    (path.parent / "bog.json").write_text("{}")
    before = {file: file.read_bytes() for file in path.parent.iterdir()}
    monkeypatch.chdir(path.parent)
    assert cli.run_in_blender(["batch", "night.toml", *(text.format(path.parent.name) for text in options)]) == 2
    assert says in capfd.readouterr().err
    assert {file: file.read_bytes() for file in path.parent.iterdir()} == before


def test_the_table_shows_hostile_names_on_one_line():
    shot = manifests.BatchShot(name='it\'s "two"\nlines\x1b[31m ❄ \u202e', file=Path("a.blend"))
    lines = command.table([command.Outcome(shot, "refused", message="first\nsecond")]).splitlines()
    assert len(lines) == 3
    assert r"\nlines\x1b[31m" in lines[1]
    assert r"first\nsecond" in lines[1]


@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    ("shots", "kills"),
    [pytest.param(10, 2, marks=pytest.mark.slow), pytest.param(50, 5, marks=pytest.mark.marathon)],
)
def test_a_batch_killed_a_few_times_equals_the_uninterrupted_one(night, shots, kills):
    """Kill -9 of the batch at random moments; every result is that of one go, and nothing done is done again."""
    manifest = night(shots)
    started = time.perf_counter()
    assert run(manifest, "--jobs", 2, timeout=900).returncode == 0
    seconds = time.perf_counter() - started
    whole = results(manifest.parent / "baked")
    for folder in ("baked", "night.batch"):
        for path in (manifest.parent / folder).iterdir():
            path.unlink()
    chance = random.Random(5)
    finished: dict[Path, int] = {}
    for _ in range(kills):
        process = begin(manifest, "--jobs", 2, "--progress", "none")
        time.sleep(chance.uniform(0.25, 1.0) / kills * seconds)
        process.kill()
        process.wait()
        time.sleep(1.0)  # until its workers have noticed
        for path in (manifest.parent / "baked").glob("[!.]*.blend"):
            assert finished.get(path, path.stat().st_mtime_ns) == path.stat().st_mtime_ns, f"{path} was baked twice"
            finished[path] = path.stat().st_mtime_ns
    assert finished
    done = run(manifest, "--jobs", 2, timeout=900)
    assert done.returncode == 0, done.stdout
    assert all(path.stat().st_mtime_ns == moment for path, moment in finished.items())
    assert results(manifest.parent / "baked") == whole
    assert not [path for path in (manifest.parent / "baked").iterdir() if path.name.startswith(".")]


@pytest.mark.benchmark
def test_two_jobs_are_almost_twice_as_fast_as_one(night):
    if (os.cpu_count() or 1) < 2:
        pytest.skip("needs two cores")
    count, turns = 16, 2  # enough that the start of the batch itself counts for little
    manifest = night(count, frames=120)
    busy = os.getloadavg()[0] > 1.2
    seconds = {1: np.inf, 2: np.inf}
    for turn in range(turns):
        for jobs in (1, 2):
            started = time.perf_counter()
            state = manifest.parent / f"state{turn}{jobs}"
            assert run(manifest, "--jobs", jobs, "--state", state).returncode == 0
            seconds[jobs] = min(seconds[jobs], time.perf_counter() - started)
    ratio = seconds[1] / seconds[2]
    if busy:
        pytest.skip("the machine was busy with other work, so that the ratio says nothing")
    below(f"{count} shots with two jobs over one", 1.0 / ratio, 1.0 / 1.8)


@pytest.mark.benchmark
def test_the_command_line_adds_little_to_a_bake(night):
    shot = night(1, frames=120).parent / "000.blend"
    options = ["--progress=none", f"--save={shot.parent / 'out.blend'}"]
    within, whole = [], []
    for _ in range(3):
        bpy.ops.wm.open_mainfile(filepath=str(shot))
        started = time.process_time()  # of processors, whatever else the machine does
        assert cli.run_in_blender(["bake", *options]) == 0
        within.append(time.process_time() - started)
        started = sum(os.times()[2:4])
        assert command_line.run("bake", shot, *options).returncode == 0
        whole.append(sum(os.times()[2:4]) - started)
    below("the command line beside its bake", min(whole) - min(within), 1.5, "s")
