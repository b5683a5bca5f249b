"""The add-on comes and goes as a whole."""

import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from softground_addon.blender import registration
from softground_addon.blender.panels import menus


@pytest.fixture
def nothing_registered(addon):
    registration.unregister()
    yield
    registration.register()


ROOT = Path(__file__).parents[3]


def is_registered():
    return hasattr(bpy.types.Scene, "softground"), bool(bpy.types.Operator.bl_rna_get_subclass_py("SOFTGROUND_OT_bake"))


def test_registering_and_unregistering_can_be_repeated(nothing_registered):
    for _ in range(3):
        assert is_registered() == (False, False)
        registration.register()
        assert is_registered() == (True, True)
        registration.unregister()


def test_an_error_half_way_leaves_nothing_behind(nothing_registered, monkeypatch):
    def fail():
        raise ZeroDivisionError

    with monkeypatch.context() as broken:
        broken.setattr(menus, "register", fail)
        with pytest.raises(ZeroDivisionError):
            registration.register()
    assert is_registered() == (False, False)


ENABLED = """
import sys
import bpy
import softground_addon


def run():
    ours = {name: module for name, module in sys.modules.items() if name.startswith("softground_addon.")}
    return {name.partition(".")[2] for name, module in ours.items() if "NotYetRun" not in type(module).__name__}


bpy.ops.wm.read_factory_settings()
for _ in range(2):
    softground_addon.register()
    enabled = run()
    bpy.data.objects["Cube"].location.x += 1.0
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(2)
    bpy.ops.wm.read_factory_settings()
    for handlers in (bpy.app.handlers.undo_post, bpy.app.handlers.render_init, bpy.app.handlers.render_complete):
        handlers[-1](bpy.context.scene)
    softground_addon.unregister()
    print(*(enabled | run()))
"""


FAILING = """
import sys
import bpy
import softground_addon


class Aged:
    \"\"\"A finder as Python had them before 3.4, and some libraries that add-ons bring along still have.\"\"\"

    find_module = staticmethod(lambda name, path=None: None)


sys.meta_path.insert(0, Aged)
softground_addon.register()
module = sys.modules["softground_addon.blender.baking.bake_job"]
names = set(vars(module))
composers, sys.modules["softground_addon.core.composers"] = sys.modules["softground_addon.core.composers"], None
for _ in range(2):
    try:
        module.bake
    except ImportError as error:
        print(error)
    assert set(vars(module)) == names
sys.modules["softground_addon.core.composers"] = composers
assert callable(module.bake)
softground_addon.unregister()
"""


@pytest.mark.slow
def test_a_module_that_fails_at_first_use_says_so_each_time_and_runs_once_it_can(tmp_path):
    program = tmp_path / "failing.py"
    program.write_text(FAILING)
    paths = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"}
    finished = subprocess.run([sys.executable, program], env=paths, capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    assert [line.count("pressed_shot") for line in finished.stdout.splitlines()] == [1, 1]


@pytest.mark.slow
def test_enabling_runs_no_module_that_bakes_nor_does_anything_without_a_ground(tmp_path):
    program = tmp_path / "enabled.py"
    program.write_text(ENABLED)
    paths = os.environ | {"PYTHONPATH": str(ROOT)}
    finished = subprocess.run([sys.executable, program], env=paths, capture_output=True, text=True, check=True)
    first, second = (set(line.split()) for line in finished.stdout.splitlines() if "blender.registration" in line)
    assert first == second >= {"blender.registration", "core.settings"}
    assert not [name for name in first if name.startswith(("core.pressing.", "core.relief.", "blender.reading."))]
    assert len(first) < 170
