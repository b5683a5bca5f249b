"""Events as text for other programs: JSON lines, tables and timelines."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from typing import Any

from .events import COLUMNS, LANDINGS, Event, label

SCHEMA_VERSION = 1


def json_lines(events: Sequence[Event], *, frame_rate: float) -> str:
    """Events as JSON lines: one object in each, the first of which gives the units of the others.

    Parameters
    ----------
    frame_rate : float
        Scene frames per second [Hz].
    """
    head = {"softground_events": SCHEMA_VERSION, "frame_rate": frame_rate, "columns": COLUMNS}
    return "".join(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in (head, *events))


FIRST_HOUR = 1
"""Hour at which a timeline of Resolve begins by default."""


def edl(events: Sequence[Event], *, frame_rate: float) -> str:
    """An edit decision list, as DaVinci Resolve imports it: a cut of a frame for each event, markers blue for landings.

    Parameters
    ----------
    frame_rate : float
        Scene frames per second [Hz]; timecode counts whole ones.
    """
    rate = max(1, round(frame_rate))
    lines = ["TITLE: SoftGround", "FCM: NON-DROP FRAME", ""]
    for number, event in enumerate(events, 1):
        frame = max(0, round(event["time_s"] * frame_rate)) + FIRST_HOUR * 3600 * rate
        start, end = _timecode(frame, rate), _timecode(frame + 1, rate)
        colour = "Blue" if event["phase"] in LANDINGS else "Cyan"
        lines.append(f"{number:03d}  001      V     C        {start} {end} {start} {end}  ")
        lines.append(f" |C:ResolveColor{colour} |M:{label(event).replace('|', '/')} |D:1")
        lines.append("")
    return "\n".join(lines) + "\n"


def _timecode(frame: int, rate: int) -> str:
    seconds, frames = divmod(frame, rate)
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}:{frames:02d}"


def reaper(events: Sequence[Event]) -> str:
    """The table that Reaper's Region/Marker Manager imports: contacts are regions, the other phases markers."""
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


def otio(events: Sequence[Event], *, frame_rate: float) -> str:
    """An OpenTimelineIO timeline: markers on an empty track, with all of an event in its metadata, under `softground`.

    Parameters
    ----------
    frame_rate : float
        Scene frames per second [Hz].

    References
    ----------
    OpenTimelineIO file format, https://opentimelineio.readthedocs.io: schemas Timeline.1, Stack.1, Track.1, Gap.1 and
    Marker.2.
    """
    end = max((event["time_s"] + event["duration_s"] for event in events), default=0.0)
    gap = {**_named("Gap.1", ""), "source_range": _range(0.0, end, frame_rate), "effects": [], "markers": []}
    markers = [_marker(event, frame_rate) for event in events]
    track = {**_named("Track.1", "SoftGround"), "kind": "Audio", "children": [gap], "markers": markers}
    track |= {"source_range": None, "effects": []}
    stack = {**_named("Stack.1", "tracks"), "children": [track], "source_range": None, "effects": [], "markers": []}
    timeline = {**_named("Timeline.1", "SoftGround"), "global_start_time": None, "tracks": stack}
    return json.dumps(timeline, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _marker(event: Event, rate: float) -> dict[str, Any]:
    return {
        **_named("Marker.2", label(event)),
        "metadata": {"softground": dict(event)},
        "color": "BLUE" if event["phase"] in LANDINGS else "CYAN",
        "marked_range": _range(event["time_s"], event["duration_s"] if event["phase"] in LANDINGS else 0.0, rate),
    }


def _range(start: float, length: float, rate: float) -> dict[str, Any]:
    return {"OTIO_SCHEMA": "TimeRange.1", "start_time": _time(start, rate), "duration": _time(length, rate)}


def _time(seconds: float, rate: float) -> dict[str, Any]:
    return {"OTIO_SCHEMA": "RationalTime.1", "rate": rate, "value": round(seconds * rate, 4)}


def _named(schema: str, name: str) -> dict[str, Any]:
    return {"OTIO_SCHEMA": schema, "metadata": {}, "name": name}
