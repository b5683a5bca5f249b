"""Workers of a batch: how many run, what becomes of those that crash, hang or are interrupted. No Blender in here."""

import fcntl
import os
import shlex
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

from softground_addon.batch.manifest import BatchShot
from softground_addon.batch.runner import Outcome, Step, Workplace, run
from softground_addon.batch.shell import command_line
from softground_addon.core.errors import InputError
from softground_addon.core.files import files

ROOT = Path(__file__).parents[2]

WORKER = """
    # Stands in for `softground bake`: the shot's text is Python that says what happens before the results are written.
    import json, os, signal, sys, time
    from pathlib import Path
    sys.path.insert(0, ROOT)
    from softground_addon.batch import receipts
    from softground_addon.core.files import files
    shot, options = Path(sys.argv[1]), dict(option[2:].partition("=")[::2] for option in sys.argv[2:])
    with open(f"{shot}.runs", "a") as runs:
        runs.write(f"{os.getpid()}\\n")
    run = len(Path(f"{shot}.runs").read_text().splitlines())
    say = lambda stage, share: print(json.dumps({"stage": stage, "overall": share}), flush=True)
    say("sample", 0.0)
    exec(shot.read_text())
    say("write", 0.9)
    save = Path(options["save"])
    own = [option for option in sys.argv[2:] if not option.startswith(("--progress", "--receipt", "--parent"))]
    with files.replacing(Path(options["receipt"])) as receipt, files.replacing(save) as partial:
        partial.write_text(f"baked {shot.name}")
        wrote = {str(save): receipts.checksum(partial)}
        receipt.write_text(receipts.dump(made_by="test", options=own, read=receipts.checksums([shot]), wrote=wrote,
                                         totals={"steps": 3}))
    print(json.dumps({"stage": "done", "overall": 1.0, "totals": {"steps": 3}}), flush=True)
    exec(os.environ.get("AFTER", ""))
"""


@pytest.fixture
def batch(tmp_path):
    """A folder with a worker, and how to make shots in it and run them."""
    return Batch(tmp_path)


class Batch:
    def __init__(self, folder):
        self.folder = folder
        self.events = []
        (folder / "worker.py").write_text(textwrap.dedent(WORKER).replace("ROOT", repr(str(ROOT)), 1))

    def shot(self, name, does="pass"):
        path = self.folder / f"{name}.blend"
        path.write_text(does)
        return BatchShot(name=name, file=path, save=self.folder / "baked" / f"{name}.blend")

    def run(self, *shots, jobs=2, timeout=None, made_by="test", show=None):
        place = Workplace(self.folder / "state", made_by, self.command)
        return run(shots, place, jobs=jobs, timeout=timeout, show=show or self.events.append)

    def command(self, file, options):
        return [sys.executable, str(self.folder / "worker.py"), str(file), *options]

    def runs(self, shot):
        """The processes that have begun to bake a shot, by their ids."""
        path = Path(f"{shot.file}.runs")
        return [int(line) for line in path.read_text().splitlines()] if path.exists() else []


def being_written(path):
    """The name under which a file is written until it is whole."""
    with files.replacing(path) as partial:
        partial.touch()
    path.unlink()
    return partial


def statuses(outcomes):
    return [outcome.status for outcome in outcomes]


def test_every_shot_is_baked_once_and_skipped_the_next_time(batch):
    shots = [batch.shot(name) for name in ("a", "b", "c")]
    outcomes = batch.run(*shots)
    assert [(outcome.shot, outcome.status, outcome.attempts) for outcome in outcomes] == [(s, "done", 1) for s in shots]
    assert [shot.save.read_text() for shot in shots] == ["baked a.blend", "baked b.blend", "baked c.blend"]
    again = batch.run(*shots)
    assert statuses(again) == ["skipped"] * 3
    assert [outcome.totals for outcome in again] == [outcome.totals for outcome in outcomes] == [{"steps": 3}] * 3
    assert all(len(batch.runs(shot)) == 1 for shot in shots)


def test_only_what_has_changed_is_baked_again(batch):
    same, edited, lost, changed = shots = [batch.shot(name) for name in ("same", "edited", "lost", "changed")]
    batch.run(*shots)
    edited.file.write_text("pass # edited")
    lost.save.unlink()
    changed.save.write_text("something else")
    assert statuses(batch.run(*shots)) == ["skipped", "done", "done", "done"]
    assert statuses(batch.run(same, made_by="newer")) == ["done"]


