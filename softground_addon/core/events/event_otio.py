"""Events as an OpenTimelineIO timeline: markers on an empty track.

References
----------
OpenTimelineIO file format, https://opentimelineio.readthedocs.io: schemas Timeline.1, Stack.1, Track.1, Gap.1 and
Marker.2.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from .events import LANDINGS, Event, label


def dump(events: Sequence[Event], *, frame_rate: float) -> str:
    """The text of the file. All that is known of an event is in its marker's metadata, under `softground`.

    Parameters
    ----------
    frame_rate : float
        Scene frames per second [Hz].
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
