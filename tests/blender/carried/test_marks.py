"""Marks on hard ground: they play by their nodes alone, and Clear takes all of them away."""

import re
import subprocess
import sys

import bmesh
import bpy
import numpy as np
import pytest

from softground_addon.blender import compat, jobs, mesh_arrays, settings
from softground_addon.blender.baking import bake_job, bake_report, step_edits
from softground_addon.blender.carried import marks_object
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes import node_modifiers
from softground_addon.blender.output import export_formats, exports, mark_images
from softground_addon.blender.playback import weather_modifier
from softground_addon.core.errors import InputError
from softground_addon.core.ground.surfaces import CARRIED_KINDS
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit
from softground_addon.core.record.footprints import NEVER
from softground_addon.core.weather import weather
from tests.blender.ground.test_hard_ground import LOW, box, listed, over_a_crate
from tests.blender.grounds import bake, heights, steps_on

HEIGHT = 0.2


def over_a_muddy_crate(scene):
    over_a_crate(scene, HEIGHT)
    scene.softground.material.surface = "mud"
    listed(bpy.data.objects["Crate"])


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    over_a_muddy_crate(scene)
    result = jobs.run(bake_job.bake(scene))
    path = tmp_path_factory.mktemp("marks") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path, result


@pytest.fixture
def scene(baked):
    bpy.ops.wm.open_mainfile(filepath=str(baked[0]))
    return bpy.context.scene


def values(mesh, name, size=1):
    out = np.empty(len(mesh.vertices) * size, np.float32)
    mesh.attributes[name].data.foreach_get("vector" if size == 3 else "value", out)
    return out.reshape(-1, size) if size > 1 else out


def shown(obj):
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def at(scene, frame):
    scene.frame_set(frame)
    return shown(marks_object.of(scene.softground.ground))


def there(mesh):
    """Number of vertices of a mesh that are part of what can be seen."""
    return len({number for face in mesh.polygons if face.area > 0 for number in face.vertices})


def in_files(obj):
    """Have marks play in the viewport as they do in renders, Alembic and USD."""
    set_input(obj, "Attributes in Viewport", True)
    return obj


def read_input(obj, name):
    modifier = obj.modifiers[0]
    return compat.read_input(modifier, node_modifiers.inputs_of(modifier)[name])


def set_input(obj, name, value):
    modifier = obj.modifiers[0]
    compat.write_input(modifier, node_modifiers.inputs_of(modifier)[name], value)
    obj.update_tag()


def blocks():
    kinds = ("objects", "meshes", "materials", "node_groups")
    return {(kind, block.name) for kind in kinds for block in getattr(bpy.data, kind)}


@pytest.mark.slow
def test_marks_lie_on_the_crate_and_weigh_what_the_report_says(scene, baked):
    obj = marks_object.of(scene.softground.ground)
    assert obj.name == "SoftGround Marks"
    place = mesh_arrays.positions(obj.data) + np.array(obj.location)
    mass = values(obj.data, "mass")
    assert place[:, 2] == pytest.approx(HEIGHT + 0.3e-3 + mass / 1700.0, abs=1e-5)
    carried = baked[1].report["totals"]["carried_kg"]
    assert carried["left_behind"] > 0.005
    assert carried["picked_up"] == pytest.approx(sum(carried.values()) - carried["picked_up"], abs=1e-9)
    assert {value.value for value in obj.data.attributes["kind"].data} == {CARRIED_KINDS.index("mud")}
    assert len({value.value for value in obj.data.attributes["step"].data}) >= 2


def test_marks_come_with_the_feet_in_any_order_of_frames(scene):
    obj = marks_object.of(scene.softground.ground)
    birth = values(obj.data, "birth")
    for as_files in (False, True):
        set_input(obj, "Attributes in Viewport", as_files)
        counts = {}
        for frame in (84, 1, 40, 60, 50, 84, 1):
            mesh = at(scene, frame)
            count = there(mesh)
            assert count == np.count_nonzero(birth <= frame)
            assert len(mesh.vertices) == (count if as_files else len(birth))
            assert counts.setdefault(frame, count) == count
        assert counts[1] == 0
        assert 0 < counts[60] <= counts[84] == len(birth)


def test_marks_dry_as_weather_dries_them(scene):
    obj = in_files(marks_object.of(scene.softground.ground))
    set_input(obj, "Drying", 0.5)
    set_input(obj, "Time Scale", 600.0)
    mesh = at(scene, 84)
    mass, age = values(mesh, "mass"), (84 - values(mesh, "birth")) / 24 * 600.0
    water = mass * 0.35 / 1000.0
    wet = weather.wetness(age * 0.5e-3 / 3600 / np.maximum(water, 1e-12) * weather.SURFACE_FILM)
    assert values(mesh, "wetness")[mass > 0] == pytest.approx(wet[mass > 0], abs=1e-3)
    assert 0 < np.mean(wet[mass > 0]) < 1


def with_uv_map(crate, scale=1.0):
    """A UV map of the crate's top that fills the image, or a part of it; its sides are a point."""
    low, size = np.array(crate.bound_box).min(axis=0), np.array(crate.dimensions)
    layer = crate.data.uv_layers.new()
    for loop in crate.data.loops:
        x, y, z = np.array(crate.data.vertices[loop.vertex_index].co) - low
        top = scale * np.array((x / size[0], y / size[1]))
        layer.uv[loop.index].vector = top if z > size[2] / 2 else (0.0, 0.0)


@pytest.mark.slow
def test_images_in_the_uv_map_of_a_floor_have_the_marks_as_they_are_shown(scene, tmp_path):
    obj, crate = in_files(marks_object.of(scene.softground.ground)), bpy.data.objects["Crate"]
    size = np.array(crate.dimensions)
    with_uv_map(crate)
    set_input(obj, "Drying", 0.5)
    set_input(obj, "Time Scale", 600.0)
    mesh = at(scene, 84)
    units, resolution = settings.units_of(scene), 512
    (image,) = mark_images.floor_images(obj, [crate], units, resolution)
    channels = image.at(84)
    quads = np.array([tuple(face.vertices) for face in mesh.polygons])
    area = np.array([face.area for face in mesh.polygons])
    expected = (np.maximum(values(mesh, "mass"), 0.0)[quads].mean(axis=1) * area).sum()
    shown_mass = channels[:, 0].sum() * size[0] * size[1] / resolution**2
    assert shown_mass == pytest.approx(expected, rel=0.06)  # without the faces over its edge
    assert 0 < channels[:, 1].max() <= 1.0
    assert channels[-1].tolist() == [0.0, 0.0, NEVER]
    assert channels[channels[:, 2] != NEVER, 2].min() == pytest.approx((84 - values(mesh, "birth").max()) / 24, abs=0.2)
    assert (image.at(1)[:, 0] == 0.0).all()
    scene.softground.ground.data.uv_layers.new()
    paths = export_formats.export(
        scene, export_formats.Options("EXR", tmp_path / "shot.exr", 84, 84, 64, outdated=True)
    )
    assert (tmp_path / "shot_marks_Crate_0084.exr") in paths


def test_images_have_the_sliders_of_their_frame_where_they_are_keyed(scene):
    obj, crate = in_files(marks_object.of(scene.softground.ground)), bpy.data.objects["Crate"]
    with_uv_map(crate)
    set_input(obj, "Time Scale", 600.0)
    modifier = obj.modifiers[0]
    path = compat.input_path(modifier, node_modifiers.inputs_of(modifier)["Drying"])
    for frame, drying in ((60, 0.0), (84, 2.0)):
        set_input(obj, "Drying", drying)
        obj.keyframe_insert(path, frame=frame)
    at(scene, 60)
    (image,) = mark_images.floor_images(obj, [crate], settings.units_of(scene), 256)
    here, later = image.at(60), image.at(84)
    assert here[here[:, 0] > 0, 1].min() == 1.0
    mesh = at(scene, 84)
    assert later[later[:, 0] > 0, 1].mean() == pytest.approx(
        values(mesh, "wetness")[values(mesh, "mass") > 0].mean(), abs=0.1
    )
    assert later[later[:, 0] > 0, 1].mean() < 0.9
    assert (image.at(84) == later).all()


