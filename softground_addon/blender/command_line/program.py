"""The program that we run in: its versions, and the command that starts it again to bake one shot."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from .. import compat

PACKAGE = Path(__file__).parents[3]
"""The folder of the extension, with its manifest."""


def about() -> dict[str, Any]:
    """The extension's manifest."""
    return tomllib.loads((PACKAGE / "blender_manifest.toml").read_text(encoding="utf-8"))


def made_by() -> str:
    """The programs that decide what a bake gives: SoftGround and Blender, with their versions."""
    return f"SoftGround {about()['version']}, Blender {compat.VERSION}"


def worker_command(shot: Path, options: Sequence[str]) -> list[str]:
    """The command line that bakes one shot in a process of its own, by the Blender that we run in."""
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "--background", str(shot), "--command", "softground", "bake", *options]
    package = __package__.rsplit(".", 2)[0]
    return [sys.executable, "-m", package, "bake", str(shot), *options]