COUNT_THOSE_THAT_RUN = """
here = shot.parent
shot.with_suffix(".runs_now").touch()
shot.with_suffix(".count").write_text(str(len(list(here.glob("*.runs_now")))))
shot.with_suffix(".begun").touch()
while len(list(here.glob("*.begun"))) < JOBS:  # the first ones wait for each other
    time.sleep(0.01)
shot.with_suffix(".runs_now").unlink()
"""


@pytest.mark.parametrize("jobs", [1, 3])
def test_so_many_jobs_run_at_a_time_and_no_more(batch, jobs):
    shots = [batch.shot(name, COUNT_THOSE_THAT_RUN.replace("JOBS", str(jobs))) for name in "abcde"]
    assert statuses(batch.run(*shots, jobs=jobs, timeout=120)) == ["done"] * 5
    assert max(int(shot.file.with_suffix(".count").read_text()) for shot in shots) == jobs


def test_a_crash_is_tried_once_more_and_a_refusal_is_not(batch):
    once = batch.shot("once", "os.kill(os.getpid(), signal.SIGSEGV) if run == 1 else None")
    always = batch.shot("always", "os.kill(os.getpid(), signal.SIGKILL)")
    refused = batch.shot("refused", "print('softground: No foot. Do this.'); sys.exit(2)")
    failed = batch.shot("failed", "print('softground: Wrong volume.', file=sys.stderr); sys.exit(3)")
    fine = batch.shot("fine")
    outcomes = batch.run(once, always, refused, failed, fine)
    assert [(outcome.status, outcome.attempts) for outcome in outcomes] == [
        ("done", 2), ("crashed", 2), ("refused", 1), ("failed", 1), ("done", 1),
    ]  # fmt: skip
    assert "code -9" in outcomes[1].message
    assert "always.log" in outcomes[1].message
    assert outcomes[2].message == "No foot. Do this."
    assert outcomes[3].message == "Wrong volume."
    assert "softground: No foot" in (batch.folder / "state" / "refused.log").read_text()


@pytest.mark.parametrize("wanted", ["", "7"])
def test_workers_compute_in_one_thread_unless_the_user_has_said_otherwise(batch, monkeypatch, wanted):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if wanted:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", wanted)
    threads = batch.folder / "threads"
    batch.run(batch.shot("a", f"open({str(threads)!r}, 'w').write(os.environ['OPENBLAS_NUM_THREADS'])"), jobs=1)
    assert threads.read_text() == (wanted or "1")


def test_a_crash_after_the_work_was_done_is_done(batch, monkeypatch):
    monkeypatch.setenv("AFTER", "os.kill(os.getpid(), signal.SIGSEGV)")
    shot = batch.shot("a")
    (outcome,) = batch.run(shot)
    assert (outcome.status, outcome.attempts, outcome.totals) == ("done", 1, {"steps": 3})
    assert len(batch.runs(shot)) == 1


def test_a_hanging_worker_is_ended_and_tried_once_more(batch):
    shot, busy = (
        batch.shot("hangs", "time.sleep(60)"),
        batch.shot("busy", "[say('simulate', 0.5) or time.sleep(0.01) for _ in range(250)]"),
    )
    outcome, other = batch.run(shot, busy, timeout=1.0)
    assert (outcome.status, outcome.attempts, other.status) == ("crashed", 2, "crashed")
    assert "longer than 1 s" in outcome.message


def test_progress_comes_with_the_time_left(batch):
    passed, started = [], time.monotonic()

    def show(event):
        batch.events.append(event)
        passed.append(time.monotonic() - started)

    batch.run(batch.shot("a", "time.sleep(0.5); say('simulate', 0.5)"), show=show)
    steps = [event for event in batch.events if isinstance(event, Step)]
    assert [(step.stage, step.fraction) for step in steps] == [
        ("sample", 0.0), ("simulate", 0.5), ("write", 0.9), ("done", 1.0),
    ]  # fmt: skip
    assert 0.5 <= steps[1].seconds_left <= passed[1], "half of it is left: as much as it took so far"
    assert isinstance(batch.events[-1], Outcome)


