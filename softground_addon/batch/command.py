"""`softground batch MANIFEST`: many shots, side by side, resumable, with a table and one JSON at the end."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..core.files import files
from . import manifest
from .runner import Outcome, Step, Workplace, run

SCHEMA_VERSION = 1

STATUSES = ("done", "skipped", "refused", "failed", "crashed", "interrupted")

PROGRESS_STYLES = ("plain", "json", "openjd", "none")
"""Lines for people, a JSON object a line, OpenJD's messages, or nothing."""

FIRST_ESTIMATE = 0.1
"""Share of a bake from which on its pace gives an estimate of the remaining time."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `softground batch`."""
    parser.add_argument("manifest", type=Path, metavar="MANIFEST", help="which shots to bake, and how: TOML or JSON")
    parser.add_argument(
        "--jobs", type=_count, default=1, metavar="N", help="shots baked at a time, each in its own process"
    )
    parser.add_argument(
        "--shot", dest="shots", action="append", default=[], metavar="NAME|NUMBER",
        help="bake this shot of the manifest only; may be repeated",
    )  # fmt: skip
    parser.add_argument("--timeout", type=_seconds, metavar="S", help="end a bake that takes longer, and try it again")
    parser.add_argument(
        "--state", type=Path, metavar="FOLDER", help="receipts and logs (default: beside the manifest, NAME.batch)"
    )
    parser.add_argument(
        "--report", type=Path, metavar="FILE.json", help="outcome of every shot (default: batch.json in the state)"
    )
    parser.add_argument("--progress", choices=PROGRESS_STYLES, default="plain", help="how to show progress")


def bake_batch(
    options: argparse.Namespace, made_by: str, worker_command: Callable[[Path, list[str]], list[str]]
) -> list[Outcome]:
    """Bake the shots of a manifest; the outcome of each, in the manifest's order.

    Parameters
    ----------
    options : argparse.Namespace
        From `add_arguments`.
    made_by, worker_command
        See `runner.Workplace`.

    Raises
    ------
    InputError
        If the manifest, or the place for the results, cannot be used; nothing was baked then.
    """
    all_shots = manifest.load(options.manifest)
    shots = manifest.chosen(all_shots, options.shots)
    workplace = Workplace(
        Path(os.path.abspath(options.state or options.manifest.with_suffix(".batch"))), made_by, worker_command
    )
    # tasks of a farm bake a shot each from one state folder: they must not replace each other's reports
    path = options.report or (None if options.shots else workplace.report)
    manifest.check_places(
        all_shots,
        f"Manifest '{options.manifest}'",
        protected={options.manifest: "the manifest"} | workplace.files(all_shots),
        report=options.report or workplace.report,
    )
    if options.report:
        files.check_place(options.report.absolute())
    show = _Show(options.progress, len(shots), options.jobs)
    started = time.monotonic()
    outcomes = run(shots, workplace, jobs=options.jobs, timeout=options.timeout, show=show)
    seconds = time.monotonic() - started
    if options.progress in ("plain", "openjd"):
        print(table(outcomes), flush=True)
    if path:
        files.write_text(path, json.dumps(_report(options.manifest, made_by, outcomes, seconds), indent=2) + "\n")
    return outcomes


def table(outcomes: Sequence[Outcome]) -> str:
    """The outcomes for people: a line each, and one of sums."""
    rows = [("shot", "result", "steps", "depth", "force", "time", "")]
    for outcome in outcomes:
        totals = outcome.totals
        rows.append(
            (
                printable(outcome.shot.name),
                outcome.status + (f" (try {outcome.attempts})" if outcome.attempts > 1 else ""),
                f"{totals['steps']}" if totals else "",
                f"{totals['max_depth_m'] * 100:.1f} cm" if totals else "",
                f"{totals['peak_force_n']:.0f} N" if totals else "",
                f"{outcome.seconds:.1f} s" if outcome.attempts else "",
                printable(outcome.message),
            )
        )
    widths = [max(len(row[column]) for row in rows) for column in range(6)]
    lines = [
        "  ".join(
            (row[0].ljust(widths[0]), row[1].ljust(widths[1]), *(row[i].rjust(widths[i]) for i in range(2, 6)), row[6])
        ).rstrip()
        for row in rows
    ]
    counts = ((status, sum(outcome.status == status for outcome in outcomes)) for status in STATUSES)
    return "\n".join([*lines, ", ".join(f"{count} {status}" for status, count in counts if count)])


