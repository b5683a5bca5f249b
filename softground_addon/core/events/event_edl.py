"""Events as an edit decision list with markers, as DaVinci Resolve imports it onto a timeline."""

from __future__ import annotations

from collections.abc import Sequence

from .events import LANDINGS, Event, label

FIRST_HOUR = 1
"""Hour at which a timeline of Resolve begins by default."""


def dump(events: Sequence[Event], *, frame_rate: float) -> str:
    """The text of the file: a cut of one frame for each event, with a marker in blue for landings.

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
