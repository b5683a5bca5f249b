"""Playing a bake with native attributes and nodes, against the record put together frame by frame."""

import subprocess
import sys

import bmesh
import bpy
import numpy as np
import pytest

from softground_addon.blender.ground import ground_mesh, ground_surface
from softground_addon.blender.playback import playback, playback_nodes
from softground_addon.blender.playback.display_key import DISPLAY_KEY
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.playback.playback_curves import playback_curves_at
from softground_addon.core.playback.ramps import TOLERANCE
from softground_addon.core.record.pressed_ground import PressedGround
from tests.core.walkers import pressed, walk

SAND = GroundMaterial(330e3, 0.45, 0.1, blur_sigma=0.01)
FRAMES = (1, 9, 23, 24, 38, 52, 77, 200)


def ground_object(scene, spacing=0.02, matrix=None):
    """A grid around the walk, 2.8 by 1 m."""
    x, y = np.arange(-0.4, 2.4, spacing), np.arange(-0.5, 0.5, spacing)
    position = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], axis=-1)
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    quads = corner[:, None] + np.array([0, 1, len(x) + 1, len(x)])
    points = position.reshape(-1, 3)
    if matrix is not None:
        inverse = np.linalg.inv(matrix)
        points = points @ inverse[:3, :3].T + inverse[:3, 3]
    mesh = bpy.data.meshes.new("Ground")
    mesh.from_pydata(points.tolist(), [], quads.tolist())
    ground = bpy.data.objects.new("Ground", mesh)
    if matrix is not None:
        ground.matrix_world = matrix.T
    scene.collection.objects.link(ground)
    scene.view_layers[0].update()
    return ground


def bake_onto(ground, footprints, material=SAND, unit_scale=1.0, shape_keys=True):
    """What the bake job does once the record is there."""
    surface = ground_surface.undisturbed_surface(ground, unit_scale)
    pressed_ground = PressedGround.at(
        footprints, frame=1e9, frame_rate=30.0, cell_size=0.01, blur_sigma=material.blur_sigma
    )
    index = np.flatnonzero(pressed_ground.covers(*surface.vertices[:, :2].T))
    place = surface.vertices[index, :2].T
    up = ground_surface.up_of(ground, unit_scale)
    ground_mesh.write(ground, index, pressed_ground.sample(*place), b"record", up, shape_keys=shape_keys)
    spans, lines = playback_curves_at(footprints, *place, blur_sigma=material.blur_sigma, frame_rate=30.0)
    with playback.keyframe_tables(lines, lines.position.unpacked()) as table:
        playback.attach(ground, index[spans.point], spans, table, up=up)
    return surface


def evaluated(ground, scene, frame):
    scene.frame_set(int(frame), subframe=float(frame % 1))
    return ground.evaluated_get(bpy.context.evaluated_depsgraph_get())


def world_positions(evaluated_object, unit_scale=1.0):
    mesh = evaluated_object.data
    position = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", position)
    matrix = np.array(evaluated_object.matrix_world)
    return (position.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]) * unit_scale


def floats(evaluated_object, name):
    values = np.empty(len(evaluated_object.data.vertices), dtype=np.float32)
    evaluated_object.data.attributes[name].data.foreach_get("value", values)
    return values


def recorded(footprints, frame, surface, material=SAND):
    ground = PressedGround.at(footprints, frame=frame, frame_rate=30.0, cell_size=0.01, blur_sigma=material.blur_sigma)
    return ground.sample(*surface.vertices[:, :2].T)


@pytest.fixture(scope="module")
def footprints():
    return pressed(walk(steps=4), SAND)[1]


@pytest.fixture
def scene(addon):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 30
    return bpy.context.scene


@pytest.fixture(params=[0.0, 2.0], ids=["many", "few"])
def share(request, monkeypatch):
    """Both ways of looking vertices up, whatever part of them moves."""
    monkeypatch.setattr(playback, "FEW", request.param)


