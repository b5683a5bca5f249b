"""Copy Bake Command: what is pasted into a terminal bakes what the button bakes."""

import subprocess
from pathlib import Path

import bpy
import pytest

from softground_addon.blender.ground import ground_mesh
from softground_addon.blender.setup import shot_setup as operators
from tests.blender import fingerprints, shots

ROOT = Path(__file__).parents[3]


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def baked_ground():
    """The pressed ground in the open file, as values that can be compared."""
    (mesh,) = [mesh for mesh in bpy.data.meshes if ground_mesh.RECORD in mesh.keys()]  # noqa: SIM118
    return mesh.name, fingerprints.of_mesh(mesh) | {"properties": None}, bytes(mesh[ground_mesh.RECORD])


def run(command):
    done = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_copied_command_bakes_what_the_button_bakes_whatever_the_names(scene, tmp_path):
    name = 'it\'s "$HOME" `x` %s\n❄'
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Mud")
    scene.softground.characters[0].mass = 93.0
    scene.softground.frame_start = 5
    scene.softground.cell_size = 0.02
    folder = tmp_path / name
    folder.mkdir()
    shot = folder / f"{name}.blend"
    save(shot)
    command = operators.bake_command(scene)
    bpy.ops.softground.bake()
    pressed = baked_ground()
    content = shot.read_bytes()
    run(command)
    assert shot.read_bytes() == content
    bpy.ops.wm.open_mainfile(filepath=str(folder / f"{name}-baked.blend"))
    assert baked_ground() == pressed


@pytest.mark.slow
def test_the_command_bakes_the_scene_that_it_was_copied_in(scene, tmp_path):
    scene.name = "Other"
    shots.walker(scene, frames=30)
    bpy.context.window.scene = second = bpy.data.scenes.new("It's this one")
    shots.walker(second, frames=30, speed=1.1)
    bpy.ops.softground.add_character()
    bpy.context.window.scene = scene
    save(tmp_path / "shot.blend")
    run(operators.bake_command(second))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot-baked.blend"))
    assert bpy.data.scenes["Other"].softground.ground is None
    assert ground_mesh.is_baked(bpy.data.scenes["It's this one"].softground.ground)
    assert bpy.context.scene.name == "Other"


def test_a_file_that_was_never_saved_has_no_command(scene, tmp_path):
    assert not bpy.ops.softground.copy_bake_command.poll()
    with pytest.raises(RuntimeError, match="poll"):
        bpy.ops.softground.copy_bake_command()
    save(tmp_path / "shot.blend")
    assert bpy.ops.softground.copy_bake_command() == {"FINISHED"}