def test_garbage_on_a_workers_output_is_only_logged(batch):
    shot = batch.shot(
        "a", r"""sys.stdout.buffer.write(b'{broken\n{"stage": 3}\n[1]\n\xff\x00\n' + b'x' * 300000 + b'\n')"""
    )
    assert statuses(batch.run(shot)) == ["done"]
    assert b"\xff\x00" in (batch.folder / "state" / "a.log").read_bytes()


def test_an_interruption_ends_the_workers_and_leaves_the_rest_for_the_next_time(batch, monkeypatch):
    monkeypatch.setattr("softground_addon.batch.runner.PATIENCE", 300.0)
    shots = [
        batch.shot(name, "say('simulate', 0.5); time.sleep(300 if run == 1 and shot.stem in 'bc' else 0)")
        for name in "abcd"
    ]
    seen = []

    def interrupt(event):
        seen.append(event)
        if sum(isinstance(e, Step) and e.stage == "simulate" for e in seen) == 3 and isinstance(event, Step):
            raise KeyboardInterrupt

    started = time.monotonic()
    outcomes = batch.run(*shots, show=interrupt)
    assert time.monotonic() - started < 300, "they end as they are asked to"
    assert statuses(outcomes) == ["done", "interrupted", "interrupted", "interrupted"]
    assert sorted(path.name for path in (batch.folder / "baked").iterdir()) == ["a.blend"]
    assert statuses(batch.run(*shots)) == ["skipped", "done", "done", "done"]
    assert [len(batch.runs(shot)) for shot in shots] == [1, 2, 2, 1]


def test_a_worker_that_ignores_the_request_to_end_is_killed(batch, monkeypatch):
    monkeypatch.setattr("softground_addon.batch.runner.PATIENCE", 0.5)
    shot = batch.shot("deaf", "signal.signal(signal.SIGTERM, signal.SIG_IGN); say('simulate', 0.5); time.sleep(60)")

    def interrupt(event):
        if isinstance(event, Step) and event.stage == "simulate":
            raise KeyboardInterrupt

    assert statuses(batch.run(shot, show=interrupt)) == ["interrupted"]
    with pytest.raises(ProcessLookupError):
        os.kill(*batch.runs(shot), 0)


def test_a_shot_named_like_the_report_of_the_batch_is_baked_once(batch):
    shot = batch.shot("batch")
    place = Workplace(batch.folder / "state", "test", batch.command)
    for expected in ("done", "skipped"):
        assert statuses(batch.run(shot)) == [expected]
        place.report.write_text("{}")  # as the command does at the end
    assert len(batch.runs(shot)) == 1