@pytest.mark.parametrize("shape_keys", [True, False])
@pytest.mark.usefixtures("share")
def test_heights_are_those_of_the_record_in_any_order_and_between_frames(scene, footprints, shape_keys):
    ground = ground_object(scene)
    surface = bake_onto(ground, footprints, shape_keys=shape_keys)
    for frame in (52, 9, 200, 1, 23.25, 77, 24, 38.5):
        moved = world_positions(evaluated(ground, scene, frame)) - surface.vertices
        assert np.abs(moved[:, 2] - recorded(footprints, frame, surface).display).max() <= TOLERANCE + 1e-6
        assert np.abs(moved[:, :2]).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("shape_keys", [True, False])
@pytest.mark.usefixtures("share")
def test_shading_attributes_follow_the_same_time(scene, footprints, shape_keys):
    ground = ground_object(scene)
    surface = bake_onto(ground, footprints, shape_keys=shape_keys)
    for frame in (*FRAMES, 23.25, 10):
        shown, sample = evaluated(ground, scene, frame), recorded(footprints, frame, surface)
        assert np.abs(floats(shown, "softground_compression") - sample.compression).max() <= 1e-3
        assert np.abs(floats(shown, "softground_rim") - sample.rim).max() <= 1e-3 + TOLERANCE
        np.testing.assert_allclose(floats(shown, "softground_age"), sample.age, atol=1e-5)
        assert playback_nodes.SAMPLED not in shown.data.attributes


@pytest.mark.usefixtures("share")
def test_pressure_is_there_only_during_the_contact(scene, footprints):
    ground = ground_object(scene)
    surface = bake_onto(ground, footprints)
    for frame in FRAMES:
        pressure, age = (
            floats(evaluated(ground, scene, frame), "softground_pressure"),
            recorded(footprints, frame, surface).age,
        )
        assert (pressure[age != 0] == 0).all()
    print_ = footprints[1]
    middle = (print_.start_frame + print_.end_frame) / 2
    pressure = floats(evaluated(ground, scene, middle), "softground_pressure")
    assert pressure.max() == pytest.approx(print_.peak_force_n / print_.area_m2, rel=1e-4)


@pytest.mark.parametrize("shape_keys", [True, False])
def test_without_the_modifier_the_finished_ground_stands_there(scene, footprints, shape_keys):
    ground = ground_object(scene)
    surface = bake_onto(ground, footprints, shape_keys=shape_keys)
    assert bool(ground.data.shape_keys) == shape_keys
    playback.modifier_of(ground).show_viewport = False
    moved = world_positions(evaluated(ground, scene, 1)) - surface.vertices
    np.testing.assert_allclose(moved[:, 2], recorded(footprints, 1e9, surface).display, atol=1e-6)


@pytest.mark.parametrize("key_value", [0.0, 0.3, 1.0])
def test_the_shape_key_does_not_move_the_ground_twice(scene, footprints, key_value):
    ground = ground_object(scene)
    surface = bake_onto(ground, footprints)
    ground.data.shape_keys.key_blocks[DISPLAY_KEY].value = key_value
    moved = world_positions(evaluated(ground, scene, 52)) - surface.vertices
    touched = recorded(footprints, 1e9, surface).compression > 1e-5
    difference = moved[:, 2] - recorded(footprints, 52, surface).display
    assert np.abs(difference[touched]).max() <= TOLERANCE + 1e-6


def test_where_nothing_moves_any_more_the_mesh_itself_is_seen(scene, footprints):
    ground = ground_object(scene)
    bake_onto(ground, footprints, shape_keys=False)
    played = world_positions(evaluated(ground, scene, 200))
    playback.modifier_of(ground).show_viewport = False
    np.testing.assert_array_equal(played, world_positions(evaluated(ground, scene, 200)))


def tilted_and_scaled():
    turn = np.radians(25)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]) @ np.diag(
        [2.0, 0.5, -3.0]
    )
    matrix[:3, 3] = (1.0, -2.0, 0.5)
    return matrix


