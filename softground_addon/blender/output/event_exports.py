"""The events of a bake as files for editors, samplers and game engines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ...core.events import event_files, event_midi
from ...core.events.events import Event, between
from ...core.files import files

Dump = Callable[[Sequence[Event], float], str | bytes]
"""Content of a file from events and frame rate [Hz]."""

KINDS: dict[str, tuple[str, str, str, Dump]] = {
    "EVENTS_JSON": (
        ".jsonl",
        "Events (JSON Lines)",
        "Heel strikes, toe-offs and slides, for game engines",
        lambda table, rate: event_files.json_lines(table, frame_rate=rate),
    ),
    "EVENTS_MIDI": (
        ".mid",
        "Events (MIDI)",
        "Each step as a note, for samplers and drum machines",
        lambda table, _rate: event_midi.dump(table),
    ),
    "EVENTS_REAPER": (
        ".csv",
        "Events (Reaper)",
        "Regions and markers for Reaper",
        lambda table, _rate: event_files.reaper(table),
    ),
    "EVENTS_EDL": (
        ".edl",
        "Events (Resolve)",
        "Timeline markers for DaVinci Resolve",
        lambda table, rate: event_files.edl(table, frame_rate=rate),
    ),
    "EVENTS_OTIO": (
        ".otio",
        "Events (OpenTimelineIO)",
        "Timeline markers for editors",
        lambda table, rate: event_files.otio(table, frame_rate=rate),
    ),
}
"""Formats: suffix, label and description for the user, and the writer."""


def write(table: Sequence[Event], frame_rate: float, kind: str, path: Path, start: int, end: int) -> None:
    """Write the events of some frames, times counted from the first; `frame_rate` in Hz.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    content = KINDS[kind][3](between(table, start, end, frame_rate), frame_rate)
    with files.replacing(path) as partial:
        partial.write_bytes(content.encode() if isinstance(content, str) else content)
