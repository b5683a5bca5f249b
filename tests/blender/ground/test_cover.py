"""Cover: a ground on any object, which prints like any other."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import mesh_arrays
from softground_addon.blender.ground import baked_ground
from tests.blender import fingerprints, shots
from tests.blender.grounds import bake, heights


@pytest.fixture
def platform(scene):
    """A walk over a platform whose top is the level that the feet walk on, less the snow."""
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, -0.35), scale=(1.4, 8.0, 0.5))
    bpy.context.object.name = "Platform"
    scene.softground.cell_size, scene.softground.debris = 0.02, False
    return scene


def test_a_cover_is_the_ground_and_is_printed_no_deeper_than_it_is_thick(platform):
    options, box = platform.softground, bpy.context.object
    assert bpy.ops.softground.cover(thickness_cm=10.0) == {"FINISHED"}
    ground = options.ground
    assert ground.name == "Platform Cover"
    assert bpy.context.selected_objects == [ground]
    assert ground.data.materials[0].name == "SoftGround Snow"
    assert options.material.layer_depth == pytest.approx(0.1)
    z = heights(ground)[:, 2]
    assert (z.min(), z.max()) == pytest.approx((-0.1, 0.0), abs=1e-3)
    options.material.youngs_modulus = 20e3  # which would sink deeper
    result = bake(platform)
    assert len(result.footprints) >= 2
    assert all(0.05 < step.max_depth_m <= 0.1 * (1 + 1e-6) for step in result.footprints)
    assert "softground_layer" not in baked_ground.display_mesh_of(ground).data.attributes
    assert box.data.attributes.keys() == bpy.data.objects["Platform"].data.attributes.keys()
    assert not any(name.startswith("softground") for name in box.data.attributes.keys())  # noqa: SIM118
    assert not [finding for finding in result.report["warnings"] if "Hard Ground" in finding]


@pytest.mark.slow
def test_what_is_covered_is_hard_ground_and_bears_beside_the_cover(platform):
    options, box = platform.softground, bpy.context.object
    options.painted.layer_depth = "Mine"  # of another ground
    bpy.ops.softground.cover(thickness_cm=10.0)
    assert [item.object for item in options.hard_grounds] == [box]
    assert options.painted.layer_depth == "softground_layer_depth"
    prints = bake(platform).footprints
    options.hard_grounds.clear()
    without = bake(platform).footprints
    assert [step.max_depth_m for step in prints] == pytest.approx([step.max_depth_m for step in without])
    options.hard_grounds.add().object = box
    bpy.context.view_layer.objects.active = box
    box.select_set(True)
    bpy.ops.softground.cover(thickness_cm=5.0)
    assert [item.object for item in options.hard_grounds] == [box]


def test_a_cover_of_an_object_that_is_turned_scaled_and_modified_lies_on_what_is_seen(scene):
    bpy.ops.mesh.primitive_cube_add(size=40.0, location=(3.0, 1.0, 2.0), rotation=(np.pi, 0.0, 0.4))
    box = bpy.context.object
    box.scale = (1.0, 0.5, -0.25)
    box.modifiers.new("Array", "ARRAY").count = 2
    scene.unit_settings.scale_length = 0.01
    bpy.context.view_layer.update()
    assert bpy.ops.softground.cover(thickness_cm=2.0) == {"FINISHED"}
    points = heights(scene.softground.ground)
    assert points[:, 2].max() == pytest.approx(2.0 + 5.0 + 2.0, abs=0.03)  # of 1 cm each
    assert np.hypot(*np.ptp(points[:, :2], axis=0)) > 70.0


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (9.81, 0.0, 0.0)])
def test_a_cover_lies_where_gravity_holds_it_also_far_from_the_origin(scene, gravity):
    place, up = np.array([500_000.0, 300_000.0, 10.0]), -np.array(gravity) / 9.81
    for far in (0.0, 1.0):
        bpy.ops.mesh.primitive_cube_add(location=place * far)
        scene.gravity, scene.softground.ground = gravity, None
        bpy.ops.softground.cover(thickness_cm=10.0)
        ground = scene.softground.ground
        turn = np.array(ground.matrix_world)[:3, :3]
        points = mesh_arrays.positions(ground.data) @ turn.T + (np.array(ground.location) - place * far)
        assert points @ up == pytest.approx(np.clip(points @ up, 1.0, 1.1 + 1e-3), abs=1e-4)
        assert np.ptp(points @ up) == pytest.approx(0.1, abs=1e-3)
        across = np.sort(np.ptp(points, axis=0))
        assert across == pytest.approx([0.1, 2.0, 2.0], abs=1e-3)


def test_what_cannot_be_covered_is_refused_and_nothing_changes(scene):
    bpy.ops.mesh.primitive_plane_add(rotation=(np.pi / 2, 0.0, 0.0))
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    with pytest.raises(RuntimeError, match=r"'Plane' cannot be covered\. It has no faces that look up"):
        bpy.ops.softground.cover()
    assert fingerprints.of_file() == before
    bpy.context.object.rotation_euler = (0.0, 0.0, 0.0)
    bpy.context.object.keyframe_insert("location", frame=1)
    bpy.context.object.location.x = 1.0
    bpy.context.object.keyframe_insert("location", frame=10)
    with pytest.raises(RuntimeError, match="'Plane' moves, as 'Plane' is animated: cover a copy"):
        bpy.ops.softground.cover()
    assert scene.softground.ground is None
    bpy.context.object.select_set(False)
    assert not bpy.ops.softground.cover.poll()


def test_undo_takes_a_cover_away_with_all_that_it_set(platform):
    bpy.ops.ed.undo_push(message="Opened")
    before = fingerprints.of_file()
    layer, under = platform.softground.material.layer_depth, platform.softground.under
    bpy.ops.softground.cover()
    bpy.ops.ed.undo_push(message="Cover")
    bpy.ops.ed.undo()
    options = bpy.context.scene.softground
    assert (options.ground, options.under) == (None, under)
    assert options.material.layer_depth == layer
    assert "Platform Cover" not in bpy.data.objects
    assert fingerprints.of_file() == before
