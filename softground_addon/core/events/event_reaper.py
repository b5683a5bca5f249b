"""Events as the table that Reaper's Region/Marker Manager imports, and other editors that read such tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from .events import LANDINGS, Event, label


def dump(events: Sequence[Event]) -> str:
    """The text of the file: contacts are regions, the other phases markers.

    Parameters
    ----------
    events : sequence of Event
        Times are written in minutes and seconds.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["#", "Name", "Start", "End", "Length"])
    counts = {"R": 0, "M": 0}
    for event in events:
        kind = "R" if event["phase"] in LANDINGS else "M"
        counts[kind] += 1
        start, length = max(0.0, event["time_s"]), event["duration_s"]
        region = [_clock(start + length), _clock(length)] if kind == "R" else ["", ""]
        rows.writerow([f"{kind}{counts[kind]}", label(event), _clock(start), *region])
    return text.getvalue()


def _clock(seconds: float) -> str:
    """Minutes, seconds and milliseconds."""
    milliseconds = round(seconds * 1000)
    return f"{milliseconds // 60_000}:{milliseconds // 1000 % 60:02d}.{milliseconds % 1000:03d}"
