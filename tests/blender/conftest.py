"""Each test starts in an empty file with the add-on registered."""

import bpy
import pytest


@pytest.fixture
def scene(addon):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene
