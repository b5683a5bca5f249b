"""What users do to a bake between two clicks: edit, rename and delete its parts, then bake again or clear."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import mesh_arrays
from softground_addon.blender.baking import bake_report
from softground_addon.blender.ground import ground_mesh, hidden_ground, trail_detail
from softground_addon.blender.playback import playback, playback_nodes
from softground_addon.blender.playback.display_key import DISPLAY_KEY
from tests.blender import fingerprints, shots
from tests.blender.grounds import plane, refusal
from tests.tiers import slow_but_one


@pytest.fixture
def baked(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    bpy.ops.softground.bake()
    return scene.softground.ground


def activate(thing):
    for other in bpy.context.view_layer.objects:
        other.select_set(False)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)


def key_positions(key):
    values = np.empty(len(key.points) * 3, dtype=np.float32)
    key.points.foreach_get("co", values)
    return values.reshape(-1, 3)


def test_nothing_is_left_of_a_playback_whose_modifier_the_user_has_deleted(baked):
    baked.modifiers.remove(playback.modifier_of(baked))
    bpy.ops.softground.clear_bake()
    assert not [group for group in bpy.data.node_groups if playback_nodes.is_playback(group)]
    assert not bpy.data.hair_curves
    assert not [thing for thing in bpy.data.objects if thing.name.startswith(playback.TABLE)]


@pytest.mark.parametrize("change", slow_but_one(["delete", "rename"]))
def test_a_display_key_that_is_gone_is_made_again(baked, change):
    shown = baked.data.shape_keys.key_blocks[DISPLAY_KEY]
    if change == "delete":
        baked.shape_key_remove(shown)
    else:
        shown.name = "Mine"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert baked.data.shape_keys.key_blocks[DISPLAY_KEY].value == 1.0


def test_a_key_that_the_user_sculpted_on_the_bake_stays_on_the_ground_under_it(scene, baked):
    mesh = baked.data
    mine = baked.shape_key_add(name="Mine", from_mix=False)
    sculpted = key_positions(mine)
    sculpted[7] += (0.0, 0.0, 0.25)
    mine.points.foreach_set("co", sculpted.ravel())

    def added():
        keys = mesh.shape_keys
        return key_positions(keys.key_blocks["Mine"]) - key_positions(keys.reference_key)

    before = added()
    scene.softground.material.youngs_modulus = 1e5
    bpy.ops.softground.bake()
    assert added() == pytest.approx(before, abs=1e-6)
    bpy.ops.softground.clear_bake()
    assert [key.name for key in mesh.shape_keys.key_blocks] == ["Basis", "Mine"]
    assert added() == pytest.approx(before, abs=1e-6)
    assert np.ptp(key_positions(mesh.shape_keys.reference_key)[:, 2]) == 0.0


def add_cube_in_edit_mode(ground):
    activate(ground)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.primitive_cube_add(location=(0.0, 2.0, 1.0))
    bpy.ops.object.mode_set(mode="OBJECT")


def join_cube(ground):
    bpy.ops.mesh.primitive_cube_add(location=(0.0, 2.0, 1.0))
    cube = bpy.context.object
    activate(ground)
    cube.select_set(True)
    bpy.ops.object.join()


def raise_far_corner(ground):
    """A hill where nobody walks, in whatever holds the shape of the ground."""
    mesh = ground.data
    holder = mesh.shape_keys.key_blocks[DISPLAY_KEY].points if mesh.shape_keys else mesh.vertices
    holder[0].co.z += 0.5
    mesh.update()


@pytest.mark.parametrize("shape_keys", slow_but_one([True, False]))
@pytest.mark.parametrize("model", slow_but_one([add_cube_in_edit_mode, join_cube, raise_far_corner]))
def test_what_was_modelled_beside_the_prints_stays(scene, model, shape_keys):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    ground = scene.softground.ground = plane(scene, size=6.0, vertices=150)
    bpy.context.view_layer.update()
    scene.softground.cell_size, scene.softground.shape_keys = 0.02, shape_keys
    before = mesh_arrays.positions(ground.data).copy()
    bpy.ops.softground.bake()

    model(ground)
    assert bake_report.stale_reasons(scene)
    expected = np.concatenate([before, ground_mesh.displayed_positions(ground)[len(before) :]])
    if model is raise_far_corner:
        expected[0, 2] += 0.5
    assert len(expected) > len(before) or not np.array_equal(expected, before)
    assert np.abs(np.diff(expected[-8:], axis=0)).max() > 0  # nothing has fallen together
    bpy.ops.softground.bake()
    assert bake_report.stale_reasons(scene) == ()
    bpy.ops.softground.clear_bake()
    assert np.array_equal(mesh_arrays.positions(ground.data), expected)


def test_clearing_in_edit_mode_is_refused_and_changes_nothing(baked):
    activate(baked)
    bpy.ops.object.mode_set(mode="EDIT")
    assert "Edit Mode" in refusal(bpy.ops.softground.clear_bake)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert ground_mesh.is_baked(baked)


def test_a_baked_mesh_whose_vertices_were_all_deleted_can_be_cleared(baked):
    activate(baked)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.delete(type="VERT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert not baked.modifiers
    assert "no faces" in refusal(bpy.ops.softground.bake)


@pytest.mark.slow
def test_what_is_left_of_a_bake_without_its_record_can_be_cleared(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    field = scene.softground.ground = plane(scene)
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    bpy.ops.softground.bake()
    del field.data[ground_mesh.RECORD]
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert fingerprints.of_file() == before


def retype(attribute, kind, domain):
    def spoil(ground):
        mesh = ground.data
        mesh.attributes.remove(mesh.attributes[attribute])
        mesh.attributes.new(attribute, kind, domain)

    return spoil


@pytest.mark.parametrize(
    "spoil",
    slow_but_one(
        [
            retype("softground_moved", "FLOAT", "POINT"),
            retype("softground_compression", "INT", "FACE"),
            lambda ground: ground.data.__setitem__(ground_mesh.SUMMARY, "many steps"),
            lambda ground: ground.data.__setitem__(ground_mesh.RECORD, {"steps": 3}),
            lambda ground: ground.__setitem__(hidden_ground.WAS_HIDDEN, "yes"),
        ]
    ),
    ids=["moved", "compression", "summary", "record", "was hidden"],
)
def test_whatever_is_made_of_the_bakes_data_clearing_gives_the_ground_back(scene, spoil):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    field = scene.softground.ground = plane(scene, vertices=150, size=5.0)
    bpy.context.view_layer.update()
    flat = mesh_arrays.positions(field.data)
    bpy.ops.softground.bake()
    assert np.ptp(mesh_arrays.positions(field.data)[:, 2]) > 0.02
    spoil(field)
    assert all(isinstance(value, (int, float)) for value in ground_mesh.summary_of(field).values())
    bpy.ops.softground.clear_bake()
    assert np.array_equal(mesh_arrays.positions(field.data), flat)
    assert not field.hide_viewport


@pytest.mark.slow
def test_undisturbed_positions_that_were_converted_are_only_passed_over(scene, baked):
    now = mesh_arrays.positions(baked.data)
    retype(ground_mesh.REST, "FLOAT", "POINT")(baked)
    assert np.array_equal(ground_mesh.rest_positions(baked.data), now)
    bpy.ops.softground.bake()


def test_a_bake_on_a_linked_ground_is_not_cleared(scene, baked, tmp_path):
    path = tmp_path / "set.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.objects = ["SoftGround"]
    ground = wanted.objects[0]
    bpy.context.scene.collection.objects.link(ground)
    bpy.context.scene.softground.ground = ground
    assert "linked" in refusal(bpy.ops.softground.clear_bake)
    assert ground_mesh.is_baked(ground)
    assert ground.modifiers


def test_the_ground_is_shown_again_where_its_fine_copy_was_deleted(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    field = scene.softground.ground = plane(scene, vertices=2)
    field.hide_render = True
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    bpy.ops.softground.bake()
    bpy.data.objects.remove(trail_detail.detail_of(field))
    bpy.ops.softground.bake()
    copy = trail_detail.detail_of(field)
    assert (copy.hide_viewport, copy.hide_render) == (False, True), "as the ground was before the first bake"
    assert not hidden_ground.hides(copy)
    bpy.data.objects.remove(copy)
    assert (field.hide_viewport, field.hide_render) == (True, True)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert (field.hide_viewport, field.hide_render) == (False, True)
    assert fingerprints.of_file()["objects"]["Field"] == before["objects"]["Field"]


@pytest.mark.slow
def test_a_duplicate_of_the_fine_copy_is_the_users_own(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    field = scene.softground.ground = plane(scene, vertices=2)
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    copy = trail_detail.detail_of(field)
    mine = copy.copy()
    mine.data = copy.data.copy()
    scene.collection.objects.link(mine)
    bpy.ops.softground.clear_bake()
    assert not bpy.ops.softground.clear_bake.poll()
    vertices = len(mine.data.vertices)
    bpy.ops.softground.bake()
    assert trail_detail.detail_of(field) != mine
    assert (len(mine.data.vertices), len(mine.modifiers)) == (vertices, 1)


def test_a_linked_duplicate_of_the_fine_copy_goes_on_playing_its_bake(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    scene.softground.ground = plane(scene, vertices=2)
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()
    mine = trail_detail.detail_of(scene.softground.ground).copy()
    scene.collection.objects.link(mine)

    def played(frame):
        scene.frame_set(frame)
        return mesh_arrays.positions(mine.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)

    first = {frame: played(frame) for frame in (1, 15, 30)}
    for operator in (bpy.ops.softground.bake, bpy.ops.softground.clear_bake):
        operator()
        assert all(np.array_equal(played(frame), heights) for frame, heights in first.items())


def test_a_ground_that_was_deleted_in_the_viewport_is_not_baked_on(scene, baked):
    activate(baked)
    bpy.ops.object.delete()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    fresh = scene.softground.ground
    assert fresh != baked
    assert fresh.name in scene.objects


def test_a_character_that_was_deleted_in_the_viewport_prints_no_more(scene, baked):
    activate(scene.softground.characters[0].armature)
    bpy.ops.object.delete()
    assert "No character" in refusal(bpy.ops.softground.create_ground)
    other = shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    assert [other.name] == [
        character.armature.name for character in scene.softground.characters if character.armature.users_collection
    ]


def test_a_fine_copy_that_was_deleted_in_the_viewport_does_not_live_on_after_clear(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    field = scene.softground.ground = plane(scene, vertices=2)
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    bpy.ops.softground.bake()
    activate(trail_detail.detail_of(field))
    bpy.ops.object.delete()
    assert trail_detail.detail_of(field) is None
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file()["objects"].keys() == before["objects"].keys()
    assert fingerprints.of_file()["meshes"] == before["meshes"]
