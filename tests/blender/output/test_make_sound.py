"""Make Sound: the file beside the .blend, and its strip in the sequencer."""

import wave

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat
from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import baked_ground
from tests.blender import shots

needs_sound = pytest.mark.skipif(not compat.PLAYS_SOUND, reason="this bpy module was built without sound")


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    scene.softground.frame_start = 5
    bpy.ops.softground.bake()
    path = tmp_path_factory.mktemp("sound") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def scene(baked, tmp_path):
    path = tmp_path / "shot.blend"
    path.write_bytes(baked.read_bytes())
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def read(path):
    with wave.open(str(path)) as file:
        channels, content = file.getnchannels(), file.readframes(file.getnframes())
    return np.frombuffer(content, np.uint8).reshape(-1, channels, 3)[:, :, 2].astype(np.int8)


def test_the_sound_is_written_beside_the_file_and_starts_where_the_feet_strike(scene, tmp_path):
    assert bpy.ops.softground.make_sound() == {"FINISHED"}
    heard = np.abs(read(tmp_path / "shot_footsteps.wav")[:, 0])
    assert len(heard) == 44 / 24 * 48_000
    strikes = [
        row["time_s"] for row in baked_ground.events_of(scene.softground.ground) if row["phase"] == "heel_strike"
    ]
    assert len(strikes) >= 2
    for strike in strikes:
        around = heard[round((strike + 0.002) * 48_000) :][:2000]
        assert around.max() > 3


@needs_sound
def test_a_strip_plays_it_from_the_first_frame_of_the_bake(scene, tmp_path):
    strips = compat.strips_of(scene)
    mine = strips.new_sound("mine", str(write_tone(tmp_path / "tone.wav")), 1, 1)
    for _ in range(2):  # the second takes the place of the first
        assert bpy.ops.softground.make_sound() == {"FINISHED"}
    ours = [strip for strip in compat.strips_of(scene) if strip.name.startswith("SoftGround")]
    assert len(ours) == 1
    assert (ours[0].frame_start, ours[0].channel) == (5, 2)
    assert ours[0].frame_duration == pytest.approx(44, abs=1)
    assert ours[0].sound.filepath.endswith("shot_footsteps.wav")
    assert mine.name == "mine"


def test_a_file_that_is_another_is_replaced_only_when_that_is_asked_for(scene, tmp_path):
    mine = write_tone(tmp_path / "shot_footsteps.wav")
    before = mine.read_bytes()
    with pytest.raises(RuntimeError, match=r"There is a 'shot_footsteps\.wav' already: tick Replace File"):
        bpy.ops.softground.make_sound()
    assert mine.read_bytes() == before
    assert not compat.strips_of(scene)
    assert bpy.ops.softground.make_sound(replace=True) == {"FINISHED"}
    assert mine.read_bytes() != before


@needs_sound
def test_what_its_own_strip_plays_is_made_again_without_a_question_and_what_another_plays_is_not(scene, tmp_path):
    for _ in range(2):
        assert bpy.ops.softground.make_sound() == {"FINISHED"}
    (strip,) = compat.strips_of(scene)
    strip.name = "mine"
    with pytest.raises(RuntimeError, match="tick Replace File"):
        bpy.ops.softground.make_sound()


def write_tone(path):
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(48_000)
        file.writeframes(np.full(4800, 1000, "<i2").tobytes())
    return path


def test_a_file_that_is_not_saved_is_asked_for(scene):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.03
    bpy.ops.softground.bake()
    with pytest.raises(RuntimeError, match="save the file first"):
        bpy.ops.softground.make_sound()


@pytest.mark.slow
def test_the_command_line_writes_it_in_stereo_from_the_camera(scene, tmp_path):
    assert cli.run_in_blender(["export", "--format", "wav", "--stereo"]) == cli.EXIT_BAD_INPUT  # there is no camera
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.location = (0.0, -4.0, 1.0)
    camera.rotation_euler = (np.pi / 2, 0.0, -np.pi / 2)  # looks along x: the walk is to its left, or to its right
    bpy.context.view_layer.update()
    frame = scene.frame_current
    assert cli.run_in_blender(["export", "--format", "wav", "--stereo", "--output", str(tmp_path / "a.wav")]) == 0
    left, right = np.abs(read(tmp_path / "a.wav").astype(float)).mean(axis=0)
    footprints, _ = baked_ground.load(scene.softground.ground)
    sides = [(camera.matrix_world.inverted() @ bpy_vector(footprint.position)).x for footprint in footprints]
    assert (left > right) == (np.mean(sides) < 0)
    assert scene.frame_current == frame


def bpy_vector(place):
    from mathutils import Vector

    return Vector(place.tolist())


def test_own_sounds_come_from_a_folder_and_an_empty_one_is_named(scene, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    with pytest.raises(RuntimeError, match="no WAV file in"):
        bpy.ops.softground.make_sound(samples=str(folder))
    write_tone(folder / "snow_1.wav")
    assert bpy.ops.softground.make_sound(samples=str(folder)) == {"FINISHED"}
    heard = read(tmp_path / "shot_footsteps.wav")[:, 0]
    assert len(np.unique(heard)) < 10  # plateaus of the one recording


def test_own_sounds_are_not_written_over(scene, tmp_path):
    recording = tmp_path / "mine" / "snow_1.wav"
    recording.parent.mkdir()
    write_tone(recording)
    before = recording.read_bytes()
    (tmp_path / "again.wav").symlink_to(recording)
    for target in (recording, tmp_path / "again.wav"):
        options = ["export", "--format", "wav", "--samples", str(recording.parent), "--output", str(target)]
        assert cli.run_in_blender(options) == 2
    assert recording.read_bytes() == before
