"""A ground that the add-on made gives way to the next one, unless somebody has changed it or uses it; where legs plough
it is as fine as under feet."""

import bpy
import pytest

from softground_addon.blender.ground import trail_detail
from tests.blender.response import test_carving


def recreated(scene):
    """The grounds after Create Ground is pressed once more."""
    assert bpy.ops.softground.create_ground(use_selected=False) == {"FINISHED"}
    assert scene.softground.ground.users_collection
    return sorted(obj.name for obj in scene.objects if obj.type == "MESH" and obj.name.startswith("SoftGround"))


def test_create_ground_takes_the_place_of_one_that_nobody_changed(short_walk):
    place = bpy.data.collections.new("Set")
    bpy.ops.softground.bake()
    ground = short_walk.softground.ground
    short_walk.collection.children.link(place)
    place.objects.link(ground)
    short_walk.collection.objects.unlink(ground)
    bpy.ops.softground.clear_bake()
    meshes = len(bpy.data.meshes)
    short_walk.softground.frame_end -= 5
    assert recreated(short_walk) == ["SoftGround"]
    assert short_walk.softground.ground.users_collection == (place,)
    assert len(bpy.data.meshes) == meshes
    assert recreated(short_walk) == ["SoftGround"], "which is one as well"


def sculpt(ground):
    ground.data.vertices[7].co.z += 0.01


def paint(ground):
    ground.data.attributes.new("wet", "FLOAT", "POINT")


def unwrap(ground):
    ground.data.uv_layers[0].uv[3].vector = (0.5, 0.25)


def move(ground):
    ground.location.x += 1


def modify(ground):
    ground.modifiers.new("Swell", "WAVE")


def give_material(ground):
    ground.data.materials[0] = bpy.data.materials.new("Theirs")


def give_child(ground):
    child = bpy.data.objects.new("Fence", None)
    child.parent = ground


def group(ground):
    ground.vertex_groups.new(name="grass")


def key(ground):
    ground.keyframe_insert("location", frame=1)


def follow(ground):
    bpy.ops.object.empty_add()
    bpy.context.object.constraints.new("SHRINKWRAP").target = ground


def note(ground):
    ground["shot"] = "12b"


CHANGES = [sculpt, paint, unwrap, move, modify, give_material, give_child, group, key, follow, note]


def test_a_made_ground_that_somebody_changed_or_uses_stays(short_walk):
    """One change after the other, each on a ground of its own."""
    recreated(short_walk)
    for stayed, change in enumerate(CHANGES, start=1):
        change(short_walk.softground.ground)
        bpy.context.view_layer.update()
        assert len(recreated(short_walk)) == 1 + stayed, change.__name__


def test_a_made_ground_with_a_bake_on_it_and_a_mesh_of_the_users_stay(short_walk):
    bpy.ops.softground.bake()
    assert len(recreated(short_walk)) == 2
    bpy.ops.mesh.primitive_grid_add(size=20)
    short_walk.softground.ground = bpy.context.object
    assert len(recreated(short_walk)) == 3
    assert "Grid" in short_walk.objects


@pytest.mark.slow
@pytest.mark.parametrize("made_by", ["bake", "create_ground"])
def test_a_made_ground_is_fine_where_legs_plough(scene, made_by):
    test_carving.walker(scene, **test_carving.SHIN_DEEP)
    scene.softground.cell_size = 0.005
    getattr(bpy.ops.softground, made_by)()
    report, _ = test_carving.bake(scene)
    assert report["totals"]["carved_m3"] > 0
    assert not {"coarse_ground", "finer_copy"} & {found["code"] for found in report["self_check"]}
    assert trail_detail.detail_of(scene.softground.ground) is None
