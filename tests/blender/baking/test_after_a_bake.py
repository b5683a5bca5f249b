"""What the artist sees after a bake: a wide ground, the prints in view, and a bake that says when it is outdated."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import session
from softground_addon.blender.materials.materials import EDGE
from softground_addon.blender.panels import outdated
from softground_addon.blender.reading import analysis
from softground_addon.blender.state import state
from softground_addon.core.ground.camera_view import FARTHEST


def places(ground):
    values = np.empty((len(ground.data.vertices), 3), np.float32)
    ground.data.attributes["position"].data.foreach_get("vector", values.ravel())
    return values[:, :2] + np.array(ground.location)[:2]


def floats(mesh, name):
    values = np.empty(len(mesh.vertices), np.float32)
    mesh.attributes[name].data.foreach_get("value", values)
    return values


def create(scene, margin):
    scene.softground.ground, scene.softground.ground_margin = None, margin
    bpy.context.view_layer.objects.active = None
    bpy.ops.softground.create_ground()
    return scene.softground.ground


def test_a_created_ground_is_wide_coarse_beyond_the_trail_and_fades_at_its_edge(short_walk):
    narrow, wide = create(short_walk, 0.0), create(short_walk, 3.0)
    near, far = places(narrow), places(wide)
    assert (far.min(axis=0) <= near.min(axis=0) - 2.9).all()
    assert (far.max(axis=0) >= near.max(axis=0) + 2.9).all()
    assert len(far) - len(near) < 1000
    assert EDGE not in narrow.data.attributes
    edge = floats(wide.data, EDGE)
    inside = ((far > near.min(axis=0)) & (far < near.max(axis=0))).all(axis=1)
    assert edge[inside].max() == 0.0
    border = (far == far.min(axis=0)).any(axis=1) | (far == far.max(axis=0)).any(axis=1)
    assert edge[border].min() == 1.0


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_a_created_ground_fills_the_camera_s_view(short_walk, kind):
    scene = short_walk
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.data.type, camera.data.ortho_scale = kind, 14.0
    camera.location, camera.rotation_euler = (0.0, 0.0, 12.0), (0.0, 0.0, 0.0)
    scene.camera = camera
    bpy.context.view_layer.update()
    frame = np.array(camera.data.view_frame(scene=scene))
    half = np.abs(frame[:, :2]).max(axis=0) * (1.0 if kind == "ORTHO" else 12.0 / abs(frame[0, 2]))
    seen = places(create(scene, 3.0))
    assert (seen.min(axis=0) <= -half).all()
    assert (seen.max(axis=0) >= half).all()

    camera.rotation_euler.x = np.radians(88.0)  # to the horizon
    bpy.context.view_layer.update()
    size = np.ptp(places(create(scene, 3.0)), axis=0)
    assert size.max() < 2 * FARTHEST + 20


def test_a_created_ground_is_in_the_active_collection_and_takes_no_selection(short_walk):
    mine = bpy.data.collections.new("Mine")
    short_walk.collection.children.link(mine)
    layer = bpy.context.view_layer
    layer.active_layer_collection = layer.layer_collection.children["Mine"]
    armature = short_walk.softground.characters[0].armature
    armature.select_set(True)
    layer.objects.active = armature
    bpy.ops.softground.bake()
    assert mine in short_walk.softground.ground.users_collection
    assert layer.objects.active == armature
    assert list(layer.objects.selected) == [armature]

    layer.layer_collection.children["Mine"].hide_viewport = True
    assert short_walk.collection in create(short_walk, 0.0).users_collection


def test_who_poses_goes_on_posing(short_walk):
    armature = short_walk.softground.characters[0].armature
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.softground.bake()
    assert bpy.context.view_layer.objects.active == armature
    assert armature.mode == "POSE"


def test_a_ground_that_is_asked_for_is_selected(short_walk):
    bpy.ops.softground.create_ground(use_selected=False)
    ground = short_walk.softground.ground
    assert bpy.context.view_layer.objects.active == ground
    assert list(bpy.context.view_layer.objects.selected) == [ground]


def test_show_prints_goes_where_all_are_there(short_walk):
    assert not bpy.ops.softground.show_prints.poll()
    short_walk.frame_set(1)
    bpy.ops.softground.bake()
    bpy.ops.softground.show_prints()
    steps = short_walk.softground.ground.data["softground_summary"]["steps"]
    assert steps >= 2
    ends = [short_walk.softground.ground.data["softground_summary"]["last_frame"]]
    assert short_walk.frame_current == int(np.ceil(max(ends)))
    assert short_walk.frame_current > 20


@pytest.fixture
def known(short_walk, monkeypatch):
    bpy.ops.softground.bake()
    state.compared.clear()
    assert outdated.compare_bake() is None
    assert not session.current().stale
    yield short_walk
    if bpy.app.timers.is_registered(outdated.compare_bake):
        bpy.app.timers.unregister(outdated.compare_bake)


def match_depth(_scene):
    bpy.ops.softground.match_depth(depth=4.0)


def load_preset(_scene):
    bpy.ops.softground.load_preset(name="Mud")


def set_tread(scene):
    scene.softground.tread = 0.002


@pytest.mark.parametrize("change", [match_depth, load_preset, set_tread])
def test_what_an_operator_sets_is_noticed_as_the_panel_is_drawn(known, change):
    """No update of the depsgraph tells of it."""
    if not bpy.context.window_manager.windows:
        pytest.skip("no window to look at")
    analysis.read(known)
    outdated.watch(known)
    assert not bpy.app.timers.is_registered(outdated.compare_bake)
    change(known)
    outdated.watch(known)
    assert bpy.app.timers.is_registered(outdated.compare_bake)
    bpy.app.timers.unregister(outdated.compare_bake)
    outdated.compare_bake()
    assert "settings have changed" in session.current().stale
    bpy.ops.softground.bake_again()
    outdated.compare_bake()
    assert not session.current().stale
