"""Events as JSON lines: one object in each line, the first of which gives the units of the others."""

from __future__ import annotations

import json
from collections.abc import Sequence

from .events import COLUMNS, Event

SCHEMA_VERSION = 1


def dump(events: Sequence[Event], *, frame_rate: float) -> str:
    """The text of the file.

    Parameters
    ----------
    frame_rate : float
        Scene frames per second [Hz].
    """
    head = {"softground_events": SCHEMA_VERSION, "frame_rate": frame_rate, "columns": COLUMNS}
    return "".join(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in (head, *events))