def test_images_of_marks_count_the_frames_of_a_scene_whose_time_is_remapped(scene):
    obj, crate = marks_object.of(scene.softground.ground), bpy.data.objects["Crate"]
    with_uv_map(crate)
    (image,) = mark_images.floor_images(obj, [crate], settings.units_of(scene), 64)
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 200  # half as fast: nodes count half the frames
    (slow,) = mark_images.floor_images(obj, [crate], settings.units_of(scene), 64)
    assert slow.at(120)[:, 0] == pytest.approx(image.at(60)[:, 0])


def test_images_have_marks_where_they_are_before_blender_has_updated_them(scene):
    obj, crate = marks_object.of(scene.softground.ground), bpy.data.objects["Crate"]
    with_uv_map(crate)
    bpy.context.view_layer.update()
    obj.location.z += 0.5
    assert not list(mark_images.floor_images(obj, [crate], settings.units_of(scene), 64))
    crate.location.z += 0.5
    assert list(mark_images.floor_images(obj, [crate], settings.units_of(scene), 64))


def test_a_floor_whose_uv_map_is_a_point_has_no_image_of_marks(scene):
    obj, crate = marks_object.of(scene.softground.ground), bpy.data.objects["Crate"]
    with_uv_map(crate, scale=0.0)
    assert not list(mark_images.floor_images(obj, [crate], settings.units_of(scene), 64))


def test_images_have_marks_whose_faces_the_user_has_split_or_deleted(scene):
    obj, crate = marks_object.of(scene.softground.ground), bpy.data.objects["Crate"]
    with_uv_map(crate)

    def total():
        images = mark_images.floor_images(obj, [crate], settings.units_of(scene), 256)
        return sum(image.at(84)[:, 0].sum() for image in images)

    before, faces = total(), bmesh.new()
    faces.from_mesh(obj.data)
    bmesh.ops.triangulate(faces, faces=faces.faces[:7])
    faces.to_mesh(obj.data)
    assert total() == pytest.approx(before, rel=0.05)
    bmesh.ops.delete(faces, geom=faces.verts[:], context="VERTS")
    faces.to_mesh(obj.data)
    faces.free()
    assert total() == 0.0


def test_rain_keeps_marks_wet_and_washes_them_off(scene):
    obj = in_files(marks_object.of(scene.softground.ground))
    before = values(at(scene, 84), "mass")
    set_input(obj, "Drying", 0.5)
    set_input(obj, "Rain", 20.0)
    set_input(obj, "Time Scale", 600.0)
    mesh = at(scene, 84)
    fallen = 20.0 / 3600.0 * 600.0 * (84 - values(mesh, "birth")) / 24
    assert values(mesh, "mass") == pytest.approx(before * np.exp(-0.18 * fallen), rel=1e-4)
    assert (values(mesh, "wetness") == 1.0).all()
    set_input(obj, "Rain", 0.0)
    assert (values(at(scene, 84), "mass") == before).all()


def weather_on(scene, **sliders):
    """Weather on the ground with sliders, and nothing else."""
    assert bpy.ops.softground.add_weather(preset="SNOWFALL") == {"FINISHED"}
    shown = baked_ground.display_mesh_of(scene.softground.ground)
    weather = weather_modifier.modifier_of(shown)
    for name, identifier in weather_modifier.inputs_of(weather).items():
        compat.write_input(weather, identifier, sliders.get(name.replace(" ", "_"), 0.0))
    shown.update_tag()
    return weather


