"""The command line of a real Blender with the installed package: `blender --command softground`."""

import json
import shutil

import pytest

from tests.gui import conftest

pytestmark = pytest.mark.gui

MAKE_SHOT = """
import sys
sys.path.insert(0, {repository!r})
import bpy
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
bpy.ops.wm.read_factory_settings(use_empty=True)
body = Body()
armature = create_character("Walker", body, bpy.context.scene.collection)
write_action(armature, walk(body, Gait(), 40, 24), "Walk")
bpy.ops.wm.save_as_mainfile(filepath={shot!r})
"""


def test_a_batch_is_baked_and_then_skipped(suite):
    conftest.installed(suite)
    folder = conftest.OUTPUT / suite / "batch"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shot = str(folder / "a.blend")
    script = MAKE_SHOT.format(repository=str(conftest.REPOSITORY), shot=shot)
    conftest.blender(suite, "run", "-b", "--python-expr", script)
    shutil.copy(shot, folder / "b.blend")
    manifest = folder / "night.toml"
    manifest.write_text("defaults.save = 'baked/{name}.blend'\nshots = [{ files = '*.blend' }]")
    command = ("run", "-b", "--command", "softground", "batch", str(manifest), "--jobs", "2")
    for status in ("done", "skipped"):
        printed = conftest.blender(suite, *command)
        report = folder / "night.batch" / "batch.json"
        assert report.is_file(), printed
        assert json.loads(report.read_text())["totals"][status] == 2, printed
        assert "softground_addon/" not in printed  # as in a traceback
    assert {path.name for path in (folder / "baked").iterdir()} == {"a.blend", "b.blend"}
