"""Each test starts in an empty file with the add-on registered."""

import fcntl
import os
import shutil
import subprocess

import bpy
import pytest

from softground_addon.blender import session
from tests.blender import rigs, shots


@pytest.fixture
def scene(addon):
    # Not `read_factory_settings`, which takes five times as long: it also enables all of Blender's add-ons anew.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    session.show_no_bake()  # of a test that failed before
    return bpy.context.scene


@pytest.fixture(scope="session")
def made_once(addon, tmp_path_factory):
    """The file of a name that a function of its path makes, once for all processes that test side by side."""
    folder = tmp_path_factory.getbasetemp()
    folder = folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder

    def made(name, make):
        path = folder / f"{name}.blend"
        with path.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not path.exists():
                make(path)
        return path

    return made


@pytest.fixture(scope="session")
def opened_as(made_once):
    """Opens a scene as a function of it leaves it, which is called once and from then on read from a file."""

    def opened(function, *arguments):
        def make(path):
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            function(bpy.context.scene, *arguments)
            bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)

        file = made_once("-".join(map(str, (function.__module__, function.__name__, *arguments))), make)
        bpy.ops.wm.read_homefile(filepath=str(file))  # as a new file, which is not saved anywhere
        session.show_no_bake()
        return bpy.context.scene

    return opened


def added_walker(scene, frames):
    shots.walker(scene, frames=frames)
    bpy.ops.softground.add_character()


@pytest.fixture
def walk(opened_as):
    """A scene with a character that walks, ready to be baked."""
    return opened_as(added_walker, 72)


@pytest.fixture
def short_walk(opened_as):
    """A short walk to be baked with coarse cells."""
    scene = opened_as(added_walker, 30)
    scene.softground.cell_size = 0.02
    return scene


@pytest.fixture(scope="session")
def saved_walker(addon, tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    shots.walker(bpy.context.scene, frames=40)
    path = tmp_path_factory.mktemp("shot") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture(scope="session")
def rigify_file(made_once):
    """Rigify's human and its metarig."""
    return made_once("rigify", rigs.make_rigify_file)


@pytest.fixture
def shot(scene, saved_walker, tmp_path):
    """A saved file with an animated character and nothing of ours in it; another file is open."""
    return shutil.copy(saved_walker, tmp_path / "shot.blend")


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 200 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=200k", "none", str(folder)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("cannot mount a file system here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)