def test_weather_washes_marks_at_once_and_removing_it_brings_them_back(scene):
    obj = in_files(marks_object.of(scene.softground.ground))
    before, at_first = values(at(scene, 84), "mass"), marks_object.sliders_of(obj, 84)
    weather = weather_on(scene, Rain=20.0, Time_Scale=600.0)
    mesh = at(scene, 84)
    fallen = 20.0 / 3600.0 * 600.0 * (84 - values(mesh, "birth")) / 24
    assert values(mesh, "mass") == pytest.approx(before * np.exp(-0.18 * fallen), rel=1e-4)
    path = compat.input_path(weather, weather_modifier.inputs_of(weather)["Rain"])
    for frame, rain in ((60, 0.0), (84, 20.0)):
        compat.write_input(weather, weather_modifier.inputs_of(weather)["Rain"], rain)
        weather.id_data.keyframe_insert(path, frame=frame)
    assert [marks_object.sliders_of(obj, frame)["Rain"] for frame in (60, 84)] == pytest.approx([0.0, 20.0])
    assert bpy.ops.softground.remove_weather() == {"FINISHED"}
    assert marks_object.sliders_of(obj, 84) == pytest.approx(at_first)
    assert (values(at(scene, 84), "mass") == before).all()


@pytest.mark.slow
def test_marks_of_another_bake_follow_the_weather_that_is_there(scene):
    weather_on(scene, Rain=20.0, Time_Scale=600.0)
    scene.softground.carried = 0.8
    bake(scene)
    obj = in_files(marks_object.of(scene.softground.ground))
    assert marks_object.sliders_of(obj, 84)["Rain"] == 20.0
    mesh = at(scene, 84)
    assert 0.0 < values(mesh, "mass").sum() < values(obj.data, "mass").sum()


def test_weather_leaves_what_the_user_has_set_or_keyed_of_marks(scene):
    obj = marks_object.of(scene.softground.ground)
    set_input(obj, "Rain", 3.0)
    modifier = obj.modifiers[0]
    path = compat.input_path(modifier, node_modifiers.inputs_of(modifier)["Time Scale"])
    obj.keyframe_insert(path, frame=1)
    weather_on(scene, Rain=20.0, Time_Scale=600.0, Drying=0.5)
    followed = marks_object.sliders_of(obj, 84)
    assert (followed["Rain"], followed["Time Scale"], followed["Drying"]) == (3.0, 1.0, 0.5)
    assert bpy.ops.softground.remove_weather() == {"FINISHED"}
    after = marks_object.sliders_of(obj, 84)
    assert (after["Rain"], after["Time Scale"], after["Drying"]) == pytest.approx((3.0, 1.0, 0.2))


def test_they_play_without_the_add_on(scene, baked):
    script = (
        f"import bpy\nbpy.ops.wm.open_mainfile(filepath={str(baked[0])!r})\n"
        "s, o = bpy.context.scene, bpy.data.objects['SoftGround Marks']\n"
        "for f in (84, 1, 60):\n    s.frame_set(f)\n"
        "    graph = bpy.context.evaluated_depsgraph_get()\n"
        "    faces = o.evaluated_get(graph).data.polygons\n"
        "    print('count', f, len({v for p in faces if p.area > 0 for v in p.vertices}))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    counts = {int(f): int(n) for f, n in re.findall(r"count (\d+) (\d+)", done.stdout)}
    assert counts == {frame: there(at(scene, frame)) for frame in (84, 1, 60)}


def test_clear_takes_all_of_them_away_and_another_bake_renews_them(scene):
    ground = scene.softground.ground
    obj = marks_object.of(ground)
    obj.hide_render = True
    obj.location.z += 0.5
    mine = bpy.data.materials.new("Mine")
    obj.data.materials[0] = mine
    set_input(obj, "Drying", 3.0)
    before = mesh_arrays.positions(obj.data)
    assert not read_input(obj, "Attributes in Viewport")
    bake(scene)
    again = marks_object.of(ground)
    assert again == obj
    assert (mesh_arrays.positions(again.data) == before).all()
    assert again.hide_render
    assert again.location.z == pytest.approx(HEIGHT + 0.3e-3 + 0.5, abs=1e-3)
    assert again.data.materials[0] == mine
    assert read_input(again, "Attributes in Viewport")  # which mine may read
    modifier = again.modifiers[0]
    assert compat.read_input(modifier, node_modifiers.inputs_of(modifier)["Drying"]) == 3.0
    bpy.ops.softground.clear_bake()
    assert not [name for _, name in blocks() if "Marks" in name]
    assert mine.name == "Mine"


def test_what_the_viewport_shows_goes_without_marks_to_come_into_obj_files_and_apply_once_it_is_asked_for(
    scene, tmp_path
):
    obj, vertices = marks_object.of(scene.softground.ground), {}
    frame = int(np.median(values(obj.data, "birth")))
    for asked in (False, True):
        set_input(obj, "Attributes in Viewport", asked)
        scene.frame_set(frame)
        for other in scene.objects:
            other.select_set(other == obj)
        path = tmp_path / "marks.obj"
        bpy.ops.wm.obj_export(filepath=str(path), export_selected_objects=True)
        vertices[asked] = sum(line.startswith("v ") for line in path.read_text().splitlines())
    to_come = values(obj.data, "birth") > frame
    assert 0 < to_come.sum() == vertices[False] - vertices[True]
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.modifier_apply(modifier=obj.modifiers[0].name)
    assert len(obj.data.vertices) == vertices[True]


@pytest.mark.parametrize("link", ["DATA", "OBJECT"])
def test_attributes_in_the_viewport_are_switched_on_once_for_another_material_wherever_its_slot_is_linked(scene, link):
    ground = scene.softground.ground
    mine, slot = bpy.data.materials.new("Mine"), marks_object.of(ground).material_slots[0]
    slot.link = link
    slot.material = mine
    bake(scene)
    obj = marks_object.of(ground)
    assert read_input(obj, "Attributes in Viewport")
    set_input(obj, "Attributes in Viewport", False)
    bake(scene)
    obj = marks_object.of(ground)
    assert not read_input(obj, "Attributes in Viewport"), "it is the user's choice"
    assert (obj.material_slots[0].link, obj.material_slots[0].material) == (link, mine)
    obj.modifiers.clear()
    bake(scene)
    assert read_input(marks_object.of(ground), "Attributes in Viewport"), "the choice went with the modifier"


def test_marks_of_an_earlier_bake_play_by_the_present_laws_after_another(scene):
    obj = marks_object.of(scene.softground.ground)
    set_input(obj, "Drying", 3.0)
    modifier = obj.modifiers[0]
    modifier.node_group["softground_marks_made_for"] = "mud 24.0"  # before it rained on marks
    interface = modifier.node_group.interface
    interface.remove(interface.items_tree["Rain"])
    bake(scene)
    inputs = node_modifiers.inputs_of(modifier)
    assert "Rain" in inputs
    assert compat.read_input(modifier, inputs["Drying"]) == 3.0
    assert len([group for group in bpy.data.node_groups if "Marks" in group.name]) == 1


@pytest.mark.parametrize("change", ["switched off", "dry sand"])
def test_a_bake_that_leaves_none_takes_older_ones_away(scene, change):
    if change == "dry sand":
        scene.softground.material.surface = "sand"
    else:
        scene.softground.marks = False
    result = bake(scene)
    assert marks_object.of(scene.softground.ground) is None
    assert not [name for _, name in blocks() if "Marks" in name]
    assert "carried_kg" not in result.report["totals"]


@pytest.mark.slow
def test_without_hard_ground_or_switched_off_a_bake_is_as_before_bit_for_bit(opened_as):
    scene = opened_as(over_a_muddy_crate)
    covered = {}
    for marks, hard in ((True, True), (False, True), (True, False), (False, False)):
        if not hard:
            scene.softground.hard_grounds.clear()
            bpy.data.objects["Crate"].hide_render = True
        scene.softground.marks = marks
        result = bake(scene)
        ground = scene.softground.ground
        inputs = dict(result.report["inputs"])
        assert inputs.pop("marks", True) == marks
        covered[marks, hard] = (
            record.dump(record.BakeRecord(list(result.footprints), {})),
            heights(ground).tobytes(),
            {key: value for key, value in result.report["totals"].items() if key != "carried_kg"},
            inputs,
        )
        assert (marks_object.of(ground) is not None) == (marks and hard)
    assert covered[True, True] == covered[False, True]
    assert covered[True, False] == covered[False, False]


def test_soles_that_start_dirty_leave_more_and_outdate_the_bake(scene, baked):
    scene.softground.characters[0].dirty_soles = 1.0
    assert bake_report.stale_reasons(scene) == ("The settings have changed",)
    carried = bake(scene).report["totals"]["carried_kg"]
    before = baked[1].report["totals"]["carried_kg"]
    assert carried["brought"] > 0.0 == before["brought"]
    assert carried["left_behind"] > before["left_behind"]
    assert bake_report.stale_reasons(scene) == ()


@pytest.mark.slow
def test_soles_that_start_dirty_with_another_kind_leave_it_beside_sand_and_outdate_the_bake(scene):
    character = scene.softground.characters[0]
    scene.softground.material.surface, character.dirty_soles = "sand", 1.0  # which does not stick
    assert "carried_kg" not in bake(scene).report["totals"]
    character.dirty_with = "MUD"
    assert bake_report.stale_reasons(scene) == ("The settings have changed",)
    carried = bake(scene).report["totals"]["carried_kg"]
    obj = marks_object.of(scene.softground.ground)
    assert {value.value for value in obj.data.attributes["kind"].data} == {CARRIED_KINDS.index("mud")}
    assert carried["brought"] == pytest.approx(carried["left_behind"] + carried["on_soles"], abs=1e-9)
    assert carried["left_behind"] > 0
    assert bake_report.stale_reasons(scene) == ()


@pytest.mark.slow
def test_soles_take_up_what_wets_hard_ground_and_a_bake_without_it_is_outdated(scene):
    options = scene.softground
    listed(box(scene, "Path", 0.002, y=(-4.5, LOW - 0.3), bottom=-0.5))
    options.material.surface = "sand"  # which does not stick
    assert "carried_kg" not in bake(scene).report["totals"]
    assert marks_object.of(options.ground) is None
    options.hard_grounds[0].wet = "PAINT"
    assert "The settings have changed" in bake_report.stale_reasons(scene)
    carried = bake(scene).report["totals"]["carried_kg"]
    obj = marks_object.of(options.ground)
    assert carried["picked_up"] == pytest.approx(carried["left_behind"] + carried["on_soles"], abs=1e-9)
    assert {value.value for value in obj.data.attributes["kind"].data} == {CARRIED_KINDS.index("paint")}
    assert bake_report.stale_reasons(scene) == ()


def test_a_bake_is_outdated_when_marks_are_switched_off(scene):
    assert bake_report.stale_reasons(scene) == ()
    scene.softground.marks = False
    assert bake_report.stale_reasons(scene) == ("The settings have changed",)


def edit(scene, edits):
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), edits))


