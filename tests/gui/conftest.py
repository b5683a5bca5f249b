"""A real Blender on a virtual screen, with the packaged add-on installed as a user would.

Each story (`tests/gui/stories`) is told once per Blender; tests look at what it noted down. Pictures of it stay in
`build/gui`; the docs show some of them (`make pictures`).
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from functools import cache, lru_cache
from pathlib import Path

import pytest

from release import package

REPOSITORY = Path(__file__).parents[2]
TOOL = REPOSITORY.parent / "shared" / "tools" / "real_blender.sh"
PROVISIONED = Path(os.environ.get("REAL_BLENDER_ROOT", "/var/tmp/real-blender"))
OUTPUT = REPOSITORY / "build" / "gui"
PACKAGE = REPOSITORY / "build" / "softground.zip"
SUITES = ("trixie", "sid")
"""Blender 4.3, which is always to be had, and the newest one where it was provisioned."""

WORKER = os.environ.get("PYTEST_XDIST_WORKER", "alone")
"""Which of the processes that share the tests this is; each has a Blender with a home of its own."""

STORY_SECONDS = 1200
"""Longest story on a machine that does other things too; a quiet one takes a minute or two."""

WINDOWS = {
    "at_rest": (640, 480),
    "edit_steps": (1100, 760),
    "held_windows": (1100, 760),
    "interrupted_bake": (1100, 760),
    "undo_and_redo": (1100, 760),
    "pauses": (640, 480),
    "buttons": (1100, 760),
    "live_answers": (1100, 760),
    "first_minutes": (1100, 760),
    "first_prints": (880, 600),
    "filmed": (880, 600),
}
"""Width and height of the window of stories that do not want all of the screen [px]: a small one is drawn sooner; that
of the first minutes leaves 600 px to the sidebar."""

PREFERENCES = """
import bpy
preferences = bpy.context.preferences
preferences.view.show_splash = False
preferences.use_preferences_save = False
bpy.ops.wm.save_userpref()
"""


@lru_cache(maxsize=1)
def built() -> Path:
    """The package as users get it, built and validated by Blender's own tool."""
    package.build(PACKAGE)
    return PACKAGE


def home(suite: str) -> Path:
    """Where the suite's Blender keeps its preferences and extensions."""
    return OUTPUT / suite / "home" / WORKER


def blender(suite: str, verb: str, *arguments: str, seconds: int = 600) -> str:
    """Run the suite's Blender in its own home; returns what it printed."""
    environment = {**os.environ, "REAL_BLENDER_HOME": str(home(suite)), "TMPDIR": str(OUTPUT / suite)}
    command = [str(TOOL), verb, suite, *arguments]
    done = subprocess.run(
        command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=seconds, check=False
    )
    return done.stdout + done.stderr


@cache
def installed(suite: str) -> str:
    """Install the package in a fresh home; returns what Blender printed when it started with it."""
    shutil.rmtree(home(suite), ignore_errors=True)
    home(suite).mkdir(parents=True)
    message = blender(suite, "run", "--command", "extension", "install-file", "-r", "user_default", "-e", str(built()))
    assert "Installed" in message, message
    return blender(suite, "run", "-b", "--python-expr", PREFERENCES)


@cache
def facts_of(suite: str, story: str) -> dict:
    """What a story noted down; told once."""
    installed(suite)
    folder = OUTPUT / suite / story
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    teller = str(REPOSITORY / "tests" / "gui" / "teller.py")
    window = ("--window-geometry", "0", "0", *map(str, WINDOWS[story])) if story in WINDOWS else ()
    arguments = ("--enable-event-simulate", "--python", teller, "--", str(REPOSITORY), story, str(folder))
    printed = blender(suite, "gui", *window, *arguments, seconds=STORY_SECONDS)
    (folder / "printed.txt").write_text(printed, encoding="utf-8")
    facts = folder / "facts.json"
    noted = json.loads(facts.read_text(encoding="utf-8")) if facts.is_file() else {}
    if not noted.keys() & {"finished", "error"}:
        noted["error"] = f"Blender ended before the story, which knew {noted}"
    return {**noted, "printed": printed}


@pytest.fixture(scope="session", params=SUITES)
def suite(request):
    if not TOOL.is_file():
        pytest.skip(f"no real Blender to be had: {TOOL} is not here")
    if not (PROVISIONED / request.param / ".ready").is_file():
        if request.param != "trixie":
            pytest.skip(f"Blender of {request.param} is not here: `{TOOL.name} provision {request.param}` gets it")
        if os.geteuid() != 0 or shutil.which("debootstrap") is None:
            pytest.skip("a real Blender is provisioned with root rights and debootstrap: apt-get install debootstrap")
        subprocess.run([str(TOOL), "provision", request.param], check=True, timeout=1200, cwd=REPOSITORY)
    return request.param


@pytest.fixture(scope="session")
def tell(suite):
    def facts(story: str) -> dict:
        noted = facts_of(suite, story)
        assert "error" not in noted, f"{noted['error']}\n{noted['printed'][-2000:]}"
        return noted

    return facts
