"""Each benchmark of Blender starts in an empty file with the add-on registered, and unregisters it for the others."""

import pytest

from tests.benchmarks import bars


@pytest.fixture
def scene():
    bpy = pytest.importorskip("bpy", reason="this needs Blender: pip install bpy==4.5.15")
    import softground_addon

    softground_addon.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy.context.scene
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.unregister()


def pytest_terminal_summary(terminalreporter):
    """The table of what was measured."""
    if bars.ROWS:
        terminalreporter.section("measured, and the most that it may be")
        for line in bars.table():
            terminalreporter.write_line(line)
