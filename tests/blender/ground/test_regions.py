"""One ground of several materials, each of which names a preset: snow, sand, mud, and a hard floor."""

import json
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat, ground_slots, jobs, preset_files, settings
from softground_addon.blender.baking import bake_report, step_edits
from softground_addon.blender.carried import marks_object
from softground_addon.blender.debris import debris_nodes, debris_object
from softground_addon.blender.ground import baked_ground, under_layer
from softground_addon.blender.materials.materials import MARK, OVER
from softground_addon.blender.mesh_arrays import positions
from softground_addon.blender.output import sound_exports
from softground_addon.blender.panels.ground_options_panel import SOFTGROUND_PT_regions
from softground_addon.blender.playback import weather_inputs, weather_modifier, weather_nodes, weather_table
from softground_addon.blender.properties import setting_paths
from softground_addon.blender.weather import weather_regions
from softground_addon.core.errors import InputError
from softground_addon.core.events import wave_file
from softground_addon.core.ground import presets
from softground_addon.core.ground.regions import MOST
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit
from softground_addon.core.weather.weather import matter_of
from softground_addon.core.weather.weather_places import section_of
from tests.blender import command_line, shots
from tests.blender.grounds import bake, plane, refusal

BORDERS = (-0.9, -1.9, -2.9)
"""Along the walk, which goes toward -y [m]."""
PRESETS = ("", "dry_sand", "mud", ground_slots.HARD)


def over_four(scene):
    shots.walker(scene, frames=110)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Snow")
    options = scene.softground
    ground = options.ground = plane(scene, size=10.0, vertices=201)
    options.cell_size, options.detail, options.debris, options.marks = 0.02, "NEVER", False, False
    for name in ("White", "Yellow", "Brown", "Grey"):
        ground.data.materials.append(bpy.data.materials.new(name))
    divide(ground, ground.data.polygons)


def divide(ground, faces):
    """Give the faces of a ground the slots of the stripes that they lie in."""
    for face in faces:
        face.material_index = int(np.searchsorted(-np.array(BORDERS), -face.center.y))
    ground.data.update()


def choose(presets=PRESETS):
    for slot, preset in zip(bpy.context.scene.softground.ground.material_slots, presets, strict=False):
        slot.material.softground_preset = preset


@pytest.fixture
def four(opened_as):
    return opened_as(over_four)


def where(step):
    return int(np.searchsorted(-np.array(BORDERS), -step.position[1]))


def bytes_of(footprints):
    return record.dump(record.BakeRecord(list(footprints), {}))


