"""Each test starts in an empty file with the add-on registered, and leaves nothing registered behind."""

import bpy
import pytest

import softground_addon


@pytest.fixture(scope="session")
def addon():
    softground_addon.register()
    yield
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.unregister()


@pytest.fixture
def scene(addon):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene
