"""Bakes of a batch side by side, each in a Blender process of its own: started, followed, retried, ended with us.

Nothing here imports bpy: a worker is any program that takes the options of `softground bake` and shows its progress as
JSON lines.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from ..core.errors import InputError
from ..core.files import files
from . import receipts
from .manifest import BatchShot
from .shell import command_line

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]
    import msvcrt

ATTEMPTS = 2
"""Most attempts at a shot whose process crashes."""

EXIT_MEANINGS = {0: "done", 2: "refused", 3: "failed"}
"""Results of a shot by its worker's exit code; every other code is a crash."""

PATIENCE = 10.0
"""Time that a worker has to end by itself after the batch is interrupted or was killed [s]."""

ALGEBRA_THREADS = "OPENBLAS_NUM_THREADS"
"""Variable for the threads of numpy's linear algebra. One in each worker is as fast, frees other processors for other
shots, and gives the same bits for any number of jobs."""

POLL = 0.05
"""Time between two looks at the workers [s]."""


@dataclass(frozen=True)
class Workplace:
    """State folder and workers of a batch.

    Attributes
    ----------
    state : Path
        Folder of receipts, logs and locks; created when missing.
    made_by : str
        Versions of the programs that bake: results of others are not taken as done.
    command : callable
        The command line of a worker, from the shot's file and the options of its bake.
    """

    state: Path
    made_by: str
    command: Callable[[Path, list[str]], list[str]]

    @property
    def report(self) -> Path:
        """File of the outcome of every shot, unless the user names another."""
        return self.state / "batch.json"

    def receipt(self, shot: BatchShot) -> Path:
        """The shot's receipt (see `receipts`); no shot's name makes it the report of the batch."""
        return self.state / f"{shot.name}.receipt.json"

    def log(self, shot: BatchShot) -> Path:
        """Everything that the shot's workers have printed."""
        return self.state / f"{shot.name}.log"

    def lock(self, shot: BatchShot) -> Path:
        """File that the process locks that bakes the shot."""
        return self.state / f"{shot.name}.lock"

    def files(self, shots: Iterable[BatchShot]) -> dict[Path, str]:
        """Files in the state folder for these shots, and their descriptions."""
        kinds = {self.receipt: "the receipt", self.log: "the log", self.lock: "the lock"}
        return {self.state: "the state folder"} | {
            place(shot): f"{kind} of '{shot.name}'" for shot in shots for place, kind in kinds.items()
        }


@dataclass(frozen=True)
class Outcome:
    """Outcome of the bake of one shot.

    Attributes
    ----------
    status : str
        'done', 'skipped' (it was done already), 'refused' (bad input), 'failed' (a check), 'crashed', or 'interrupted'.
    attempts : int
        Processes that were started for it.
    seconds : float
        Time that they took [s].
    totals : dict
        Figures that the worker printed at its end: steps, depth, force.
    message : str
        Its error message.
    """

    shot: BatchShot
    status: str
    attempts: int = 0
    seconds: float = 0.0
    totals: dict[str, Any] = field(default_factory=dict)
    message: str = ""


@dataclass(frozen=True)
class Step:
    """Progress of a running bake.

    Attributes
    ----------
    fraction : float
        Of the whole bake, 0 to 1.
    seconds_left : float
        Remaining time [s], estimated from the time so far.
    """

    shot: BatchShot
    stage: str
    fraction: float
    seconds_left: float


@dataclass
class _Worker:
    shot: BatchShot
    process: subprocess.Popen[bytes]
    attempt: int
    spent: float
    lock: IO[bytes]
    printed: IO[bytes]
    log: IO[bytes]
    started: float
    totals: dict[str, Any] = field(default_factory=dict)
    message: str = ""
    timed_out: bool = False

    @property
    def seconds(self) -> float:
        return self.spent + time.monotonic() - self.started

    def lines(self) -> Iterator[bytes]:
        """Output since the last call, in whole lines unless the process has ended; all but progress is logged."""
        has_ended = self.process.poll() is not None
        while line := self.printed.readline():
            if not (line.endswith(b"\n") or has_ended):
                self.printed.seek(-len(line), os.SEEK_CUR)
                return
            with contextlib.suppress(OSError):  # a full disk must not stop the batch
                if not line.startswith(b"{"):
                    self.log.write(line)
            yield line

    def close(self) -> None:
        """Log the last output, and close the files."""
        deque(self.lines(), maxlen=0)
        for file in (self.printed, self.log):
            with contextlib.suppress(OSError):
                file.close()


def run(
    shots: Sequence[BatchShot],
    workplace: Workplace,
    *,
    jobs: int,
    timeout: float | None = None,
    show: Callable[[Step | Outcome], None],
) -> list[Outcome]:
    """Bake shots, at most `jobs` at a time; each ends in one outcome, in the order of `shots`.

    A shot that is done already is skipped, one whose process crashes (or takes longer than `timeout` seconds) is tried
    once more. On KeyboardInterrupt the running workers are asked to end, and unfinished shots are 'interrupted'.

    Raises
    ------
    InputError
        If the folder of receipts and logs cannot be written.
    """
    try:
        workplace.state.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"'{workplace.state}' cannot be written ({error.strerror}): choose another --state.") from None
    return _Batch(workplace, jobs, timeout, show).run(shots)