def inside(step, stripe):
    """True if a sole stayed in one stripe, three cells from its borders."""
    y = step.window.centres(step.cell_size)[1][np.asarray(step.contact_cells) // step.window.columns]
    ends = (5.0, *BORDERS, -5.0)
    return ends[stripe + 1] + 0.06 < y.min() and y.max() < ends[stripe] - 0.06


@pytest.mark.slow
def test_each_material_prints_as_its_preset_and_a_hard_one_not_at_all(four):
    choose()
    result = bake(four)
    surfaces = {step.surface for step in result.footprints}
    assert surfaces == {"snow", "sand", "mud"}
    assert all(where(step) != 3 or abs(step.position[1] - BORDERS[2]) < 0.15 for step in result.footprints)
    steps = {(row["character"], row["contact"], row["frame_start"]): row["surface"] for row in result.report["steps"]}
    assert set(steps.values()) == surfaces
    assert {row["surface"] for row in result.report["events"] if row["step"]} == surfaces
    for stripe, preset in enumerate(PRESETS[:3]):
        choose(("",) * 4)
        bpy.ops.softground.load_preset(name=preset or "snow")
        four.softground.debris, four.softground.cell_size = False, 0.02
        alone = {(step.sole, step.start_frame): step for step in bake(four).footprints}
        mine = [step for step in result.footprints if where(step) == stripe and inside(step, stripe)]
        assert mine
        for step in mine:
            other = alone[step.sole, step.start_frame]
            assert step.max_depth_m == pytest.approx(other.max_depth_m, rel=1e-6)
            assert step.compressed_m3 == pytest.approx(other.compressed_m3, rel=1e-6)
            assert step.rim_m3 == pytest.approx(other.rim_m3, rel=1e-6)


@pytest.mark.slow
def test_steps_on_a_hard_material_are_in_the_events_and_heard(four, tmp_path):
    choose()
    table = bake(four).report["events"]
    hard = [row for row in table if row["surface"] == "hard"]
    strikes = [row for row in hard if row["phase"] == "heel_strike"]
    assert len(strikes) >= 2
    assert all(row["position"][1] < BORDERS[2] + 0.15 and row["step"] == "" for row in hard)
    four.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    four.collection.objects.link(four.camera)
    for stereo in (False, True):
        path = tmp_path / "heard.wav"
        sound_exports.write(four, path, 1, 110, stereo=stereo)
        heard = np.abs(wave_file.read(path))
        for row in strikes:
            at = round(row["time_s"] * wave_file.RATE)
            assert heard[at : at + 1000].max() > 3 * heard[max(0, at - 1500) : at - 500].max()


@pytest.mark.slow
def test_one_preset_in_all_slots_is_as_without_bit_for_bit(four):
    before = bake(four)
    assert "regions" not in before.report["inputs"]
    assert not any("surface" in row for row in before.report["steps"])
    choose(("snow", "", "snow", "snow"))
    after = bake(four)
    assert bytes_of(after.footprints) == bytes_of(before.footprints)
    assert after.report["totals"] == before.report["totals"]


@pytest.mark.slow
def test_a_bake_is_outdated_by_a_preset_or_a_face_that_is_of_another_material(four):
    bake(four)
    assert bake_report.stale_reasons(four) == ()
    four.softground.ground.data.polygons[-1].material_index = 3
    assert bake_report.stale_reasons(four) == (), "without a preset, materials are nothing but looks"
    divide(four.softground.ground, four.softground.ground.data.polygons)
    choose()
    assert bake_report.stale_reasons(four) == (
        "The settings have changed",
        "The modifiers of 'Field', or what is painted on it, have changed",
    )
    bake(four)
    assert bake_report.stale_reasons(four) == ()
    four.softground.ground.data.polygons[-1].material_index = 3
    assert bake_report.stale_reasons(four) == ("The modifiers of 'Field', or what is painted on it, have changed",)


@pytest.mark.slow
def test_a_face_attribute_counts_in_place_of_the_materials(four):
    choose()
    mesh = four.softground.ground.data
    slots = ground_slots.of_faces(mesh).copy()
    expected = bake(four).footprints
    attribute = mesh.attributes.new(ground_slots.ATTRIBUTE, "INT", "FACE")
    attribute.data.foreach_set("value", np.where(slots == 0, -1, slots).astype(np.int32))
    mesh.attributes["material_index"].data.foreach_set("value", np.zeros(len(slots), np.int32))
    attribute = mesh.attributes[ground_slots.ATTRIBUTE]
    values = np.empty(len(slots), np.int32)
    attribute.data.foreach_get("value", values)
    assert set(values) == {-1, 1, 2, 3}
    assert bytes_of(bake(four).footprints) == bytes_of(expected)


@pytest.mark.slow
def test_a_step_that_is_moved_to_another_material_is_pressed_into_that(four):
    choose()
    bake(four)
    editable = jobs.run(step_edits.reading(four))
    number, step = next((n, s) for n, s in enumerate(editable.record.steps) if where(s.baked) == 0)
    edit = StepEdit(move_m=(0.0, -2.4 - float(step.baked.position[1])))
    jobs.run(step_edits.editing(editable, {step.name: edit}))
    footprint = baked_ground.record_of(four.softground.ground).steps[number].footprint
    assert footprint.surface == "mud"
    assert footprint.max_depth_m != pytest.approx(step.baked.max_depth_m, rel=0.05)


@pytest.mark.slow
def test_a_look_goes_over_each_material_by_its_preset_and_clear_gives_them_back(four):
    choose()
    ground = four.softground.ground
    theirs = [slot.material for slot in ground.material_slots]
    bpy.ops.softground.apply_look()
    shown = [slot.material for slot in baked_ground.display_mesh_of(ground).material_slots]
    assert [each.get(MARK) for each in shown] == ["snow over", "sand over", "mud over", None]
    assert [each.get(OVER) for each in shown[:3]] == theirs[:3]
    assert shown[3] == theirs[3]
    bpy.ops.softground.load_preset(name="Soil")
    shown = [slot.material for slot in baked_ground.display_mesh_of(ground).material_slots]
    assert [each.get(MARK) for each in shown] == ["soil over", "sand over", "mud over", None]
    assert {step.surface for step in bake(four).footprints} == {"soil", "sand", "mud"}
    bpy.ops.softground.clear_bake()
    assert [slot.material for slot in ground.material_slots] == theirs
    assert [slot.softground_preset for slot in theirs] == list(PRESETS)


def test_the_panel_lists_materials_where_there_are_several_or_one_names_a_preset(four):
    context, ground = bpy.context, four.softground.ground
    bpy.ops.softground.open_settings(of="GROUND")
    assert SOFTGROUND_PT_regions.poll(context)
    while len(ground.data.materials) > 1:
        ground.data.materials.pop()
    assert not SOFTGROUND_PT_regions.poll(context)
    assert bpy.ops.softground.region_preset(slot=0, preset="mud") == {"FINISHED"}
    assert ground.material_slots[0].material.softground_preset == "mud"
    assert SOFTGROUND_PT_regions.poll(context)
    assert ground_slots.title_of(ground.material_slots[0].material) == "Mud"
    bpy.ops.softground.region_preset(slot=0, preset="none")
    assert ground_slots.title_of(ground.material_slots[0].material) == "Hard Floor"
    bpy.ops.softground.region_preset(slot=0, preset="AS_GROUND")
    assert ground.material_slots[0].material.softground_preset == ""


def test_the_panel_has_a_menu_for_each_material_with_its_preset(four):
    choose(("", "dry_sand", "none", "custard"))
    layout = MagicMock()
    layout.column.return_value = layout.split.return_value = layout
    SOFTGROUND_PT_regions.draw(SimpleNamespace(layout=layout, fields=lambda: layout), bpy.context)
    labels = [call.kwargs["text"] for call in layout.label.call_args_list]
    menus = [call.kwargs["text"] for call in layout.operator_menu_enum.call_args_list]
    assert labels == ["White", "Yellow", "Brown", "Grey"]
    assert menus == ["As the Ground", "Dry Sand", "Hard Floor", "? custard"]


def test_a_path_sets_the_preset_of_a_material_as_the_menu_does(four):
    ground = four.softground.ground
    for path, text in (("slots[1]", "dry_sand"), ('slots["Brown"]', "mud"), ("slots['Grey']", "none")):
        setting_paths.assign(four.softground, path, text)
    assert [slot.material.softground_preset for slot in ground.material_slots] == list(PRESETS)
    setting_paths.assign(four.softground, "slots[1]", "")
    assert ground.material_slots[1].material.softground_preset == ""
    for path, text, message in (
        ("slots[1]", "custard", "There is no preset 'custard'"),
        ("slots[4]", "mud", "no such material slot, 4: choose one of its materials .'White', 'Yellow'"),
        ('slots["Blue"]', "mud", "no such material slot, 'Blue'"),
    ):
        with pytest.raises(InputError, match=message):
            setting_paths.assign(four.softground, path, text)
    assert [slot.material.softground_preset for slot in ground.material_slots] == ["", "", "mud", "none"]


def test_more_presets_than_the_solver_takes_are_refused(four):
    names = sorted(path.stem for path in presets.FOLDER.glob("*.json") if path.stem != "snow")[:MOST]
    data = four.softground.ground.data
    for name in names[len(data.materials) :]:
        data.materials.append(bpy.data.materials.new(name))
    choose(names)
    assert f"more than {MOST - 1} presets" in refusal(bpy.ops.softground.bake)
    choose(names[1:])
    data.materials.pop()
    assert len(settings.snapshot(four).kinds[0]) == MOST


def test_a_linked_material_keeps_its_preset_until_it_is_local(four, tmp_path):
    library = tmp_path / "library.blend"
    stored = bpy.data.materials.new("Stored")
    stored.softground_preset = "mud"
    bpy.data.libraries.write(str(library), {stored})
    bpy.data.materials.remove(stored)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.materials = ["Stored"]
    (four.softground.ground.material_slots[1].material,) = wanted.materials
    with pytest.raises(RuntimeError, match="'Stored' is linked from another file"):
        bpy.ops.softground.region_preset(slot=1, preset="snow")
    assert "mud" in {step.surface for step in bake(four).footprints}


def test_a_preset_that_is_gone_is_named_with_its_material_and_nothing_changes(four):
    choose(("", "custard"))
    assert "Material 'Yellow' of ground 'Field': There is no preset 'custard'" in refusal(bpy.ops.softground.bake)
    four.softground.ground.data.attributes.new(ground_slots.ATTRIBUTE, "FLOAT", "POINT")
    choose(("", "mud"))
    assert "is not an integer on faces" in refusal(bpy.ops.softground.bake)


def test_a_ground_that_is_hard_wherever_somebody_walks_is_refused(four):
    choose((ground_slots.HARD,) * 4)
    assert "'Field' is nothing but hard floor under the character's path" in refusal(bpy.ops.softground.bake)


def test_a_slot_without_a_material_of_one_s_own_is_refused(four):
    ground = four.softground.ground
    ground.material_slots[1].material = None
    with pytest.raises(RuntimeError, match="Slot 2 of 'Field' has no material"):
        bpy.ops.softground.region_preset(slot=1, preset="mud")
    bpy.ops.softground.apply_look()
    with pytest.raises(RuntimeError, match="goes with the preset of the ground"):
        bpy.ops.softground.region_preset(slot=1, preset="mud")
    with pytest.raises(RuntimeError, match="no such material slot"):
        bpy.ops.softground.region_preset(slot=9, preset="mud")


@pytest.mark.slow
def test_what_the_record_says_is_read_back(four):
    choose()
    bake(four)
    record = baked_ground.record_of(four.softground.ground)
    said = json.loads(json.dumps(record.about["inputs"]["regions"]))
    assert [(each["slot"], each["preset"], each["surface"]) for each in said] == [
        (1, "dry_sand", "sand"),
        (2, "mud", "mud"),
        (3, "none", ""),
    ]
    choose(("", "", "", ""))
    made_with = jobs.run(step_edits.reading(four)).made_with
    choose()
    assert made_with.regions == settings.snapshot(four).regions


@pytest.mark.slow
def test_crumbs_look_like_the_material_that_they_come_from(four):
    choose()
    four.softground.debris = True
    bake(four)
    debris = debris_object.of(four.softground.ground)
    looks = np.empty(len(debris.data.vertices), np.int32)
    debris.data.attributes[debris_nodes.LOOK].data.foreach_get("value", looks)
    steps = baked_ground.record_of(four.softground.ground).steps
    number = np.empty(len(looks), np.int32)
    debris.data.attributes["step"].data.foreach_get("value", number)
    order = ["snow", *dict.fromkeys(step.footprint.surface for step in steps if step.footprint.surface != "snow")]
    assert [order[look] for look in looks] == [steps[n].footprint.surface for n in number]
    four.frame_set(four.softground.frame_end + 60)
    shown = debris.evaluated_get(bpy.context.evaluated_depsgraph_get())
    pieces = {
        instance.object.data.name.removeprefix("SoftGround ").partition(" Pieces")[0]
        for instance in bpy.context.evaluated_depsgraph_get().object_instances
        if instance.is_instance and instance.parent == shown
    }
    assert pieces >= {"Snow", "Mud"}
    choose(("", "", "", ""))
    bake(four)
    assert debris_nodes.LOOK not in debris_object.of(four.softground.ground).data.attributes
    assert sum(bool(block.get(debris_nodes.MARK)) for block in bpy.data.collections) == 1


def depths_of_layers(ground):
    """Depth of the layer at the vertices that a bake moves, and where these are, (K,) and (K, 3)."""
    mesh = baked_ground.display_mesh_of(ground).data
    if "softground_layer" not in mesh.attributes:
        return None
    values, places = np.empty(len(mesh.vertices), np.float32), np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["softground_layer"].data.foreach_get("value", values)
    mesh.vertices.foreach_get("co", places)
    return values[values > 0], places.reshape(-1, 3)[values > 0]


@pytest.mark.slow
def test_what_lies_below_shows_by_default_where_a_layer_is_thin(four, tmp_path, monkeypatch):
    ground = four.softground.ground
    bake(four)
    assert depths_of_layers(ground) is None
    assert "under" not in baked_ground.record_of(ground).about["inputs"]
    four.softground.under = "ALWAYS"
    assert bake_report.stale_reasons(four) == ("The settings have changed",)
    bake(four)
    assert set(depths_of_layers(ground)[0]) == {np.float32(four.softground.material.layer_depth)}
    editable = jobs.run(step_edits.reading(four))
    assert editable.made_with.under == "ALWAYS"
    jobs.run(step_edits.editing(editable, {editable.record.steps[0].name: StepEdit(mute=True)}))
    assert depths_of_layers(ground) is not None
    four.softground.under = "AUTO"
    thin = replace(presets.find("mud"), material=replace(presets.find("mud").material, layer_depth=0.04))
    (tmp_path / "thin_mud.json").write_text(presets.dump(thin))
    monkeypatch.setattr(preset_files, "user_folder", lambda: tmp_path)
    choose(("", "thin_mud", "", ground_slots.HARD))
    bake(four)
    depth, place = depths_of_layers(ground)
    is_thin = (place[:, 1] < BORDERS[0] - 0.1) & (place[:, 1] > BORDERS[1] + 0.1)
    assert depth[is_thin] == pytest.approx(0.04)
    assert (depth[place[:, 1] > BORDERS[0] + 0.1] == under_layer.DEEP).all()
    four.softground.under = "NEVER"
    bake(four)
    assert depths_of_layers(ground) is None
    bpy.ops.softground.clear_bake()
    assert not [attribute.name for attribute in ground.data.attributes if attribute.name.startswith("softground")]


def weather_by(scene, **values):
    """Have weather on a bake at these sliders."""
    bpy.ops.softground.add_weather()
    modifier = weather_modifier.modifier_of(baked_ground.display_mesh_of(scene.softground.ground))
    usual = {name: value for name, value, *_ in weather_inputs.INPUTS}
    for name, identifier in weather_modifier.inputs_of(modifier).items():
        compat.write_input(modifier, identifier, float(values.get(name.replace(" ", "_"), usual[name])))
    modifier.id_data.update_tag()


def played(scene, frame):
    """Height [m], wet look, dried look, new snow and what is blown over at the vertices that a bake shows, (V, 5)."""
    scene.frame_set(frame)
    shown = baked_ground.display_mesh_of(scene.softground.ground)
    mesh = shown.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    columns = [positions(mesh)[:, 2]]
    for name in (weather_nodes.WETNESS, weather_nodes.DRIED, weather_nodes.FRESH, weather_nodes.BLOWN):
        values = np.zeros(len(mesh.vertices), np.float32)
        if name in mesh.attributes:
            mesh.attributes[name].data.foreach_get("value", values)
        columns.append(values)
    return np.column_stack(columns)


WEATHERS = (
    {"Temperature": 4.0, "Time_Scale": 20_000.0},
    {"Snowfall": 3.0, "Temperature": -4.0, "Time_Scale": 900.0},
    {"Drying": 0.5, "Time_Scale": 2880.0},
)
"""Thaw, new snow and a dry day."""


def in_weathers(scene):
    """What is played at two frames without weather, and in each of `WEATHERS`."""
    shown = {(None, frame): played(scene, frame) for frame in (60, 200)}
    for number, sliders in enumerate(WEATHERS):
        weather_by(scene, **sliders)
        shown |= {(number, frame): played(scene, frame) for frame in (60, 200)}
    return shown


@pytest.mark.slow
@pytest.mark.parametrize("halves", [("", "mud"), ("dry_sand", ground_slots.HARD)])
def test_weather_acts_in_each_region_as_on_its_ground_alone(four, halves):
    choose(np.repeat(halves, 2).tolist())
    bake(four)
    y, mixed = positions(four.softground.ground.data)[:, 1], in_weathers(four)
    far, smoothing = (y > BORDERS[1] + 0.75, y < BORDERS[1] - 0.75), four.softground.material.blur_sigma
    bpy.ops.softground.clear_bake()
    choose(("",) * 4)
    for inside, preset in zip(far, halves, strict=True):
        if preset == ground_slots.HARD:
            floor = mixed[None, 200][inside]
            assert np.array_equal(mixed[0, 200][inside], np.where([1, 0, 0, 0, 0], floor, mixed[0, 200][inside]))
            assert np.array_equal(mixed[2, 200][inside][:, [0, 2]], floor[:, [0, 2]]), "neither melts nor dries"
            assert mixed[1, 200][inside, 0] == pytest.approx(np.median(mixed[1, 200][inside, 0])), "but snow lies on it"
            assert mixed[1, 200][inside, 0].min() > 0.005
            continue
        bpy.ops.softground.load_preset(name=preset or "snow")
        four.softground.debris, four.softground.cell_size = False, 0.02
        four.softground.material.blur_sigma = smoothing  # which is the ground's, whatever the region
        bake(four)
        alone = in_weathers(four)
        for each, values in alone.items():
            assert mixed[each][inside] == pytest.approx(values[inside], abs=1e-5), (preset, each)
        bpy.ops.softground.clear_bake()
    if "mud" in halves:
        assert np.median(mixed[0, 200][far[0], 0]) < -0.1, "snow melts"
        assert not mixed[2, 200][far[0], 2].any()
        assert np.median(mixed[2, 200][far[1], 2]) > 0.5, "mud dries"
        assert np.array_equal(mixed[0, 200][far[1], 0], mixed[None, 200][far[1], 0]), "and does not melt"


@pytest.mark.slow
def test_wind_fills_prints_by_those_of_its_own_region(four):
    choose()
    result = bake(four)
    weather_by(four, Wind=9.0, Time_Scale=60.0)
    about = baked_ground.record_of(four.softground.ground).about
    regions = weather_regions.regions_of(result.footprints, about)
    for matter, name in zip(regions.matters, ("snow", "sand", "mud"), strict=False):
        assert matter.section == section_of([step for step in result.footprints if step.surface == name])
        assert matter == matter_of(name, matter.snow_depth, matter.section)
    tree = weather_modifier.modifier_of(baked_ground.display_mesh_of(four.softground.ground)).node_group
    assert len(weather_nodes.groups_within(tree)) == 4
    y, before = positions(four.softground.ground.data)[:, 1], played(four, 110)
    windy = played(four, 2000)
    for stripe, blown in enumerate((True, True, False, False)):
        inside = (y < (5.0, *BORDERS)[stripe] - 0.4) & (y > (*BORDERS, -5.0)[stripe] + 0.4)
        deepest = before[inside, 0].min()
        filled = windy[inside, 0].min() > 0.5 * deepest
        assert filled == blown if stripe < 3 else deepest == 0.0


@pytest.mark.slow
def test_weather_of_one_region_is_one_group_and_goes_with_the_bake(four):
    bake(four)
    weather_by(four, Snowfall=2.0, Temperature=-4.0, Time_Scale=900.0)
    bake(four)
    plain, shown = played(four, 200), baked_ground.display_mesh_of(four.softground.ground)
    choose(("snow", "", "", ""))
    bake(four)
    assert np.array_equal(played(four, 200), plain)
    tree = weather_modifier.modifier_of(shown).node_group
    assert len(weather_nodes.groups_within(tree)) == 1
    assert weather_nodes.REGION not in shown.data.attributes
    choose()
    bake(four)
    assert len(weather_nodes.groups_within(weather_modifier.modifier_of(shown).node_group)) == 4
    assert weather_nodes.REGION in shown.data.attributes
    choose(("",) * 4)
    bake(four)
    assert np.array_equal(played(four, 200), plain)
    assert weather_nodes.REGION not in shown.data.attributes
    bpy.ops.softground.clear_bake()
    groups = [group.name for group in bpy.data.node_groups if group.name.startswith("SoftGround Weather")]
    tables = [obj.name for obj in bpy.data.objects if obj.name.startswith(weather_table.NAME)]
    assert not groups
    assert not tables


@pytest.mark.slow
def test_soles_carry_what_sticks_onto_a_hard_material(four):
    choose()
    four.softground.marks = True
    assert bake(four).report["totals"]["carried_kg"]["picked_up"] > 0
    marks = marks_object.of(four.softground.ground)
    bpy.context.view_layer.update()
    y = [(marks.matrix_world @ vertex.co).y for vertex in marks.data.vertices]
    assert y
    assert max(y) < BORDERS[2] + 0.01


@pytest.mark.slow
def test_the_command_line_bakes_what_it_and_the_file_say(four, tmp_path):
    choose()
    expected = [(row["id"], row["surface"], row["compressed_m3"]) for row in bake(four).report["steps"]]
    bpy.ops.softground.clear_bake()
    choose((*PRESETS[:2], "", ""))
    shot, report = tmp_path / "four.blend", tmp_path / "report.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    of_slots = ("--set", "slots['Brown']=mud", "--set", "slots[3]=none")
    done = command_line.run("bake", shot, "--dry-run", *of_slots, "--report", report)
    assert done.returncode == 0, done.stderr
    steps = json.loads(report.read_text())["steps"]
    assert [(row["id"], row["surface"], row["compressed_m3"]) for row in steps] == expected


@pytest.mark.slow
def test_live_footprints_are_those_of_the_bake(four):
    choose()
    four.frame_set(four.softground.frame_start)
    bpy.ops.softground.live()
    four.frame_set(four.softground.frame_end)
    bpy.ops.softground.live(keep=True)
    footprints = baked_ground.record_of(four.softground.ground).footprints
    bpy.ops.softground.clear_bake()
    assert bytes_of(footprints) == bytes_of(bake(four).footprints)