def printable(text: str) -> str:
    """A text on one line that every terminal takes."""
    shown = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
    encoding = sys.stdout.encoding or "ascii"
    return shown.encode(encoding, "backslashreplace").decode(encoding)


def _report(path: Path, made_by: str, outcomes: Sequence[Outcome], seconds: float) -> dict[str, Any]:
    return {
        "schema_version": SCHEMA_VERSION,
        "manifest": os.path.abspath(path),
        "made_by": made_by,
        "seconds": round(seconds, 3),
        "totals": {status: sum(outcome.status == status for outcome in outcomes) for status in STATUSES},
        "shots": [
            {
                "name": outcome.shot.name,
                "file": str(outcome.shot.file),
                "status": outcome.status,
                "attempts": outcome.attempts,
                "seconds": round(outcome.seconds, 3),
                "outputs": [str(path) for path in outcome.shot.outputs],
                "totals": outcome.totals,
                "message": outcome.message,
            }
            for outcome in outcomes
        ],
    }


class _Show:
    """Progress of every shot and of the whole, with the remaining time."""

    def __init__(self, style: str, count: int, jobs: int) -> None:
        self._style = style
        self._count = count
        self._jobs = jobs
        self._started = time.monotonic()
        self._fractions: dict[str, float] = {}
        self._seconds: list[float] = []
        self._ended = 0
        self._shown: dict[str, str] = {}

    def __call__(self, event: Step | Outcome) -> None:
        if isinstance(event, Step):
            self._fractions[event.shot.name] = event.fraction
        else:
            self._fractions[event.shot.name] = 1.0
            self._ended += 1
            if event.attempts:
                self._seconds.append(event.seconds)
        if self._style == "json":
            print(json.dumps(self._json(event)), flush=True)
        elif self._style == "openjd":
            share = sum(self._fractions.values()) / self._count * 100
            print(f"openjd_progress: {share:.1f}\nopenjd_status: {printable(event.shot.name)}", flush=True)
        elif self._style == "plain":
            self._plain(event)

    def _seconds_left(self) -> float | None:
        """Remaining time of the whole batch [s], by the time of its shots so far; None before the first has ended."""
        if not self._seconds:
            return None
        mean = sum(self._seconds) / len(self._seconds)
        missing = self._count - sum(self._fractions.values())
        return mean * missing / min(self._jobs, max(1, self._count - self._ended))

    def _json(self, event: Step | Outcome) -> dict[str, Any]:
        said: dict[str, Any] = {"shot": event.shot.name, "ended": self._ended, "of": self._count}
        if isinstance(event, Step):
            said |= {"stage": event.stage, "fraction": event.fraction, "seconds_left": round(event.seconds_left, 1)}
        else:
            said |= {"status": event.status, "message": event.message}
        remaining = self._seconds_left()
        return said | {"batch_seconds_left": None if remaining is None else round(remaining, 1)}

    def _plain(self, event: Step | Outcome) -> None:
        """A line for each quarter of a shot, and for its end."""
        name = printable(event.shot.name)
        place = f"[{self._ended}/{self._count}]"
        if isinstance(event, Step):
            quarter = f"{int(event.fraction * 4) * 25} %"
            if quarter in ("100 %", self._shown.get(name)):
                return
            self._shown[name] = quarter
            rest = f", {_duration(event.seconds_left)} left" if event.fraction >= FIRST_ESTIMATE else ""
            print(f"{place} {name}: {quarter}, {event.stage}{rest}", flush=True)
            return
        seconds = self._seconds_left()
        rest = f"; {_duration(seconds)} for the rest" if seconds and self._ended < self._count else ""
        message = f": {printable(event.message)}" if event.message else ""
        print(f"{place} {name}: {event.status}{message}{rest}", flush=True)


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"


def _count(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of processes from 1 to 1024")
    return int(text)


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < 1e9:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds")
    return seconds
