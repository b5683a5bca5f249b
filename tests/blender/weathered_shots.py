"""Bakes of a short walk that weather may take for any surface."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from softground_addon.blender.weather import weather_regions
from softground_addon.core.weather.weather import matter_of
from tests.blender import shots

SOME = {"Snowfall": 2.0, "Temperature": 1.5, "Wind": 8.0, "Rain": 30.0, "Drying": 0.4, "Time Scale": 900.0}
"""Sliders of several processes."""


def added_walker(scene: bpy.types.Scene) -> None:
    """A character that walks in snow, to be baked with coarse cells."""
    shots.walker(scene, frames=34)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Snow")
    scene.softground.cell_size, scene.softground.debris = 0.02, False


def opened_as(surface: str, baked: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> bpy.types.Scene:
    """A baked file opened from a folder of the test's own, with weather that takes its ground for some surface."""
    path = folder / "shot.blend"
    path.write_bytes(baked.read_bytes())
    bpy.ops.wm.open_mainfile(filepath=str(path))
    monkeypatch.setattr(weather_regions, "matter_of", lambda _, *of_bake: matter_of(surface, *of_bake))
    return bpy.context.scene
