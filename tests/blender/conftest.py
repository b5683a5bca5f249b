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
def added_walker(addon, tmp_path_factory):
    """Opens a scene with a character that walks for so many frames, ready to be baked; each is set up once."""
    files = {}

    def opened(frames):
        if frames not in files:
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            shots.walker(bpy.context.scene, frames=frames)
            bpy.ops.softground.add_character()
            files[frames] = tmp_path_factory.mktemp("walk") / "walk.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(files[frames]), copy=True)
        bpy.ops.wm.read_homefile(filepath=str(files[frames]))  # as a new file, which is not saved anywhere
        return bpy.context.scene

    return opened


@pytest.fixture
def walk(added_walker):
    """A scene with a character that walks, ready to be baked."""
    return added_walker(72)


@pytest.fixture
def short_walk(added_walker):
    """A short walk to be baked with coarse cells."""
    scene = added_walker(30)
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