@pytest.mark.parametrize("unit_scale", [1.0, 0.01])
def test_a_tilted_scaled_mirrored_ground_moves_along_world_z(scene, footprints, unit_scale):
    matrix = tilted_and_scaled()
    matrix[:3] /= unit_scale
    ground = ground_object(scene, matrix=matrix)
    surface = bake_onto(ground, footprints, unit_scale=unit_scale)
    for frame in (23, 52):
        moved = world_positions(evaluated(ground, scene, frame), unit_scale) - surface.vertices
        assert np.abs(moved[:, 2] - recorded(footprints, frame, surface).display).max() <= TOLERANCE + 5e-6
        assert np.abs(moved[:, :2]).max() < 5e-6


def test_the_users_own_modifiers_work_on_the_played_ground(scene, footprints):
    ground = ground_object(scene)
    lift = ground.modifiers.new("Lift", "DISPLACE")
    lift.strength, lift.mid_level, lift.direction = 1.5, 0.0, "Z"
    surface = bake_onto(ground, footprints)
    assert ground.modifiers[0] == playback.modifier_of(ground)
    moved = world_positions(evaluated(ground, scene, 52))[:, 2] - 1.5
    assert np.abs(moved - recorded(footprints, 52, surface).display).max() <= TOLERANCE + 1e-6


def test_a_second_bake_replaces_the_first(scene, footprints):
    ground = ground_object(scene)
    bake_onto(ground, footprints)
    names = {attribute.name for attribute in ground.data.attributes}
    surface = bake_onto(ground, footprints[:2])
    assert len(ground.modifiers) == 1
    assert len(bpy.data.node_groups) == 1
    assert {attribute.name for attribute in ground.data.attributes} <= names
    moved = world_positions(evaluated(ground, scene, 200)) - surface.vertices
    np.testing.assert_allclose(moved[:, 2], recorded(footprints[:2], 1e9, surface).display, atol=2e-6)


def test_a_renamed_playback_is_still_known(scene, footprints):
    ground = ground_object(scene)
    bake_onto(ground, footprints)
    modifier = ground.modifiers[0]
    modifier.name, modifier.node_group.name = "Trail", "Prints of the Hero"
    assert playback.modifier_of(ground) == modifier
    bake_onto(ground, footprints)
    assert len(ground.modifiers) == 1
    playback.remove(ground)
    assert not ground.modifiers
    assert not bpy.data.node_groups


def test_removal_leaves_nothing_on_a_copy_with_the_same_mesh(scene, footprints):
    ground = ground_object(scene)
    bake_onto(ground, footprints)
    copy = ground.copy()
    scene.collection.objects.link(copy)
    playback.remove(ground)
    assert not copy.modifiers, "there, it would pull the vertices to the origin before frame 0"
    assert not bpy.data.node_groups


@pytest.mark.parametrize("few", [0.0, 1.0])
@pytest.mark.parametrize("shape_keys", [True, False])
def test_vertices_that_the_user_adds_stay_where_they_are_put(scene, footprints, monkeypatch, few, shape_keys):
    monkeypatch.setattr(playback, "FEW", few)
    ground = ground_object(scene)
    bake_onto(ground, footprints, shape_keys=shape_keys)
    place, edited = (1.0, 2.0, 3.0), bmesh.new()
    edited.from_mesh(ground.data)
    edited.verts.new(place)
    edited.to_mesh(ground.data)
    edited.free()
    for frame in (-30, -1, 0, 1, 40, 500):
        assert world_positions(evaluated(ground, scene, frame))[-1] == pytest.approx(place), frame


def test_removal_leaves_nothing_behind(scene, footprints):
    ground = ground_object(scene)
    before = sorted(attribute.name for attribute in ground.data.attributes)
    bake_onto(ground, footprints)
    playback.remove(ground)
    ground_mesh.restore(ground)
    assert sorted(attribute.name for attribute in ground.data.attributes) == before
    assert not ground.modifiers
    assert not bpy.data.node_groups


