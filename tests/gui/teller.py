"""Tells one story in a real Blender: `blender --python teller.py -- REPOSITORY STORY OUTPUT`. Quits when it is told.

A story is a generator function in `tests/gui/stories`; what it notes down is written to OUTPUT/facts.json.
"""

from __future__ import annotations

import importlib
import json
import sys
import traceback
from pathlib import Path

import bpy

repository, name, output = sys.argv[sys.argv.index("--") + 1 :]
sys.path.insert(0, repository)

from tests.gui.hand import Hand  # noqa: E402  (the path to it is only known now)

folder = Path(output)
facts: dict[str, object] = {}


def tell():
    story = importlib.import_module(f"tests.gui.stories.{name}")
    yield from story.tell(Hand(folder), facts)


telling = tell()


def note() -> None:
    """Write down what is known, as Blender might not live until the end."""
    (folder / "facts.json").write_text(json.dumps(facts, indent=2, default=str), encoding="utf-8")


def go_on() -> float | None:
    try:
        pause = next(telling)
        note()
        return pause
    except StopIteration:
        facts["finished"] = True
    except Exception:
        facts["error"] = traceback.format_exc()
    note()
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(go_on, first_interval=1.0, persistent=True)
