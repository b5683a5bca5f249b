"""Each test starts in an empty file with the add-on registered."""

import shutil
import subprocess

import bpy
import pytest

from tests.blender import rigs, shots


@pytest.fixture
def scene(addon):
    # Not `read_factory_settings`, which takes five times as long: it also enables all of Blender's add-ons anew.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene


@pytest.fixture(scope="session")
def opened_as(addon, tmp_path_factory):
    """Opens a scene as a function of it leaves it, which is called once and from then on read from a file."""
    files = {}

    def opened(function, *arguments):
        key = (function, *arguments)
        if key not in files:
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            function(bpy.context.scene, *arguments)
            files[key] = tmp_path_factory.mktemp("scene") / "scene.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(files[key]), copy=True)
        bpy.ops.wm.read_homefile(filepath=str(files[key]))  # as a new file, which is not saved anywhere
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
def rigify_file(addon, tmp_path_factory):
    """Rigify's human and its metarig."""
    path = tmp_path_factory.mktemp("rigify") / "human.blend"
    rigs.make_rigify_file(path)
    return path


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