def state_of(obj):
    return mesh_arrays.positions(obj.data), values(obj.data, "mass")


def test_marks_follow_edits_of_steps_at_once_as_another_bake_would_have_them(scene):
    obj, frame = marks_object.of(scene.softground.ground), 84
    before, count = state_of(obj), there(at(scene, frame))
    names = [step.name for step in steps_on(scene.softground.ground)]
    edit(scene, {names[0]: StepEdit(mute=True)})
    fewer = state_of(obj)
    assert 0.0 < fewer[1].sum() < before[1].sum()
    carried = bake(scene).report["totals"]["carried_kg"]
    again = state_of(marks_object.of(scene.softground.ground))
    assert again[1] == pytest.approx(fewer[1], abs=1e-6)
    assert again[0] == pytest.approx(fewer[0], abs=1e-6)
    assert carried["picked_up"] == pytest.approx(sum(carried.values()) - carried["picked_up"], abs=1e-9)
    edit(scene, {name: StepEdit(mute=True) for name in names})
    assert not state_of(obj)[1].any()
    assert there(at(scene, frame)) == 0
    edit(scene, {})
    assert state_of(obj)[1] == pytest.approx(before[1], abs=1e-6)
    assert state_of(obj)[0] == pytest.approx(before[0], abs=1e-6)
    assert there(at(scene, frame)) == count


