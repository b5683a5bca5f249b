"""The ground as a mesh: read, pressed, and given back bit for bit."""

from contextlib import ExitStack
from unittest import mock

import bpy
import numpy as np
import pytest
from mathutils import Euler

from softground_addon.blender import compat
from softground_addon.blender.baking import bake_report
from softground_addon.blender.ground import (
    created_ground,
    ground_checks,
    ground_mesh,
    ground_surface,
    still_ground,
)
from softground_addon.blender.playback import display_key
from softground_addon.blender.playback.display_key import DISPLAY_KEY
from softground_addon.blender.settings import resolve
from softground_addon.core.composers.ground_plan import GroundPlan
from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.record.pressed_ground import GroundSample
from tests.blender import fingerprints, shots
from tests.tiers import slow_but_one


def grid(scene, size=2.0, spacing=0.02, height=0.0, unit_scale=1.0):
    half = np.array([size, size]) / 2
    plan = GroundPlan(-half, half, FlatTerrain(height))
    with ExitStack() as drafts:
        ground = resolve(created_ground.draft(drafts, created_ground.lay_out(plan, spacing, unit_scale)))
        scene.collection.objects.link(ground)
    bpy.context.view_layer.update()
    return ground


def world(ground, key=None):
    mesh = ground.data
    points = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    (mesh.shape_keys.key_blocks[key].points if key else mesh.vertices).foreach_get("co", points)
    matrix = np.array(ground.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def pressed(index, raw, display):
    count = len(index)
    sample = GroundSample(
        np.full(count, raw), np.full(count, display), np.full(count, -raw), np.zeros(count), np.ones(count)
    )
    return np.asarray(index), sample


@pytest.mark.parametrize("unit_scale", [1.0, 0.01])
def test_vertices_of_a_created_grid_sit_on_cell_centres(scene, unit_scale):
    ground = grid(scene, height=0.3, unit_scale=unit_scale)
    place = world(ground) * unit_scale
    assert np.allclose((place[:, :2] / 0.02) % 1, 0.5, atol=1e-3)
    assert np.allclose(place[:, 2], 0.3, atol=1e-6)
    assert place[:, :2].min() <= -1.0
    assert place[:, :2].max() >= 1.0


def test_a_created_grid_is_a_valid_mesh_of_upward_quads_with_uvs(scene):
    mesh = grid(scene).data
    assert not mesh.validate(verbose=True)
    assert all(polygon.normal.z > 0.999 for polygon in mesh.polygons)
    assert len(mesh.uv_layers) == 1


def test_an_absurdly_large_grid_is_made_coarser_instead_of_filling_the_memory(scene, monkeypatch):
    monkeypatch.setattr(created_ground, "MAX_GRID_VERTICES", 10_000)
    plan = GroundPlan(np.zeros(2), np.full(2, 10.0), FlatTerrain())
    assert len(created_ground.lay_out(plan, 0.01, 1.0).vertices) < 11_000


def test_a_ground_for_walks_that_are_far_apart_does_not_fill_the_memory(monkeypatch):
    monkeypatch.setattr(created_ground, "MAX_GRID_VERTICES", 10_000)
    footfalls = np.array([[0.0, 0.0], [400.0, 300.0]])
    plan = GroundPlan(np.full(2, -1.0), np.array([401.0, 301.0]), FlatTerrain(), footfalls, 0.05)
    vertices = created_ground.lay_out(plan, 0.01, 1.0).vertices
    assert len(vertices) < 20_000
    for place in footfalls:
        assert (np.abs(vertices[:, :2] - place).max(axis=1) < 0.04).sum() == 64, "cells of 1 cm under the feet"


@pytest.mark.parametrize("transform", ["plain", "tilted", "scaled", "mirrored", "parented"])
def test_vertices_move_along_world_z_whatever_the_objects_transform(scene, transform):
    ground = grid(scene)
    if transform == "tilted":
        ground.rotation_euler = Euler((0.3, 0.2, 1.0))
    elif transform == "scaled":
        ground.scale = (0.5, 2.0, 3.0)
    elif transform == "mirrored":
        ground.scale = (1.0, -1.0, 1.0)
    elif transform == "parented":
        parent = bpy.data.objects.new("parent", None)
        scene.collection.objects.link(parent)
        parent.rotation_euler, parent.scale = Euler((0.1, 0.4, 0.0)), (2.0, 2.0, 2.0)
        ground.parent = parent
    bpy.context.view_layer.update()
    before = world(ground)
    index = np.arange(100, 200)
    ground_mesh.write(ground, *pressed(index, -0.05, -0.03), b"record", ground_surface.up_of(ground, 1.0))
    for key, change in (("Basis", -0.05), (DISPLAY_KEY, -0.03)):
        expected = before.copy()
        expected[index, 2] += change
        assert np.allclose(world(ground, key), expected, atol=1e-5)
    height = ground_surface.terrain_of(ground_surface.undisturbed_surface(ground, 1.0)).heights(
        before[:, 0], before[:, 1]
    )
    inside = np.isfinite(height)
    assert inside.mean() > 0.9
    assert np.allclose(height[inside], before[inside, 2], atol=1e-5)


def test_restoring_gives_the_same_bytes_back(scene):
    ground = grid(scene)
    ground.data.attributes.new("mine", "FLOAT", "POINT")
    ground.data.attributes.active_index = 3
    before = fingerprints.of_file()
    ground_mesh.write(ground, *pressed(np.arange(50), -0.05, -0.03), b"record", ground_surface.up_of(ground, 1.0))
    assert fingerprints.of_file() != before
    ground_mesh.write(ground, *pressed(np.arange(30, 70), -0.02, -0.02), b"other", ground_surface.up_of(ground, 1.0))
    ground_mesh.restore(ground)
    assert fingerprints.of_file() == before


def test_a_second_bake_replaces_the_first(scene):
    ground = grid(scene)
    before = world(ground)
    ground_mesh.write(ground, *pressed(np.arange(50), -0.05, -0.03), b"record", ground_surface.up_of(ground, 1.0))
    ground_mesh.write(ground, *pressed(np.arange(50, 60), -0.02, -0.01), b"other", ground_surface.up_of(ground, 1.0))
    moved = np.flatnonzero(world(ground, "Basis")[:, 2] != before[:, 2])
    assert np.array_equal(moved, np.arange(50, 60))
    assert bytes(ground.data[ground_mesh.RECORD]).rstrip(b"\0") == b"other"


def test_the_undisturbed_surface_includes_the_users_modifiers_but_not_the_bake(scene):
    ground = grid(scene)
    displace = ground.modifiers.new("lift", "DISPLACE")
    displace.mid_level, displace.strength = 0.0, 0.25
    ground_mesh.write(
        ground,
        *pressed(np.arange(len(ground.data.vertices)), -0.05, -0.05),
        b"record",
        ground_surface.up_of(ground, 1.0),
    )
    before = fingerprints.of_file()
    surface = ground_surface.undisturbed_surface(ground, 1.0)
    assert np.allclose(surface.vertices[:, 2], 0.25, atol=1e-6)
    assert fingerprints.of_file() == before


def no_faces(ground):
    ground.data.clear_geometry()


def own_shape_key(ground):
    ground.shape_key_add(name="Basis")


def shared_mesh(ground):
    bpy.data.objects.new("twin", ground.data)


def flattened(ground):
    ground.scale = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()


@pytest.mark.parametrize(
    ("spoil", "remedy"),
    [
        (no_faces, "no faces.*Create Ground"),
        (own_shape_key, "shape keys.*apply them"),
        (shared_mesh, "Make Single User"),
        (flattened, "scale"),
    ],
)
def test_an_unusable_ground_is_named_with_the_remedy(scene, spoil, remedy):
    ground = grid(scene)
    ground_checks.check_usable(ground)
    spoil(ground)
    with pytest.raises(InputError, match=f"'SoftGround'.*{remedy}"):
        ground_checks.check_usable(ground)


def test_a_ground_that_waves_is_taken_at_the_first_frame_of_the_bake_whatever_is_shown(scene):
    ground = grid(scene, spacing=0.1)
    wave = ground.modifiers.new("Swell", "WAVE")
    assert still_ground.changes_with_time(ground) == "Swell"
    scene.softground.frame_start = 40
    scene.frame_set(40)
    shown = world(ground.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    for frame in (1, 40, 90):
        scene.frame_set(frame)
        taken = ground_surface.undisturbed_surface(ground, 1.0).vertices
        np.testing.assert_allclose(taken, shown, atol=1e-6)
    assert np.ptp(shown[:, 2]) > 0.1
    wave.show_viewport = False
    assert not still_ground.changes_with_time(ground)


def keyed(block, path, *values):
    for frame, value in enumerate(values):
        setattr(block, path, value)
        block.keyframe_insert(path, frame=10 * frame)


def keyed_shape(obj):
    obj.shape_key_add(name="Basis")
    keyed(obj.shape_key_add(name="Bent"), "value", 0.0, 1.0)


def linked(scene, name, data):
    obj = bpy.data.objects.new(name, data)
    scene.collection.objects.link(obj)
    return obj


def keyed_texture(scene, modifier):
    modifier.texture = bpy.data.textures.new("Hills", "CLOUDS")
    keyed(modifier.texture, "noise_scale", 0.1, 2.0)


def filmed_texture(scene, modifier):
    modifier.texture = bpy.data.textures.new("Film", "IMAGE")
    modifier.texture.image = bpy.data.images.new("Film", 4, 4)
    modifier.texture.image.source = "SEQUENCE"


def bent_lattice(scene, modifier):
    modifier.object = linked(scene, "Cage", bpy.data.lattices.new("Cage"))
    keyed_shape(modifier.object)


def bent_curve(scene, modifier):
    curve = bpy.data.curves.new("Path", "CURVE")
    curve.splines.new("POLY").points.add(3)
    modifier.object = linked(scene, "Path", curve)
    keyed_shape(modifier.object)


def posed_rig(scene, modifier):
    modifier.object = shots.walker(scene, frames=20)


def waving_target(scene, modifier):
    modifier.target = grid(scene)
    modifier.target.modifiers.new("Swell", "WAVE")


def driven(scene, modifier):
    modifier.driver_add("strength").driver.expression = "frame / 10"


def group_of(modifier):
    tree = modifier.node_group = bpy.data.node_groups.new("Theirs", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    return tree


def keyed_node(scene, modifier):
    keyed(group_of(modifier).nodes.new("ShaderNodeValue").outputs[0], "default_value", 0.0, 1.0)


def node_within(scene, modifier):
    inner = bpy.data.node_groups.new("Inner", "GeometryNodeTree")
    keyed(inner.nodes.new("ShaderNodeValue").outputs[0], "default_value", 0.0, 1.0)
    group_of(modifier).nodes.new("GeometryNodeGroup").node_tree = inner


def moving_collection(scene, modifier):
    collection, rock = bpy.data.collections.new("Rocks"), bpy.data.objects.new("Rock", None)
    collection.objects.link(rock)
    keyed(rock, "location", (0, 0, 0), (1, 0, 0))
    named = group_of(modifier).nodes.new("GeometryNodeCollectionInfo")
    named.inputs["Collection"].default_value = collection


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("DISPLACE", keyed_texture),
        ("DISPLACE", filmed_texture),
        ("DISPLACE", driven),
        ("LATTICE", bent_lattice),
        ("CURVE", bent_curve),
        ("ARMATURE", posed_rig),
        ("SHRINKWRAP", waving_target),
        ("SURFACE_DEFORM", waving_target),
        ("NODES", keyed_node),
        ("NODES", node_within),
        ("NODES", moving_collection),
    ],
)
def test_what_gives_a_ground_another_shape_from_frame_to_frame_is_named(scene, kind, change):
    ground = grid(scene)
    still = ground.modifiers.new("Still", "SUBSURF")
    assert still.show_viewport
    modifier = ground.modifiers.new("Theirs", kind)
    assert not still_ground.changes_with_time(ground)
    change(scene, modifier)
    assert still_ground.changes_with_time(ground) == "Theirs"
    (finding,) = bake_report.ground_findings(ground, 7)
    assert f"'{ground.name}' changes its shape over time by its modifier 'Theirs'" in finding.message


def test_what_stands_still_is_no_change_of_a_ground(scene):
    ground = grid(scene)
    wrap = ground.modifiers.new("Wrap", "SHRINKWRAP")
    wrap.target = grid(scene)
    wrap.target.modifiers.new("Back", "SHRINKWRAP").target = ground
    displace = ground.modifiers.new("Hills", "DISPLACE")
    displace.texture = bpy.data.textures.new("Hills", "CLOUDS")
    ground.modifiers.new("Rig", "ARMATURE").object = linked(scene, "Rig", bpy.data.armatures.new("Rig"))
    material = bpy.data.materials.new("Glow")
    keyed(material, "metallic", 0.0, 1.0)
    tree = group_of(ground.modifiers.new("Look", "NODES"))
    tree.nodes.new("GeometryNodeSetMaterial").inputs["Material"].default_value = material
    assert not still_ground.changes_with_time(ground)


def test_a_ground_that_names_a_forest_is_soon_looked_at(scene):
    forest, trunk = bpy.data.collections.new("Forest"), bpy.data.meshes.new("Trunk")
    for _ in range(5000):
        forest.objects.link(bpy.data.objects.new("Tree", trunk))
    ground = grid(scene)
    named = group_of(ground.modifiers.new("Theirs", "NODES")).nodes.new("GeometryNodeCollectionInfo")
    named.inputs["Collection"].default_value = forest
    with mock.patch.object(still_ground, "mover_of", wraps=still_ground.mover_of) as looked_at:
        assert not still_ground.changes_with_time(ground)
    assert 0 < looked_at.call_count <= still_ground.MOST_FOLLOWED


def test_keys_on_the_points_of_a_ground_are_named(scene):
    ground = grid(scene)
    keyed(ground.data.vertices[0], "co", (0, 0, 0), (0, 0, 1))
    (finding,) = bake_report.ground_findings(ground, 7)
    assert f"'{ground.name}' changes its shape over time by keys on its mesh" in finding.message


@pytest.mark.parametrize(("kind", "data"), [("ARMATURE", "armatures"), ("LATTICE", "lattices")])
def test_a_ground_that_its_parent_bends_is_refused_with_the_remedy(scene, kind, data):
    ground = grid(scene)
    ground.parent = linked(scene, "Bender", getattr(bpy.data, data).new("Bender"))
    ground_checks.check_usable(ground)
    ground.parent_type = kind
    with pytest.raises(InputError, match=f"'{ground.name}' is bent by its parent 'Bender'.*Object"):
        ground_checks.check_usable(ground)


@pytest.mark.parametrize("wanted", slow_but_one([True, False]))
@pytest.mark.parametrize("too", slow_but_one([True, False]))
@pytest.mark.parametrize("dense", slow_but_one([True, False]))
def test_dense_grounds_keep_shape_keys_only_where_that_is_asked_for(scene, monkeypatch, wanted, too, dense):
    shots.walker(scene, frames=20)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.cell_size, options.shape_keys, options.dense_shape_keys = 0.03, wanted, too
    monkeypatch.setattr(display_key, "MOST_VERTICES", 10 if dense else 10**9)
    bpy.ops.softground.bake()
    assert (options.ground.data.shape_keys is not None) == (wanted and (too or not dense))


@pytest.mark.parametrize("stretch", [50, 100, 200])
def test_a_modifier_that_changes_is_read_at_the_first_frame_of_the_scenes_own_time(scene, stretch):
    scene.render.frame_map_old, scene.render.frame_map_new = 100, stretch
    scene.softground.frame_start = 11
    ground = grid(scene, spacing=0.5)
    lift = ground.modifiers.new("Lift", "DISPLACE")
    lift.direction, lift.mid_level = "Z", 0.0
    for frame in (0, 100):
        lift.strength = frame / 10
        ground.keyframe_insert('modifiers["Lift"].strength', frame=frame)
    for curve in compat.action_curves(ground.animation_data.action):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    scene.frame_set(11)
    shown = ground.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices[0].co.z
    assert shown == pytest.approx(1.1 * 100 / stretch, rel=1e-5)
    scene.frame_set(40)
    surface = ground_surface.undisturbed_surface(ground, 1.0)
    assert surface.vertices[:, 2] == pytest.approx(shown, rel=1e-5)
