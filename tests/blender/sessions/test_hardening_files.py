"""Whatever happens to a bake (kills, full disks, folders that cannot be written), the files on disk are whole."""

import hashlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from functools import partial

import bpy
import pytest

from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import ground_mesh
from softground_addon.core.files.files import remove_leftovers
from tests.blender import command_line, shots
from tests.tiers import slow_but_one

posix = pytest.mark.skipif(os.name != "posix", reason="signals and mounts")


def checksum(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def kill_at(moment, *arguments):
    """Bake and kill the process after that many seconds; whether it had ended before."""
    process = command_line.begin("bake", *arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(timeout=moment)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return False
    return True


@posix
@pytest.mark.parametrize(
    "kills", [pytest.param(10, marks=pytest.mark.slow), pytest.param(200, marks=pytest.mark.marathon)]
)
def test_a_killed_bake_leaves_the_old_file_or_the_new_one_whole(shot, tmp_path, kills):
    """Kill -9 at random moments, most of them around the saving."""
    old = shot.read_bytes()
    before, receipt = checksum(shot), tmp_path / "receipt.json"
    options = (shot, "--in-place", "--progress=none", "--receipt", receipt)
    started = time.perf_counter()
    assert command_line.run("bake", *options).returncode == 0
    whole = time.perf_counter() - started
    chance = random.Random(1)
    seen = {"old": 0, "new": 0}
    for attempt in range(kills):
        shot.write_bytes(old)
        receipt.unlink(missing_ok=True)
        kill_at(whole * (chance.uniform(0.6, 1.1) if attempt % 4 else chance.uniform(0.0, 1.0)), *options)
        digest = checksum(shot)
        if digest == before:
            seen["old"] += 1
            continue
        seen["new"] += 1
        if receipt.exists():  # which comes last
            assert digest == json.loads(receipt.read_text())["wrote"][str(shot.resolve())], f"attempt {attempt}"
        else:
            bpy.ops.wm.open_mainfile(filepath=str(shot))
            assert ground_mesh.is_baked(bpy.context.scene.softground.ground), f"attempt {attempt}"
    print(seen)
    assert seen["old"]
    remains = [path for path in tmp_path.iterdir() if path not in (shot, receipt)]
    assert all(path.name.startswith(".") and ".partial" in path.name for path in remains)


KILLED_WHILE_SAVING = """
import signal, sys
number, delay = int(sys.argv.pop(1)), float(sys.argv.pop(1))

def count(event, arguments):
    global number
    if event in ("open", "os.rename", "os.remove", "os.chmod") and ".partial" in str(arguments[0]):
        number -= 1
        if number == 0:
            signal.setitimer(signal.ITIMER_REAL, delay)  # which ends the process, also within Blender's saver

sys.addaudithook(count)
from softground_addon.__main__ import main
sys.exit(main())
"""


@posix
@pytest.mark.timeout(7200)
@pytest.mark.parametrize(
    "kills", [pytest.param(6, marks=pytest.mark.slow), pytest.param(200, marks=pytest.mark.marathon)]
)
def test_a_bake_killed_within_its_save_leaves_whole_files_and_a_receipt_that_is_true(scene, tmp_path, kills):
    """Between the first write and the last rename: at each step of it, or up to a tenth of a second later."""
    shot = tmp_path / "shot.blend"
    shots.walker(scene, frames=9)
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    folder = tmp_path / "out"
    folder.mkdir()
    places = {name: folder / name for name in ("baked.blend", "report.json", "receipt.json")}
    options = ["--save", places["baked.blend"], "--report", places["report.json"], "--receipt", places["receipt.json"]]
    chance, ended = random.Random(2), 0
    for attempt in range(kills):
        old = {name: path.read_bytes() for name, path in places.items() if path.exists()}
        step = 2 * attempt % 25 + 1  # so that few attempts reach the renames too
        order = [step, chance.choice([1e-6, chance.uniform(0, 0.1)])]
        command = [sys.executable, "-c", KILLED_WHILE_SAVING, *order, "bake", shot, "--progress=none", *options]
        done = subprocess.run(list(map(str, command)), cwd=command_line.ROOT, capture_output=True, check=False)
        assert done.returncode in (0, -signal.SIGALRM), done.stderr
        ended += done.returncode == 0
        contents = {name: path.read_bytes() for name, path in places.items() if path.exists()}
        if contents.get("baked.blend") != old.get("baked.blend"):
            bpy.ops.wm.open_mainfile(filepath=str(places["baked.blend"]))
            assert ground_mesh.is_baked(bpy.context.scene.softground.ground)
        if "report.json" in contents:
            assert json.loads(contents["report.json"])["steps"]
        if contents.get("receipt.json") != old.get("receipt.json"):
            wrote = json.loads(contents["receipt.json"])["wrote"]
            assert wrote == {str(places[name]): checksum(places[name]) for name in ("baked.blend", "report.json")}
        for path in places.values():
            remove_leftovers(path)
        assert {path.name for path in folder.iterdir()} <= set(places)
    assert ended < kills


@posix
def test_a_full_disk_is_named_and_leaves_no_trace(shot, small_disk, capfd):
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    target = small_disk / "baked.blend"
    target.write_bytes(b"old")
    assert cli.run_in_blender(["bake", "--progress=none", f"--save={target}"]) == 2
    assert "No space left on device" in capfd.readouterr().err
    assert [(path.name, path.read_bytes()) for path in small_disk.iterdir()] == [("baked.blend", b"old")]


@posix
def test_a_disk_that_fills_up_while_the_report_is_written_leaves_no_trace(shot, small_disk, tmp_path, capfd):
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    report, target = small_disk / "report.json", tmp_path / "baked.blend"
    options = ["--set=keep_forces=true", f"--report={report}", f"--save={target}"]
    (small_disk / "filler").write_bytes(bytes(196 * 1024))
    assert cli.run_in_blender(["bake", "--progress=none", *options]) == 2
    assert "report.json' could not be written" in capfd.readouterr().err
    assert [path.name for path in small_disk.iterdir()] == ["filler"]
    assert not target.exists()


@pytest.mark.slow
@posix
def test_a_limit_on_the_size_of_files_leaves_the_old_one(shot):
    old = shot.read_bytes()
    limit = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (100_000, 100_000))
    done = command_line.run("bake", shot, "--in-place", preexec_fn=limit)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert shot.read_bytes() == old
    assert [path.name for path in shot.parent.iterdir()] == ["shot.blend"]


@posix
@pytest.mark.parametrize("option", ["--save", "--report", "--receipt"])
def test_a_folder_that_cannot_be_written_is_named_before_anything_is_baked(shot, option, capfd, monkeypatch):
    monkeypatch.setattr(cli.bake_job, "bake", None)
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    options = [f"{option}=/proc/softground.blend", "--dry-run" if option != "--save" else "--progress=none"]
    assert cli.run_in_blender(["bake", *options]) == 2
    assert "/proc" in capfd.readouterr().err


@posix
def test_a_link_to_the_shot_stays_a_link(shot, tmp_path):
    """As in folders where `latest.blend` points to the version that counts."""
    link = tmp_path / "latest.blend"
    link.symlink_to(shot.name)
    before = checksum(shot)
    bpy.ops.wm.open_mainfile(filepath=str(link))
    assert cli.run_in_blender(["bake", "--progress=none", "--in-place"]) == 0
    assert link.is_symlink()
    assert checksum(shot) != before


@posix
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_a_bake_cleanly_at_any_moment(scene, tmp_path, number):
    shots.walker(scene, frames=1500)  # so that it is not done before the signal comes
    shot = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    old = shot.read_bytes()
    options = (shot, "--in-place", "--progress=json")
    process = command_line.begin("bake", *options, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    for line in process.stdout:
        if '"simulate"' in line:
            break
    for _ in range(5):  # an impatient user
        process.send_signal(number)
        time.sleep(0.02)
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert shot.read_bytes() == old
    assert [path.name for path in shot.parent.iterdir()] == ["shot.blend"]


@pytest.mark.slow
@pytest.mark.parametrize("share", slow_but_one([0.0, 0.1, 0.5, 0.9, 0.99]))
def test_a_truncated_shot_exits_with_2(shot, share, tmp_path):
    broken = tmp_path / "broken.blend"
    content = shot.read_bytes()
    broken.write_bytes(content[: int(len(content) * share)])
    done = command_line.run("bake", broken, "--in-place")
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert broken.read_bytes() == content[: int(len(content) * share)]


NAMES = ['it\'s "two"\nlines  ❄', "%s{0}$HOME`x` #####", "-rf", "--save", "ä" * 70, ".dot"]


@pytest.mark.slow
@pytest.mark.parametrize("name", slow_but_one(NAMES))
def test_a_hostile_file_name_is_only_a_name(shot, name, tmp_path, capfd):
    folder = tmp_path / name
    folder.mkdir()
    path = folder / f"{name}.blend"
    shutil.move(shot, path)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    options = ["--progress=none", f"--save={folder / (name + ' baked.blend')}", f"--report={folder / (name + '.json')}"]
    assert cli.run_in_blender(["bake", *options]) == 0, capfd.readouterr().err
    assert {entry.name for entry in folder.iterdir()} == {f"{name}.blend", f"{name} baked.blend", f"{name}.json"}
    manifest = tmp_path / "night.json"
    manifest.write_text(json.dumps({"shots": [{"file": f"{name}/{name}.blend", "in_place": True}]}))
    assert cli.run_in_blender(["batch", str(manifest), "--progress=plain"]) == 0, capfd.readouterr().out
    assert "1 done" in capfd.readouterr().out


@pytest.mark.slow
@posix
def test_a_bake_that_is_paused_goes_on_where_it_stopped(shot, tmp_path):
    report = tmp_path / "report.json"
    process = command_line.begin("bake", shot, "--report", report, "--progress=json", stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.2)
    assert process.poll() is None
    process.send_signal(signal.SIGCONT)
    process.communicate(timeout=300)
    assert process.returncode == 0
    assert json.loads(report.read_text())["steps"]


@posix
@pytest.mark.slow
def test_two_manifests_that_write_one_file_at_the_same_time_leave_it_whole(shot, tmp_path):
    baked = tmp_path / "baked.blend"
    batches = []
    for name in ("one", "two"):
        manifest = tmp_path / f"{name}.json"
        manifest.write_text(json.dumps({"shots": [{"file": str(shot), "save": str(baked)}]}))
        batches.append(
            (manifest, command_line.begin("batch", manifest, stdout=subprocess.PIPE, stderr=subprocess.STDOUT))
        )
        time.sleep(0.5)
    for _, process in batches:
        said, _ = process.communicate(timeout=600)
        assert process.returncode in (0, 2), said
        assert "Traceback" not in said
    bpy.ops.wm.open_mainfile(filepath=str(baked))
    assert ground_mesh.is_baked(bpy.context.scene.softground.ground)
    for manifest, _ in batches:  # whoever was refused, or written over, is done by the next run
        assert command_line.run("batch", manifest).returncode == 0
    assert not [path for path in tmp_path.iterdir() if ".partial" in path.name]