def test_two_batches_do_not_bake_the_same_shot_at_the_same_time(batch, monkeypatch):
    monkeypatch.setattr("softground_addon.batch.runner.PATIENCE", 300.0)
    shot = batch.shot("a", "time.sleep(1)")
    outcomes = []
    threads = [threading.Thread(target=lambda: outcomes.extend(batch.run(shot))) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(statuses(outcomes)) == ["done", "skipped"]
    assert len(batch.runs(shot)) == 1


class Msvcrt:
    """Locks as on Windows: one byte of a file, refused with PermissionError while another handle has it."""

    LK_NBLCK = 2

    def __init__(self, refused):
        self.refused, self.locked = refused, []

    def locking(self, handle, mode, size):
        assert (mode, size, os.lseek(handle, 0, os.SEEK_CUR)) == (self.LK_NBLCK, 1, 0)
        if self.refused:
            self.refused -= 1
            raise PermissionError(13, "Permission denied")
        self.locked.append(handle)


def test_on_windows_a_shot_is_locked_too(batch, monkeypatch):
    windows = Msvcrt(refused=2)
    monkeypatch.setattr("softground_addon.batch.runner.fcntl", None)
    monkeypatch.setattr("softground_addon.batch.runner.msvcrt", windows, raising=False)
    assert statuses(batch.run(batch.shot("a"))) == ["done"]
    assert len(windows.locked) == 1
    windows.refused = 10**6
    monkeypatch.setattr("softground_addon.batch.runner.PATIENCE", 0.2)
    (outcome,) = batch.run(batch.shot("b"))
    assert outcome.status == "refused"
    assert "another process is baking this shot" in outcome.message


@pytest.mark.parametrize("windows", [False, True])
def test_the_log_begins_with_the_command_line_as_the_systems_own_shell_takes_it(batch, monkeypatch, windows):
    monkeypatch.setattr(
        "softground_addon.batch.runner.command_line", lambda words, **_: command_line(words, windows=windows)
    )
    shot = batch.shot("it's a bog")
    batch.run(shot)
    first = (batch.folder / "state" / "it's a bog.log").read_text().splitlines()[0]
    assert (f'"{shot.file}"' if windows else shlex.quote(str(shot.file))) in first


def test_what_a_killed_worker_left_behind_is_removed(batch):
    shot = batch.shot("a")
    (batch.folder / "baked").mkdir()
    partial, foreign = (being_written(batch.folder / "baked" / name) for name in ("a.blend", "a.v2.blend"))
    partial.touch()
    foreign.touch()
    batch.run(shot)
    assert not partial.exists()
    assert foreign.exists()


def test_a_place_that_cannot_be_written_is_named(batch):
    (batch.folder / "state").write_text("a file")
    with pytest.raises(InputError, match="choose another --state"):
        batch.run(batch.shot("a"))


def test_an_output_folder_that_cannot_be_made_refuses_only_its_shot(batch):
    blocked = BatchShot(name="blocked", file=batch.shot("x").file, save=batch.shot("x").file / "below" / "b.blend")
    outcomes = batch.run(blocked, batch.shot("fine"))
    assert statuses(outcomes) == ["refused", "done"]
    assert "x.blend" in outcomes[0].message


def test_a_program_that_is_not_there_is_named(batch):
    batch.command = lambda file, options: ["/nowhere/blender", str(file), *options]
    (outcome,) = batch.run(batch.shot("a"))
    assert outcome.status == "refused"
    assert "/nowhere/blender" in outcome.message


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_no_shot_is_baked_twice_however_often_the_batch_is_killed(batch):
    """Kill -9 at any moment; in the end every result is whole and nothing that was done was done again."""
    shots = [batch.shot(name, "time.sleep(0.05)") for name in "abcdefgh"]
    script = batch.folder / "main.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from pathlib import Path\n"
        "from softground_addon.batch.runner import Workplace, run\n"
        "from softground_addon.batch.manifest import BatchShot\n"
        f"folder = Path({str(batch.folder)!r})\n"
        "shots = [BatchShot(name=name, file=folder / f'{name}.blend', save=folder / 'baked' / f'{name}.blend')\n"
        "         for name in 'abcdefgh']\n"
        "command = lambda file, options: [sys.executable, str(folder / 'worker.py'), str(file), *options]\n"
        "run(shots, Workplace(folder / 'state', 'test', command), jobs=2, show=lambda event: None)\n"
    )

    def begun():
        return sum(len(batch.runs(shot)) for shot in shots)

    done_at = {}
    for more, seconds in ((1, 0.0), (2, 0.1), (3, 0.0), (2, 0.05), (1, 0.2)):  # of three, one is done
        before = begun()
        main = subprocess.Popen([sys.executable, str(script)], start_new_session=True)
        while begun() < before + more and main.poll() is None:
            time.sleep(0.01)
        time.sleep(seconds)
        main.send_signal(signal.SIGKILL)
        main.wait()
        for lock in (batch.folder / "state").glob("*.lock"):
            with lock.open() as held:  # orphans of this stand-in do not look for their parent: let them end
                fcntl.flock(held, fcntl.LOCK_EX)
        done_at |= {
            shot.name: len(batch.runs(shot)) for shot in shots if shot.save.exists() and shot.name not in done_at
        }
    assert set(statuses(batch.run(*shots))) <= {"done", "skipped"}
    assert [shot.save.read_text() for shot in shots] == [f"baked {shot.name}.blend" for shot in shots]
    assert done_at
    for shot in shots:
        assert len(batch.runs(shot)) == done_at.get(shot.name, len(batch.runs(shot)))
    assert sorted(path.name for path in (batch.folder / "baked").iterdir()) == [f"{name}.blend" for name in "abcdefgh"]