class _Batch:
    def __init__(
        self, workplace: Workplace, jobs: int, timeout: float | None, show: Callable[[Step | Outcome], None]
    ) -> None:
        self._workplace = workplace
        self._jobs = jobs
        self._timeout = timeout
        self._show = show
        self._running: dict[str, _Worker] = {}
        self._outcomes: dict[str, Outcome] = {}

    def run(self, shots: Sequence[BatchShot]) -> list[Outcome]:
        waiting = deque(shots)
        with tempfile.TemporaryDirectory(prefix="softground-", ignore_cleanup_errors=True) as folder:
            self._printed = Path(folder)
            try:
                while waiting or self._running:
                    while waiting and len(self._running) < self._jobs:
                        self._begin(waiting.popleft())
                    for worker in list(self._running.values()):
                        self._follow(worker)
                    time.sleep(POLL)
            except KeyboardInterrupt:
                for worker in list(self._running.values()):
                    self._end(Outcome(worker.shot, "interrupted", worker.attempt, worker.seconds))
            finally:
                self._stop_workers()
        return [self._outcomes.get(shot.name, Outcome(shot, "interrupted")) for shot in shots]

    def _begin(self, shot: BatchShot, attempt: int = 1, spent: float = 0.0, lock: IO[bytes] | None = None) -> None:
        """Start a worker for a shot, unless the shot is done."""
        place = self._workplace
        try:
            lock = lock or _locked(place.lock(shot))
            totals = self._totals_if_done(shot)
            if totals is not None:  # after a crash: it had done its work before
                lock.close()
                self._end(Outcome(shot, "done" if attempt > 1 else "skipped", attempt - 1, spent, totals))
                return
            for path in (*shot.outputs, place.receipt(shot)):
                path.parent.mkdir(parents=True, exist_ok=True)
                files.remove_leftovers(path)
            command = place.command(
                shot.file,
                [*shot.options, "--progress=json", f"--receipt={place.receipt(shot)}", f"--parent={os.getpid()}"],
            )
            log = place.log(shot).open("ab" if attempt > 1 else "wb", buffering=0)
            log.write(f"$ {command_line(command, windows=os.name == 'nt')}\n".encode())
            output = (self._printed / shot.name).open("wb")  # no pipe: it would have to be emptied all the time
            printed = (self._printed / shot.name).open("rb")
            inherited = {} if fcntl is None else {"pass_fds": (lock.fileno(),)}  # workers that outlive us keep the lock
            started = time.monotonic()
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C comes to us alone, and we pass it on
                env={ALGEBRA_THREADS: "1", **os.environ},
                **inherited,  # type: ignore[call-overload]
            )
        except (OSError, InputError) as error:
            if lock:
                lock.close()
            message = f"{error.filename}: {error.strerror}" if isinstance(error, OSError) else str(error)
            self._end(Outcome(shot, "refused", attempt - 1, spent, message=message))
            return
        output.close()
        self._running[shot.name] = _Worker(shot, process, attempt, spent, lock, printed, log, started)

    def _totals_if_done(self, shot: BatchShot) -> dict[str, Any] | None:
        place = self._workplace
        return receipts.totals_if_done(
            place.receipt(shot), made_by=place.made_by, options=shot.options, source=shot.file, outputs=shot.outputs
        )

    def _follow(self, worker: _Worker) -> None:
        """Read the output of a worker, and notice that it has ended or takes too long."""
        if self._timeout and time.monotonic() - worker.started > self._timeout:
            worker.timed_out = True
            worker.process.kill()
        has_ended = worker.process.poll() is not None
        for line in worker.lines():
            if line.startswith(b"{"):
                self._progress(worker, line)
            elif line.startswith(b"softground: "):
                worker.message = line.decode(errors="replace").strip().removeprefix("softground: ")
        if has_ended:
            self._ended(worker)

    def _progress(self, worker: _Worker, line: bytes) -> None:
        try:
            said = json.loads(line)
            stage, fraction = str(said["stage"]), float(said["overall"])
        except (ValueError, KeyError, TypeError):
            return
        worker.totals = said.get("totals", worker.totals)
        passed = time.monotonic() - worker.started
        remaining = passed * (1.0 - fraction) / max(fraction, 0.01)
        self._show(Step(worker.shot, stage, fraction, remaining))

    def _ended(self, worker: _Worker) -> None:
        code = worker.process.wait()
        worker.close()
        del self._running[worker.shot.name]
        status = EXIT_MEANINGS.get(code, "crashed")
        if status == "crashed" and worker.attempt < ATTEMPTS:
            self._begin(worker.shot, worker.attempt + 1, worker.seconds, worker.lock)
            return
        worker.lock.close()
        message = worker.message
        if status == "crashed":
            said = f"took longer than {self._timeout:g} s" if worker.timed_out else f"ended with code {code}"
            message = f"{said}; see '{self._workplace.log(worker.shot)}'"
        self._end(Outcome(worker.shot, status, worker.attempt, worker.seconds, worker.totals, message))

    def _end(self, outcome: Outcome) -> None:
        self._outcomes[outcome.shot.name] = outcome
        self._show(outcome)

    def _stop_workers(self) -> None:
        workers = list(self._running.values())
        self._running.clear()
        for worker in workers:
            worker.process.terminate()
        deadline = time.monotonic() + PATIENCE
        for worker in workers:
            try:
                worker.process.wait(timeout=max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                worker.process.kill()
                worker.process.wait()
            worker.close()
            worker.lock.close()


def _locked(path: Path) -> IO[bytes]:
    """The lock file, locked; waits for a worker that a killed batch left behind and that is about to end."""
    lock = path.open("ab")
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            _try_lock(lock)
        except (BlockingIOError, PermissionError):
            if time.monotonic() > deadline:
                lock.close()
                raise OSError(0, "another process is baking this shot", str(path)) from None
            time.sleep(POLL)
        else:
            return lock


def _try_lock(lock: IO[bytes]) -> None:
    """Lock a file; BlockingIOError (PermissionError on Windows) where another process has."""
    if fcntl is not None:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    else:
        lock.seek(0)  # the same byte for everybody
        msvcrt.locking(lock.fileno(), msvcrt.LK_NBLCK, 1)
