"""SoftGround's command line in a process of its own, with the bpy module."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def command(*arguments: object) -> list[str]:
    """What a terminal runs."""
    return [sys.executable, "-m", "softground_addon", *map(str, arguments)]


def run(*arguments: object, timeout: float = 600, **how: Any) -> subprocess.CompletedProcess[str]:
    """Run it to its end and keep what it prints."""
    return subprocess.run(
        command(*arguments), cwd=ROOT, capture_output=True, text=True, timeout=timeout, check=False, **how
    )


def begin(*arguments: object, **how: Any) -> subprocess.Popen[str]:
    """Run it beside the test."""
    return subprocess.Popen(command(*arguments), cwd=ROOT, text=True, **how)