BARE_BLENDER = """
import sys, bpy, numpy as np
blend, out, *frames = sys.argv[1:]
bpy.ops.wm.open_mainfile(filepath=blend, use_scripts=False)
assert not hasattr(bpy.types.Scene, "softground")
scene, ground, heights = bpy.context.scene, bpy.data.objects["Ground"], []
for frame in map(float, frames):
    scene.frame_set(int(frame), subframe=frame % 1)
    mesh = ground.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    position = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", position)
    heights.append(position[2::3])
np.save(out, heights)
"""


def test_the_playback_needs_no_add_on(scene, footprints, tmp_path):
    ground = ground_object(scene)
    surface = bake_onto(ground, footprints)
    blend, out = tmp_path / "baked.blend", tmp_path / "heights.npy"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    frames = (52, 1, 77, 23.5)
    subprocess.run([sys.executable, "-c", BARE_BLENDER, blend, out, *map(str, frames)], check=True, cwd=tmp_path)
    for frame, heights in zip(frames, np.load(out), strict=True):
        difference = heights - surface.vertices[:, 2] - recorded(footprints, frame, surface).display
        assert np.abs(difference).max() <= TOLERANCE + 1e-6


def test_it_plays_when_appended_and_linked_as_an_instance(scene, footprints, tmp_path):
    ground = ground_object(scene)
    surface = bake_onto(ground, footprints)
    blend = tmp_path / "library.blend"
    collection = bpy.data.collections.new("Set")
    scene.collection.children.link(collection)
    collection.objects.link(ground)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    for link in (False, True):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        with bpy.data.libraries.load(str(blend), link=link) as (_, wanted):
            wanted.collections = ["Set"]
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["Set"]
        scene.collection.objects.link(empty)
        scene.render.use_simplify, scene.render.simplify_subdivision = True, 0
        scene.frame_set(52)
        instances = [
            world_positions(instance.object)
            for instance in bpy.context.evaluated_depsgraph_get().object_instances
            if instance.is_instance and instance.object.type == "MESH"
        ]
        assert len(instances) == 1
        difference = (instances[0] - surface.vertices)[:, 2] - recorded(footprints, 52, surface).display
        assert np.abs(difference).max() <= TOLERANCE + 1e-6


def test_a_spot_stepped_on_often_plays_with_the_same_nodes(scene):
    trails = [walk(steps=2, origin=(0.02 * number, 0.01 * number, 0.0), name=f"w{number}") for number in range(4)]
    _, footprints = pressed(trails, SAND)
    ground = ground_object(scene)
    bake_onto(ground, footprints[:1])
    before = playback.modifier_of(ground).node_group
    kinds, attributes = [node.bl_idname for node in before.nodes], set(ground.data.attributes.keys())
    surface = bake_onto(ground, footprints)
    assert [node.bl_idname for node in playback.modifier_of(ground).node_group.nodes] == kinds
    assert set(ground.data.attributes.keys()) == attributes
    for frame in (24, 31.5, 40, 300):
        moved = world_positions(evaluated(ground, scene, frame)) - surface.vertices
        assert np.abs(moved[:, 2] - recorded(footprints, frame, surface).display).max() <= TOLERANCE + 2e-6


def test_the_table_lies_in_no_scene_and_goes_with_the_last_that_plays_it(scene, footprints):
    ground = ground_object(scene)
    bake_onto(ground, footprints)
    assert set(scene.objects) == {ground}
    copy = ground.copy()
    copy.data = ground.data.copy()
    scene.collection.objects.link(copy)
    playback.remove(ground)
    assert world_positions(evaluated(copy, scene, 200))[:, 2].min() < -0.01
    playback.remove(copy)
    assert set(bpy.data.objects) == {ground, copy}
    assert set(bpy.data.meshes) == {ground.data, copy.data}
