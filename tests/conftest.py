"""What tests of several folders need."""

import pytest


@pytest.fixture(scope="session")
def addon():
    """SoftGround switched on until the last test: registered once, since Blender knows no second of the same."""
    bpy = pytest.importorskip("bpy", reason="this needs Blender: pip install bpy==4.5.15")
    import softground_addon

    softground_addon.register()
    yield
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.unregister()
