"""Relief on baked grounds: in what is shown, not in what is computed, and nothing of it where it is off."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.playback import own_data
from softground_addon.core.record import record
from tests.blender import shots
from tests.blender.grounds import as_rendered, bake, heights, plane


@pytest.fixture(scope="module")
def baked(addon):
    """Heights of one walk without relief, with it, and from close by; and what the last plays."""
    values = {}
    for relief in ("OFF", "FINE", "CLOSE_UP"):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        shots.walker(scene, frames=24)
        bpy.ops.softground.add_character()
        bpy.ops.softground.load_preset(name="Soil")
        if relief != "CLOSE_UP":
            scene.softground.ground = plane(scene, size=3.0, vertices=200)
        bake(scene, cell_size=0.01, relief=relief, detail="NEVER" if relief != "CLOSE_UP" else "AUTO", tread=0.003)
        ground = scene.softground.ground
        stored = record.load(ground.data[ground_mesh.RECORD].to_list() and bytes(ground.data[ground_mesh.RECORD]))
        frames = {}
        for frame in (24, 9, 17, 16, 9, 24):
            scene.frame_set(frame)
            frames.setdefault(frame, []).append(as_rendered(ground))
        shown = heights(ground, "SoftGround Display")
        values[relief] = (heights(ground), shown, stored.footprints, frames, ground.data.attributes.keys())
    return values


@pytest.mark.slow
def test_what_is_computed_is_the_same_with_it_and_what_is_shown_is_not(baked):
    (raw, shown, steps, _, _), (raw_with, shown_with, steps_with, _, _) = baked["OFF"], baked["FINE"]
    assert np.array_equal(raw, raw_with)
    for step, same in zip(steps, steps_with, strict=True):
        assert np.array_equal(step.tile(step.compression), same.tile(same.compression))
    change = shown_with[:, 2] - shown[:, 2]
    assert np.abs(change).max() > 0.002
    volume = -np.minimum(shown[:, 2] - shown[:, 2].max(), 0).sum()
    assert abs(change.sum()) < 0.01 * volume


def test_the_playback_ends_where_the_mesh_is_and_plays_in_any_order(baked):
    for relief in ("FINE", "CLOSE_UP"):
        _, shown, _, frames, _ = baked[relief]
        assert np.abs(frames[24][-1] - shown).max() < 2e-5
        for played in frames.values():
            assert all(np.array_equal(played[0], again) for again in played)
        assert np.abs(frames[16][0] - frames[17][0]).max() < 0.02  # nothing pops


def test_close_up_has_a_fine_mesh_with_the_tread_in_it_and_none_painted(baked):
    _, shown, _, _, attributes = baked["CLOSE_UP"]
    spacing = np.diff(np.unique(shown[:, 0].round(5)))
    assert spacing.min() == pytest.approx(0.0025, abs=1e-4)
    assert own_data.SOLE not in attributes
    assert own_data.SOLE in baked["FINE"][4]


@pytest.mark.slow
@pytest.mark.parametrize("given", [False, True])
def test_close_up_is_fine_where_the_camera_comes_near_and_as_the_cells_elsewhere(scene, given):
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    if given:
        bpy.ops.mesh.primitive_plane_add(size=20.0)
        scene.softground.ground = bpy.context.active_object
    scene.render.resolution_x = scene.render.resolution_y = 200
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 0.6)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    bake(scene, cell_size=0.01, relief="CLOSE_UP")
    shown = baked_ground.display_mesh_of(scene.softground.ground)
    place = heights(shown)[:, :2]
    steps = record.load(bytes(shown.data[ground_mesh.RECORD])).footprints
    away = [np.hypot(*(step.position[:2] - (0.0, 0.0))) for step in steps]

    def spacing(step):
        around = np.abs(place - step.position[:2]).max(axis=1) < 0.05
        return 0.1 / np.sqrt(np.count_nonzero(around))

    assert spacing(steps[int(np.argmin(away))]) == pytest.approx(0.0025, rel=0.2)
    assert spacing(steps[int(np.argmax(away))]) == pytest.approx(0.01, rel=0.2)


def test_a_new_scene_has_fine_relief(scene):
    shots.walker(scene, frames=10)
    for name in ("relief", "tread"):
        scene.softground.property_unset(name)
    bpy.ops.softground.add_character()
    assert scene.softground.relief == "FINE"
