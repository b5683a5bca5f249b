"""A bake that is left at any of its steps has changed nothing."""

import bpy
import pytest

from softground_addon.blender import bake_job, jobs, modal_bake, session
from softground_addon.core.errors import InputError
from tests.blender import fingerprints
from tests.blender.shots import walker


@pytest.mark.parametrize("own_ground", [False, True])
def test_a_bake_left_at_any_step_but_the_last_leaves_the_file_as_it_was(scene, own_ground):
    walker(scene, frames=24)
    bpy.ops.softground.add_character()
    if own_ground:
        bpy.ops.softground.create_ground()
    before = fingerprints.of_file()
    stages = set()
    for steps in (1, 2, 10, 24, 25, 30, 40, *range(45, 400)):
        job = bake_job.bake(scene)
        try:
            progress = [next(job) for _ in range(steps)][-1]
        except StopIteration:
            break
        job.close()
        if progress.overall >= 1.0:
            break
        stages.add(progress.stage)
        assert fingerprints.of_file() == before, progress
    assert stages == {"sample", "simulate", "write"}


def pictures_of(scene, folder):
    """The pixels of a small render of frame 20."""
    scene.frame_set(20)
    scene.render.filepath = str(folder / "frame.png")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(folder / "frame.png"))
    pixels = list(image.pixels)
    bpy.data.images.remove(image)
    return pixels


def test_renders_between_the_steps_of_a_bake_change_neither(scene, tmp_path):
    walker(scene, frames=24)
    bpy.ops.softground.add_character()
    bpy.ops.softground.create_ground()
    scene.collection.objects.link(camera := bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
    camera.location, scene.camera = (0.3, 0, 4), camera
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x = scene.render.resolution_y = 16
    picture = pictures_of(scene, tmp_path)
    undisturbed = jobs.run(bake_job.bake(scene, write=False)).report
    job, rendered = bake_job.bake(scene), 0
    try:
        for step in range(1000):
            progress = next(job)
            if step % 12 == 0 and progress.overall < 1.0:
                assert pictures_of(scene, tmp_path) == picture
                rendered += 1
    except StopIteration as finished:
        result = finished.value.report
    assert rendered >= 4
    assert (result["steps"], result["input_hash"]) == (undisturbed["steps"], undisturbed["input_hash"])


def test_no_bake_and_no_live_mode_begins_during_a_render(scene, monkeypatch):
    walker(scene, frames=24)
    bpy.ops.softground.add_character()
    assert bpy.ops.softground.bake.poll()
    assert bpy.ops.softground.live.poll()
    monkeypatch.setattr(session, "is_rendering", lambda: True)
    assert not bpy.ops.softground.bake.poll()
    assert not bpy.ops.softground.live.poll()


def test_what_was_deleted_under_a_bake_is_named(scene):
    armature = walker(scene, frames=24)
    bpy.ops.softground.add_character()
    needed = modal_bake._read_by_bake(scene)
    armature.name = "Renamed"
    modal_bake._check_still_there(needed)
    bpy.data.objects.remove(armature)
    with pytest.raises(InputError, match="'Walker' was deleted"):
        modal_bake._check_still_there(needed)


def test_a_bake_with_detail_left_before_its_last_step_leaves_nothing(scene):
    walker(scene, frames=24)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    scene.softground.ground = bpy.context.object
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    # How many steps there are depends on the machine, except for the last ones, in which the fine copy is made.
    for fraction, further in ((0.3, 0), (0.4, 0), (0.5, 0), (0.7, 0), (0.9, 0), (0.9, 1), (0.9, 2)):
        job = bake_job.bake(scene)
        last = next(progress for progress in job if progress.stage == "write" and progress.fraction >= fraction)
        for _ in range(further):
            last = next(job)
        assert last.fraction < 1.0
        job.close()
        assert fingerprints.of_file() == before, last