def test_marks_in_edit_mode_refuse_bakes_edits_and_clear_and_nothing_changes(scene):
    ground = scene.softground.ground
    obj, before = marks_object.of(ground), heights(ground)
    mass = state_of(obj)[1]
    twin = obj.copy()  # with the same mesh
    scene.collection.objects.link(twin)
    bpy.context.view_layer.objects.active = twin
    twin.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    name = steps_on(ground)[0].name
    for job in (lambda: bake(scene), lambda: edit(scene, {name: StepEdit(mute=True)}), bpy.ops.softground.clear_bake):
        with pytest.raises((InputError, RuntimeError), match=r"'SoftGround Marks' beside ground .* is in Edit Mode"):
            job()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert (state_of(obj)[1] == mass).all()
    assert (heights(ground) == before).all()
    assert not baked_ground.record_of(ground).edits


def test_marks_that_the_user_has_changed_stay_as_they_are_with_edits_of_steps(scene):
    obj = marks_object.of(scene.softground.ground)
    obj.data.attributes.remove(obj.data.attributes["share"])
    before = state_of(obj)
    edit(scene, {step.name: StepEdit(mute=True) for step in steps_on(scene.softground.ground)})
    assert (state_of(obj)[1] == before[1]).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    "change", [StepEdit(move_m=(0.3, 0.1)), StepEdit(scale=1.3), StepEdit(turn_deg=30.0), StepEdit(shift_frames=40.0)]
)
def test_marks_of_steps_that_are_moved_are_those_of_another_bake(scene, change):
    obj = marks_object.of(scene.softground.ground)
    before = state_of(obj)
    edit(scene, {step.name: change for step in steps_on(scene.softground.ground)})
    edited = state_of(obj)
    bake(scene)
    again = state_of(obj)
    assert again[1] == pytest.approx(edited[1], abs=1e-6)
    assert again[0] == pytest.approx(edited[0], abs=1e-6)
    assert (edited[1].sum() == pytest.approx(before[1].sum())) == (change.shift_frames == 0.0)


@pytest.mark.parametrize(
    ("suffix", "write", "read"),
    [
        ("abc", exports.export_alembic, lambda path: bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)),
        ("usdc", exports.export_usd, lambda path: bpy.ops.wm.usd_import(filepath=path)),
    ],
)
def test_files_of_other_programs_hold_the_marks_of_each_frame(scene, tmp_path, suffix, write, read):
    ground = scene.softground.ground
    counts = {frame: there(at(scene, frame)) for frame in (60, 84)}
    path = tmp_path / f"shot.{suffix}"
    write(ground, path, 58, 84)
    known = set(bpy.data.objects)
    read(str(path))
    marks = [obj for obj in set(bpy.data.objects) - known if obj.type == "MESH" and "Marks" in obj.name]
    assert len(marks) == 1
    for frame, count in counts.items():
        scene.frame_set(frame)
        assert len(shown(marks[0]).vertices) == count
