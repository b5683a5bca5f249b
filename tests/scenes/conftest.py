"""Scenes need Blender; each test starts from an empty file."""

import pytest


@pytest.fixture
def scene():
    bpy = pytest.importorskip("bpy", reason="the sample scenes are built in Blender: pip install bpy==4.5.15")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene
