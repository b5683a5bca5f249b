"""Grounds under modifiers of all kinds: over time, in the way of prints, made by them, and the finished mesh."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job, bake_report
from softground_addon.blender.ground import baked_ground, ground_mesh
from tests.blender import fingerprints
from tests.blender.grounds import as_rendered, field, mover, node_group, plane, refusal
from tests.tiers import slow_but_one


def lift_by_scene_time(ground, _scene):
    tree, given, result = node_group()
    inner, inner_given, inner_result = node_group()
    place, time, up = (
        inner.nodes.new(kind)
        for kind in ("GeometryNodeSetPosition", "GeometryNodeInputSceneTime", "ShaderNodeCombineXYZ")
    )
    for source, target in (
        (inner_given, place.inputs["Geometry"]),
        (time.outputs["Seconds"], up.inputs["Z"]),
        (up.outputs[0], place.inputs["Offset"]),
        (place.outputs[0], inner_result),
    ):
        inner.links.new(source, target)
    nested = tree.nodes.new("GeometryNodeGroup")
    nested.node_tree = inner
    tree.links.new(given, nested.inputs[0])
    tree.links.new(nested.outputs[0], result)
    ground.modifiers.new("Theirs", "NODES").node_group = tree


def hook(ground, scene):
    modifier = ground.modifiers.new("Theirs", "HOOK")
    modifier.object = mover(scene)
    modifier.vertex_indices_set([0, 1])


def grow_by_keys(ground, scene):
    modifier = ground.modifiers.new("Theirs", "DISPLACE")
    modifier.mid_level = 0.0
    for frame, strength in ((1, 0.0), (30, 0.2)):
        modifier.strength = strength
        modifier.keyframe_insert("strength", frame=frame)
    scene.frame_set(1)


@pytest.mark.parametrize("change", [lift_by_scene_time, hook, grow_by_keys])
def test_a_ground_that_anything_shapes_over_time_is_told_of_and_up_to_date_at_every_frame(short_walk, change):
    ground = field(short_walk, vertices=120)
    change(ground, short_walk)
    bpy.context.view_layer.update()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    # Where the ground is lifted, the skin's distance from it is said too.
    changes = "'Field' changes its shape over time by its modifier 'Theirs'"
    (_,) = (warning for warning in ground_mesh.warnings_of(baked_ground.display_mesh_of(ground)) if changes in warning)
    for frame in (1, 20):
        short_walk.frame_set(frame)
        assert bake_report.stale_reasons(short_walk) == ()


def test_a_file_path_is_the_same_wherever_the_blend_is_saved(short_walk, tmp_path):
    ground = field(short_walk)
    ocean = ground.modifiers.new("Swell", "OCEAN")
    ocean.geometry_mode, ocean.wave_scale = "GENERATE", 0.1
    assert bpy.ops.softground.bake() == {"FINISHED"}
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "shot.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))
        assert bake_report.stale_reasons(bpy.context.scene) == ()


def test_a_display_mesh_whose_playback_was_applied_is_no_longer_up_to_date(short_walk):
    short_walk.softground.shape_keys = False
    ground = field(short_walk)
    bpy.ops.softground.bake()
    assert bake_report.stale_reasons(short_walk) == ()
    display_mesh = baked_ground.display_mesh_of(ground)
    short_walk.frame_set(12)
    with bpy.context.temp_override(object=display_mesh, active_object=display_mesh):
        bpy.ops.object.modifier_apply(modifier="SoftGround Playback")
    assert bake_report.stale_reasons(short_walk) == (
        "'Field Trail' has lost its playback modifier, and its prints no longer move",
    )
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert bake_report.stale_reasons(short_walk) == ()


@pytest.fixture
def shrinkwrapped(short_walk):
    """A fine grid that a Shrinkwrap lays onto a coarse hill, wherever its vertices are."""
    hill = plane(short_walk, vertices=40, height=lambda x, y: 0.05 * np.sin(2 * x))
    hill.name, hill.hide_render = "Hill", True
    ground = field(short_walk, vertices=200, size=6.0)
    wrap = ground.modifiers.new("Wrap", "SHRINKWRAP")
    wrap.target, wrap.wrap_method, wrap.use_project_z, wrap.use_negative_direction = hill, "PROJECT", True, True
    ground.location.z = 0.5
    bpy.context.view_layer.update()
    return ground


def test_prints_that_modifiers_would_undo_are_taken_by_a_copy_without_them(short_walk, shrinkwrapped):
    assert bpy.ops.softground.bake() == {"FINISHED"}
    display_mesh = baked_ground.display_mesh_of(shrinkwrapped)
    assert display_mesh != shrinkwrapped
    short_walk.frame_set(1)
    before = as_rendered(display_mesh)[:, 2]
    short_walk.frame_set(30)
    assert -0.1 < (as_rendered(display_mesh)[:, 2] - before).min() < -0.02
    (warning,) = ground_mesh.warnings_of(display_mesh)
    assert "The modifiers of ground 'Field' undo prints on it" in warning


def test_prints_that_modifiers_would_undo_are_refused_where_there_may_be_no_copy(short_walk, shrinkwrapped):
    short_walk.softground.detail = "NEVER"
    assert "ground 'Field' would not show, as its modifiers undo them" in refusal(bpy.ops.softground.bake)


def test_live_prints_show_where_modifiers_would_undo_them(short_walk, shrinkwrapped):
    bpy.ops.softground.live()
    try:
        display_mesh = baked_ground.display_mesh_of(shrinkwrapped)
        before = as_rendered(display_mesh)[:, 2]
        short_walk.frame_set(15)
        assert -0.1 < (as_rendered(display_mesh)[:, 2] - before).min() < -0.02
    finally:
        bpy.ops.softground.live()


@pytest.mark.slow
@pytest.mark.parametrize("kind", slow_but_one(["SUBSURF", "DISPLACE", "SOLIDIFY", "SMOOTH", "WAVE"]))
def test_modifiers_that_let_prints_through_stay_on_the_ground(short_walk, kind):
    ground = field(short_walk, vertices=200, size=6.0)
    ground.scale = (1.0, -1.0, 1.0)
    modifier = ground.modifiers.new("Theirs", kind)
    if kind == "DISPLACE":
        modifier.strength, modifier.mid_level = 0.05, 0.0
    bpy.context.view_layer.update()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert baked_ground.display_mesh_of(ground) == ground


@pytest.mark.parametrize(("kind", "shape_keys"), [("DISPLACE", True), ("DISPLACE", False), ("SOLIDIFY", True)])
def test_the_final_mesh_holds_what_modifiers_make_of_the_ground(short_walk, kind, shape_keys):
    short_walk.softground.shape_keys = shape_keys
    ground = field(short_walk, vertices=150, size=5.0)
    ground.data.materials.append(bpy.data.materials.new("Snow"))
    ground.data.uv_layers.new(name="Theirs")
    modifier = ground.modifiers.new("Theirs", kind)
    if kind == "DISPLACE":
        modifier.strength, modifier.mid_level, modifier.direction = 0.2, 0.0, "Z"
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    short_walk.frame_set(100)
    seen = as_rendered(ground)
    meshes = len(bpy.data.meshes)
    bpy.ops.softground.final_mesh()
    still = next(thing for thing in short_walk.objects if thing.name.endswith("Final"))
    assert not still.modifiers
    assert still.data.shape_keys is None
    np.testing.assert_allclose(as_rendered(still), seen, atol=1e-6)
    assert [material.name for material in still.data.materials] == ["Snow"]
    assert still.data.materials[0] == bpy.data.materials["Snow"]
    assert [layer.name for layer in still.data.uv_layers] == ["Theirs"]
    assert not [key for key in still.data.keys() if key.startswith("softground")]  # noqa: SIM118  (an ID is no mapping)
    assert {name for name in still.data.attributes.keys() if name.startswith("softground")} == {  # noqa: SIM118
        "softground_compression",
        "softground_rim",
        "softground_age",
    }
    assert len(bpy.data.meshes) == meshes + 1


def test_a_ground_that_nodes_make_of_nothing_gets_a_copy_and_comes_back(short_walk):
    ground = bpy.data.objects.new("Made", bpy.data.meshes.new("Made"))
    short_walk.collection.objects.link(ground)
    tree, _, result = node_group()
    grid = tree.nodes.new("GeometryNodeMeshGrid")
    for name, value in (("Size X", 7.0), ("Size Y", 7.0), ("Vertices X", 30), ("Vertices Y", 30)):
        grid.inputs[name].default_value = value
    tree.links.new(grid.outputs["Mesh"], result)
    modifier = ground.modifiers.new("Theirs", "NODES")
    modifier.node_group = tree
    short_walk.softground.ground = ground
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    short_walk.frame_set(30)
    assert -0.1 < as_rendered(baked_ground.display_mesh_of(ground))[:, 2].min() < -0.02
    assert bake_report.stale_reasons(short_walk) == ()
    short_walk.frame_set(1)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert fingerprints.of_file() == before
    modifier.show_viewport = False
    bpy.context.view_layer.update()
    assert "Ground 'Made' has no faces" in refusal(bpy.ops.softground.bake)
    modifier.show_viewport = True
    short_walk.softground.detail = "NEVER"
    assert "Ground 'Made' is too coarse" in refusal(bpy.ops.softground.bake)


def test_a_modifier_that_only_renders_show_is_told_of_where_a_copy_lacks_it(short_walk):
    ground = field(short_walk)
    for name, is_shown in (("Bumps", False), ("Seen", True)):
        modifier = ground.modifiers.new(name, "DISPLACE")
        modifier.strength, modifier.mid_level, modifier.show_viewport = 0.01, 0.0, is_shown
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    (warning,) = ground_mesh.warnings_of(baked_ground.display_mesh_of(ground))
    assert "'Field' lacks what 'Bumps' shows in renders only: show it" in warning


def test_levels_that_only_renders_have_are_told_of_where_a_copy_takes_the_prints(short_walk):
    ground = field(short_walk)
    for name, levels in (("Smooth", (1, 3)), ("Same", (1, 1))):
        modifier = ground.modifiers.new(name, "SUBSURF")
        modifier.levels, modifier.render_levels = levels
    bpy.context.view_layer.update()
    report = jobs.run(bake_job.bake(short_walk)).report
    (found,) = [each for each in report["self_check"] if each["code"] == "render_levels"]
    assert "'Field' has the viewport's levels of 'Smooth' in renders too" in found["message"]
