"""Panels, presets and the depth to expect, as far as they can be seen without a window."""

import itertools
import json
import re
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import blf
import bpy
import numpy as np
import pytest

from release import strings
from softground_addon.blender import ground_presets, jobs, registration, session, settings, translation
from softground_addon.blender.baking import bake_job
from softground_addon.blender.operators import bake_result, modal_bake, prediction
from softground_addon.blender.panels import (
    ground_options_panel,
    panels,
    preset_icons,
    preset_menu,
    response_panel,
    steps_panel,
    weather_panel,
)
from softground_addon.blender.reading import analysis
from softground_addon.blender.setup import shot_setup
from softground_addon.blender.state import state
from softground_addon.core.ground import presets
from softground_addon.core.loads.cell_limits import Coverage, Fineness
from softground_addon.core.motion.motion import JOINTS
from tests.blender.shots import import_motion, walker
from tests.tiers import slow_but_one

ROOT = Path(__file__).parents[3]


@pytest.fixture
def shot(scene):
    walker(scene, frames=60)
    bpy.ops.softground.add_character()
    return scene


@pytest.fixture
def user_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(preset_menu, "user_folder", lambda: tmp_path)
    return tmp_path


def operators():
    return [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Operator)]


def test_everything_has_a_tooltip_and_search_finds_it(addon):
    for cls in operators():
        assert cls.bl_label
        assert cls.__doc__ or hasattr(cls, "description")
    groups = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.PropertyGroup)]
    for group in groups:
        for setting in group.bl_rna.properties:
            nameless = setting.identifier in ("rna_type", "name") or setting.is_hidden
            if not nameless and setting.type not in ("POINTER", "COLLECTION"):
                assert setting.description, f"{group.__name__}.{setting.identifier}"


def test_tooltips_of_buttons_are_sentences_without_the_breaks_of_the_source(addon):
    for cls in operators():
        group, name = cls.bl_idname.split(".")
        tooltip = getattr(getattr(bpy.ops, group), name).get_rna_type().description
        assert tooltip == " ".join(tooltip.split()), cls.bl_idname
        assert not tooltip.endswith("."), cls.bl_idname


LABEL, CHECKBOX = 88, 112
"""Widest names that are whole beside a field and beside a checkbox, in a sidebar as wide as Blender makes it [px]."""


@pytest.mark.parametrize("language", ["en_US", *strings.LANGUAGES])
def test_names_are_whole_in_a_sidebar_of_blender_s_own_width(addon, language):
    blf.size(0, 11.0)
    catalogue = translation.catalogue(language)
    for group in (cls for cls in registration.CLASSES if issubclass(cls, bpy.types.PropertyGroup)):
        shown = {key: setting for key, setting in group.bl_rna.properties.items() if not setting.is_hidden}
        for key, setting in shown.items():
            in_field_units = any(other.startswith(f"{key}_") for other in shown)
            if not in_field_units and key != "youngs_modulus":
                room = CHECKBOX if setting.type == "BOOLEAN" else LABEL
                name = catalogue.get(setting.name, setting.name)
                assert blf.dimensions(0, name)[0] <= room, name


def test_panels_come_in_the_order_of_work(addon):
    every = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Panel)]
    shown = [cls for cls in every if not getattr(cls, "bl_parent_id", "")]
    order = [cls.bl_label for cls in sorted(shown, key=lambda cls: getattr(cls, "bl_order", 0))]
    of_objects = ["SoftGround Character", "SoftGround Ground"]
    assert [label for label in order if label not in of_objects] == [
        *("Character", "Ground", "Look of Prints", "Feet", "Bake", "Weather", "Steps")
    ]


def drawn(panel):
    """What a panel draws, each as a call of its layout, and the layout."""
    layout = MagicMock()
    for part in ("row", "column", "box", "split"):
        getattr(layout, part).return_value = layout
    for part in ("draw", "draw_header_preset"):
        if hasattr(panel, part):
            getattr(panel, part)(SimpleNamespace(layout=layout, fields=lambda: layout), bpy.context)
    return layout.method_calls, layout


CONTROLS = ("prop", "prop_search", "operator", "menu", "template_list", "operator_menu_enum")


@pytest.mark.slow
def test_what_panels_have_translated_is_in_the_catalogues(shot):
    asked = set()
    for step in (int, bpy.ops.softground.bake, bpy.ops.softground.add_weather):
        step()
        for cls in (cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Panel | bpy.types.Menu)):
            if not hasattr(cls, "poll") or cls.poll(bpy.context):
                options = [options for *_, options in drawn(cls)[0] if options.get("translate") is not False]
                asked |= {each.get(key, "") for each in options for key in ("text", "heading")}
    assert asked >= {"Amount", "Presets", "Previous", "Densest Packing", "Snow Depth at the End (cm)"}
    assert asked <= {*strings.shown(), *strings.AS_IT_IS, ""}


def test_the_first_screen_is_a_score_of_controls(shot):
    bpy.ops.softground.bake()
    first = (panels.SOFTGROUND_PT_character, panels.SOFTGROUND_PT_ground, panels.SOFTGROUND_PT_bake)
    controls = [call for panel in first for call in drawn(panel)[0] if call[0] in CONTROLS]
    assert 12 < len(controls) <= 20


def controls(*, place="UI"):
    """Number of controls of all panels of a region, with everything open."""
    every = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Panel)]
    there = [cls for cls in every if cls.bl_region_type == place]
    shown = [cls for cls in there if not hasattr(cls, "poll") or cls.poll(bpy.context)]
    return sum(call[0] in CONTROLS for cls in shown for call in drawn(cls)[0])


@pytest.mark.slow
def test_with_everything_open_the_sidebar_of_a_walking_figure_has_at_most_60_controls(shot):
    assert controls() <= 42
    bpy.ops.softground.bake()
    assert controls() <= 54
    bpy.ops.softground.add_weather()
    assert controls() <= 60


def test_the_settings_of_ground_and_character_stand_in_the_physics_of_each(shot):
    walks = bpy.context.active_object
    of_character, of_ground = (f"SOFTGROUND_PT_of_{part}" for part in ("character", "ground"))

    def pages():
        every = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Panel)]
        shown = [cls for cls in every if cls.bl_region_type == "WINDOW" and cls.poll(bpy.context)]
        assert {cls.bl_context for cls in shown} <= {"physics"}
        return {getattr(cls, "bl_parent_id", "") or cls.__name__ for cls in shown}

    assert pages() == {of_character, of_ground}, "no ground is there to have its own page"
    bpy.ops.softground.bake()
    assert pages() == {of_character}
    before = controls(place="WINDOW")
    bpy.ops.softground.open_settings(of="GROUND")
    assert bpy.context.active_object == shot.softground.ground
    assert pages() == {of_ground}
    assert max(before, controls(place="WINDOW")) <= 40
    bpy.ops.softground.open_settings(of="CHARACTER")
    assert bpy.context.active_object == walks
    assert pages() == {of_character}
    bpy.ops.mesh.primitive_cube_add()
    assert pages() == set()
    delete(shot.softground.ground)
    assert bpy.ops.softground.open_settings(of="GROUND") == {"FINISHED"}
    assert bpy.context.active_object == walks
    assert pages() == {of_character, of_ground}, "the ground is there no more"
    delete(walks)
    with pytest.raises(RuntimeError, match=f"'{walks.name}' was deleted: undo, or remove the character"):
        bpy.ops.softground.open_settings(of="CHARACTER")


class Pinned:
    """A Properties editor that offers no Physics, as Blender refuses it."""

    def __setattr__(self, name, value):
        raise TypeError(f"bpy_struct: item.attr = val: enum \"{value}\" not found in ('TOOL', 'WORLD')")


def test_an_editor_that_offers_no_physics_is_left_as_it_is():
    def editor(kind, space):
        return SimpleNamespace(type=kind, spaces=SimpleNamespace(active=space))

    offers = SimpleNamespace(context="OBJECT")
    pinned, viewport = editor("PROPERTIES", Pinned()), editor("VIEW_3D", SimpleNamespace())
    assert not shot_setup.show_physics([pinned, viewport])
    assert shot_setup.show_physics([pinned, editor("PROPERTIES", offers)])
    assert offers.context == "PHYSICS"


def delete(obj):
    """Delete an object as in the viewport: the settings still name it."""
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.ops.object.delete()


def test_a_character_that_is_not_chosen_is_chosen_in_its_physics(shot):
    second = walker(shot, frames=60)
    bpy.ops.object.select_all(action="DESELECT")
    second.select_set(True)
    bpy.ops.softground.add_character()
    assert panels.SOFTGROUND_PT_soles.poll(bpy.context)
    shot.softground.active_character = 0
    assert panels.SOFTGROUND_PT_of_character.poll(bpy.context)
    assert not panels.SOFTGROUND_PT_soles.poll(bpy.context)
    calls, layout = drawn(panels.SOFTGROUND_PT_of_character)
    assert [call[1][0] for call in calls if call[0] in CONTROLS] == ["wm.context_set_int"]
    assert (layout.operator().data_path, layout.operator().value) == ("scene.softground.active_character", 1)


def test_a_joint_of_the_body_is_chosen_in_a_list_and_given_its_bone(shot):
    character = shot.softground.characters[0]
    for number in range(len(character.joints)):
        character.active_joint = number
        calls, _ = drawn(panels.SOFTGROUND_PT_joints)
        asked = [call[1][:2] for call in calls if call[0] in ("prop", "prop_search")]
        assert asked[-2:] == [(character.joints[character.active_joint], field) for field in ("bone", "end")]
    _, places = panels.SOFTGROUND_UL_joints.filter_items(None, bpy.context, character, "joints")
    names = [joint.name for _, joint in sorted(zip(places, character.joints, strict=True), key=lambda pair: pair[0])]
    assert names == [joint for joint in JOINTS if joint in names]
    character.active_joint = len(character.joints)
    assert [call[0] for call in drawn(panels.SOFTGROUND_PT_joints)[0]] == ["prop", "operator", "template_list"]


def test_what_makes_a_bake_outdated_takes_no_room_and_raises_no_alarm(shot):
    bpy.ops.softground.bake()
    state = session.current()
    before, _ = drawn(panels.SOFTGROUND_PT_bake)
    state.stale = "The settings have changed\n'Walker' has moved"
    try:
        after, layout = drawn(panels.SOFTGROUND_PT_bake)
        tooltip = modal_bake.SOFTGROUND_OT_bake_again.description(bpy.context, None)
    finally:
        state.stale = ""
    assert [call[0] for call in after] == [call[0] for call in before]
    assert layout.alert is not True
    notes = [call[2]["text"] for call in after if call[0] == "label"]
    assert "The settings have changed; 'Walker' has moved" in notes
    assert "'Walker' has moved" in tooltip


def test_a_bake_brings_steps_and_weather(shot):
    of_a_bake = (steps_panel.SOFTGROUND_PT_steps, weather_panel.SOFTGROUND_PT_weather)
    assert not any(panel.poll(bpy.context) for panel in of_a_bake)
    bpy.ops.softground.bake()
    assert all(panel.poll(bpy.context) for panel in of_a_bake)


def test_all_else_is_closed(addon):
    every = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Panel)]
    open_ones = [cls for cls in every if "DEFAULT_CLOSED" not in getattr(cls, "bl_options", ())]
    assert {cls.bl_label for cls in open_ones} == {"Character", "Ground", "Bake", "SoftGround"}
    assert [cls.bl_region_type for cls in open_ones if cls.bl_label == "SoftGround"] == ["HEADER"]  # of the overlays


def test_where_docs_and_messages_say_that_a_setting_is_there_is_a_panel(addon):
    every = [cls for cls in registration.CLASSES if issubclass(cls, bpy.types.Panel)]
    below = {"Physics": [cls.bl_label for cls in every if cls.bl_region_type == "WINDOW"]}
    below |= {"Feet": ["Hard Ground"], "Bake": ["Output"]}
    place = re.compile(rf"\b({'|'.join(below)}) > ([A-Z][\w-]+(?: [\w-]+)*)")
    named = []
    for path in (*(ROOT / "docs").glob("**/*.md"), *(ROOT / "softground_addon").glob("**/*.py")):
        named += place.findall(re.sub(r'"\s+f?"', "", path.read_text(encoding="utf-8")))
    assert len(named) > 50
    assert [where for where in named if not where[1].startswith(tuple(below[where[0]]))] == []


def test_the_material_is_shown_in_field_units(shot):
    material = shot.softground.material
    material.stiffness_mpa = 2.5
    assert material.youngs_modulus == 2.5e6
    material.layer_depth = 0.45
    assert material.layer_depth_cm == pytest.approx(45.0)
    material.crust_stress_kpa, material.firm_depth_cm = 30.0, 2.0
    assert (material.crust_stress, material.firm_depth) == pytest.approx((30e3, 0.02))
    shot.softground.tread_mm = 1.5
    assert shot.softground.tread == pytest.approx(0.0015)
    shot.softground.cell_size_cm = 2
    assert shot.softground.cell_size == pytest.approx(0.02)


def test_the_depth_to_expect_is_that_of_a_bake(shot):
    assert analysis.expected_depth(shot) is None
    bpy.ops.softground.predict_depth()
    expected = analysis.expected_depth(shot)
    bpy.ops.softground.bake()
    assert shot.softground.ground.data["softground_summary"]["typical_depth_m"] == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_a_depth_that_is_typed_is_that_of_a_bake(shot, capsys):
    options = shot.softground
    assert prediction.look(shot)[1] is None
    stiffness = options.material.youngs_modulus
    options.depth_cm = 5.0
    assert options.material.youngs_modulus != stiffness, "a script need not have the shot read first"
    assert prediction.look(shot)[1] is not None
    bpy.ops.softground.bake()
    assert options.ground.data["softground_summary"]["typical_depth_m"] == pytest.approx(0.05, rel=0.02)
    stiffness = options.material.youngs_modulus
    options.depth_cm = 1e5
    assert options.material.youngs_modulus == stiffness, "no ground gives that"
    assert "InputError" in capsys.readouterr().err


def test_a_depth_that_a_script_types_for_a_shot_that_cannot_be_read_says_why(shot, capsys):
    stiffness = shot.softground.material.youngs_modulus
    shot.softground.frame_start, shot.softground.frame_end = 10, 5
    shot.softground.depth_cm = 5.0
    assert "InputError: The frame range" in capsys.readouterr().err
    assert shot.softground.material.youngs_modulus == stiffness


def test_the_panel_warns_before_the_bake_where_steps_will_end_at_the_bottom(shot):
    def said():
        layout = MagicMock()
        panels.SOFTGROUND_PT_ground.draw(SimpleNamespace(fields=lambda: layout), bpy.context)
        return [call.kwargs["text"] for call in layout.label.call_args_list]

    bpy.ops.softground.predict_depth()
    assert not any("bottom" in text for text in said())
    shot.softground.material.youngs_modulus = 2e4
    bpy.ops.softground.predict_depth()
    prediction.look_anew()
    assert "Pressed to the bottom, 30 cm" in said()


@pytest.mark.parametrize("sinks", [True, False])
def test_acting_is_offered_where_a_bake_lowers_the_feet(shot, sinks):
    shot.softground.grounding.use, shot.softground.sink_feet = False, sinks
    columns = [MagicMock() for _ in range(8)]
    layout = MagicMock()
    layout.column.side_effect = columns
    response_panel.SOFTGROUND_PT_feet.draw(SimpleNamespace(fields=lambda: layout), bpy.context)
    acting = next(column for column in columns if any("knee_lift" in call.args for call in column.prop.call_args_list))
    assert acting.active is sinks


def test_the_selected_mesh_is_the_ground_by_a_button_of_its_own(shot):
    assert not bpy.ops.softground.use_as_ground.poll()
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    mine = bpy.context.active_object
    assert bpy.ops.softground.create_ground(use_selected=False) == {"FINISHED"}
    assert shot.softground.ground != mine
    bpy.context.view_layer.objects.active = mine
    mine.select_set(True)
    assert bpy.ops.softground.use_as_ground() == {"FINISHED"}
    assert shot.softground.ground == mine


def test_the_cells_to_expect_are_those_that_a_bake_prints(shot):
    known = analysis.read(shot)
    footprints = jobs.run(bake_job.bake(shot, write=False)).footprints
    printed = sum(len(footprint.contact_cells) for footprint in footprints)
    assert known.coverage.area / shot.softground.cell_size**2 == pytest.approx(printed, rel=0.3)
    coverage = Coverage(0.4, 0.0, np.zeros((0, 2)), np.zeros(0, int))
    assert ground_options_panel.estimate(coverage, Fineness(0.01, 0.04)) == "About 4,000 cells, 14 MB, 1 seconds"
    assert ground_options_panel.estimate(coverage, Fineness(0.002, 0.04)) == "About 100,000 cells, 100 MB, 4 seconds"
    carved = Fineness(0.002, 0.04, is_carved=True)
    assert ground_options_panel.estimate(coverage, carved) == "About 100,000 cells, 550 MB, 21 seconds"
    close = Fineness(0.01, 0.04, "CLOSE_UP", 2_000_000)
    assert ground_options_panel.estimate(coverage, close) == "About 4,000 cells, 68 MB, 2 seconds"
    assert ground_options_panel.vertices(192_000, 2_000_000) == "About 190,000 vertices along the whole trail"
    over = "About 190,000 vertices along the whole trail, over Max Vertices"
    assert ground_options_panel.vertices(192_000, 100_000) == over


def test_a_bake_is_expected_to_carve_where_feet_sink_beyond_the_ankle(shot):
    material = shot.softground.material
    shot.softground.sink_feet, material.layer_depth = True, 0.6
    for modulus, carves in ((123e3, True), (3e6, False)):
        material.youngs_modulus = modulus
        bpy.ops.softground.predict_depth()
        assert prediction.fineness(*prediction.look(shot)).is_carved == carves


def test_the_depth_to_expect_follows_the_sliders(shot):
    bpy.ops.softground.predict_depth()
    before = analysis.expected_depth(shot)
    shot.softground.material.stiffness_mpa *= 3
    assert analysis.expected_depth(shot) == pytest.approx(before / 3, rel=0.3)
    shot.softground.characters[0].mass *= 2
    assert analysis.expected_depth(shot) > 0.5 * before


def test_the_depth_to_expect_holds_on_for_a_ground_that_is_created_to_fit(shot):
    bpy.ops.softground.predict_depth()
    known, expected = analysis.known(settings.snapshot(shot)), analysis.expected_depth(shot)
    bpy.ops.softground.create_ground()
    bpy.context.view_layer.update()
    assert analysis.known(settings.snapshot(shot)).contacts is known.contacts
    assert analysis.expected_depth(shot) == expected


@pytest.mark.slow
@pytest.mark.parametrize("grounding", slow_but_one([False, True]))
def test_the_depth_to_expect_holds_on_through_a_bake_and_its_end(shot, grounding):
    shot.softground.grounding.use = grounding
    bpy.ops.softground.predict_depth()
    known, expected = analysis.known(settings.snapshot(shot)), analysis.expected_depth(shot)
    for change in (bpy.ops.softground.bake, bpy.ops.softground.bake, bpy.ops.softground.clear_bake):
        change()
        bpy.context.view_layer.update()
        assert analysis.known(settings.snapshot(shot)).contacts is known.contacts
        assert analysis.expected_depth(shot) == expected


@pytest.mark.slow
def test_the_depth_to_expect_holds_on_through_another_look_of_a_baked_ground(shot):
    bpy.ops.softground.predict_depth()
    bpy.ops.softground.bake()
    known, in_snow = analysis.known(settings.snapshot(shot)), analysis.expected_depth(shot)
    assert shot.softground.ground.data.shape_keys  # which Blender takes for edited with the mesh that has them
    for change in (lambda: bpy.ops.softground.load_preset(name="Mud"), bpy.ops.softground.apply_look):
        change()
        bpy.context.view_layer.update()
        assert analysis.known(settings.snapshot(shot)).contacts is known.contacts
    assert analysis.expected_depth(shot) < in_snow


@pytest.mark.slow
def test_the_depth_to_expect_holds_on_through_live_mode(shot):
    bpy.ops.softground.predict_depth()
    known = analysis.known(settings.snapshot(shot))
    bpy.ops.softground.live()
    shot.frame_set(40)
    bpy.ops.softground.live(keep=True)
    bpy.context.view_layer.update()
    assert analysis.known(settings.snapshot(shot)).contacts is known.contacts


@pytest.mark.slow
def test_a_ground_that_is_moved_or_exchanged_makes_the_prediction_worthless(shot):
    bpy.ops.softground.create_ground()
    ground = shot.softground.ground
    analysis.read(shot)
    ground.location.z += 0.02
    bpy.context.view_layer.update()
    assert analysis.known(settings.snapshot(shot)) is None
    analysis.read(shot)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.softground.create_ground()
    assert shot.softground.ground != ground
    assert analysis.known(settings.snapshot(shot)) is None


@pytest.mark.slow
@pytest.mark.parametrize(("motion", "depth"), slow_but_one(itertools.product(["walk", "run", None], [2.0, 6.0])))
def test_a_matched_depth_is_met_by_the_bake(scene, motion, depth):
    if motion:
        import_motion(motion)
    else:
        walker(scene, frames=60)
    bpy.ops.softground.add_character()
    bpy.ops.softground.match_depth(depth=depth)
    bpy.ops.softground.bake()
    reached = scene.softground.ground.data["softground_summary"]["typical_depth_m"]
    assert reached * 100 == pytest.approx(depth, rel=0.02)


def test_a_depth_beyond_the_layer_is_refused(shot):
    with pytest.raises(RuntimeError, match="No stiffness gives"):
        bpy.ops.softground.match_depth(depth=80)


def tooltip(**choice):
    class Choice:
        name, filepath = choice.get("name", ""), choice.get("filepath", "")

    return preset_menu.SOFTGROUND_OT_load_preset.description(bpy.context, Choice)


def test_the_tooltip_of_a_preset_gives_source_and_depth(shot):
    assert "Alvarado" in tooltip(name="Snow")
    assert "cm" not in tooltip(name="Snow")
    bpy.ops.softground.predict_depth()
    bpy.ops.softground.load_preset(name="Mud")
    expected = analysis.expected_depth(shot)
    bpy.ops.softground.load_preset(name="Snow")
    assert tooltip(name="Mud").endswith(f"Walker: {expected * 100:.1f} cm")


def test_a_preset_of_one_s_own_comes_back_as_it_was_saved(shot, user_folder):
    shot.softground.material.stiffness_mpa = 0.123
    bpy.ops.softground.save_preset(name="Beach at Noon", source="measured with a stick")
    (path,) = user_folder.glob("*.json")
    assert presets.load(path).source == "measured with a stick"
    assert "Remove Ground Preset" in rows_of_the_menu()[0]
    bpy.ops.softground.load_preset(name="Snow")
    assert not bpy.ops.softground.remove_preset.poll()
    assert "Remove Ground Preset" not in rows_of_the_menu()[0]
    bpy.ops.softground.load_preset(filepath=str(path))
    assert shot.softground.material.youngs_modulus == pytest.approx(123e3)
    bpy.ops.softground.remove_preset()
    assert not list(user_folder.glob("*.json"))
    with pytest.raises(RuntimeError, match="comes with SoftGround"):
        bpy.ops.softground.save_preset(name="Snow")


@pytest.mark.slow
@pytest.mark.parametrize("again", ["Deep Snow!", "Deep Snow?", "DEEP_SNOW_", "deep snow"])
def test_a_preset_takes_the_place_of_another_only_when_it_is_told_to(shot, user_folder, again):
    bpy.ops.softground.save_preset(name="Deep Snow!", source="first")
    (path,) = user_folder.glob("*.json")
    before = path.read_bytes()
    with pytest.raises(RuntimeError, match="You have a preset like"):
        bpy.ops.softground.save_preset(name=again, source="second")
    assert path.read_bytes() == before
    assert shot.softground.material.preset == "Deep Snow!"
    assert bpy.ops.softground.save_preset(name=again, source="second", replace=True) == {"FINISHED"}
    (path,) = user_folder.glob("*.json")
    assert (presets.load(path).name, presets.load(path).source) == (again, "second")
    with pytest.raises(RuntimeError, match="You have a preset like"):  # it is asked each time
        bpy.ops.softground.save_preset(name=again)


def test_names_that_differ_have_files_of_their_own(shot, user_folder):
    names = ["Äcker", "Öcker", "雪", "沙", "Snow 2", "Snow (mine)"]
    for name in names:
        bpy.ops.softground.save_preset(name=name)
    assert sorted(presets.names((user_folder,))) == sorted(names)
    for name in names:
        shot.softground.material.preset = name
        assert preset_menu.title_of_ground(shot.softground) == name
        assert bpy.ops.softground.remove_preset() == {"FINISHED"}
    assert not list(user_folder.glob("*.json"))


def test_presets_whose_files_were_named_otherwise_are_the_users_too(shot, user_folder):
    user_folder.mkdir(parents=True, exist_ok=True)
    file = user_folder / "deep__snow_.json"
    file.write_text(presets.dump(ground_presets.as_preset(shot.softground, "Deep  Snow!")))
    with pytest.raises(RuntimeError, match=r"You have a preset like 'Deep Snow' \(deep__snow_\.json\)"):
        bpy.ops.softground.save_preset(name="Deep Snow")


@pytest.mark.parametrize("name", ["snow", "SNOW!", "fresh snow", "Fresh Snow (field)"])
def test_a_name_that_reads_like_a_built_in_preset_is_refused(shot, user_folder, name):
    with pytest.raises(RuntimeError, match="comes with SoftGround"):
        bpy.ops.softground.save_preset(name=name, replace=True)
    with pytest.raises(RuntimeError, match="letters or digits"):
        bpy.ops.softground.save_preset(name="?!")
    assert not list(user_folder.glob("*.json"))


def test_scenes_start_with_the_preset_of_the_preferences(scene, user_folder, monkeypatch):
    ours = bpy.context.preferences.addons.new()
    try:
        ours.module = settings.ADD_ON
        ours.preferences.default_preset = "Mud"
        assert ground_presets.default_preset().name == "Snow"  # in background, on every machine alike
        monkeypatch.setattr(ground_presets, "_preferred", lambda: ours.preferences.default_preset)
        assert preset_menu.title_of_ground(scene.softground) == "Mud"
        walker(scene, frames=24)
        bpy.ops.softground.add_character()
        assert (scene.softground.material.preset, scene.softground.material.surface) == ("Mud", "mud")
        ours.preferences.default_preset = "Gone"
        assert ground_presets.default_preset().name == "Snow"
    finally:
        bpy.context.preferences.addons.remove(ours)
    assert "Mud" in presets.names()


def test_broken_preset_files_are_left_out_with_a_message(user_folder):
    (user_folder / "broken.json").write_text("{")
    (user_folder / "odd.json").write_text(json.dumps({"schema_version": 1, "name": "Odd", "material": {"x": 1}}))
    (user_folder / "good.json").write_text(presets.dump(presets.find("snow")))
    valid, broken = preset_menu.listed(user_folder)
    assert [path.name for path, _ in valid] == ["good.json"]
    assert len(broken) == 2
    assert all("json" in message for message in broken)


def rows_of_the_menu():
    """The presets in the menu, each with what its button is given; and how long it took [s]."""
    menu = MagicMock()
    started = time.perf_counter()
    preset_menu.SOFTGROUND_MT_presets.draw(menu, bpy.context)
    took = time.perf_counter() - started
    return {call.kwargs["text"]: call.kwargs for call in menu.layout.operator.call_args_list}, took


def test_each_preset_has_a_picture_for_the_menu(addon, user_folder, monkeypatch):
    for name in ("My Bog", "My Heath"):
        (user_folder / f"{name}.json").write_text(presets.dump(replace(presets.find("snow"), name=name)))
    (user_folder / "My Heath.png").write_bytes(b"no picture")
    paths = sorted(presets.FOLDER.glob("*.json"))
    assert all(tuple(preset_icons.read(path).image_size) == (96, 96) for path in paths)
    assert sum(path.with_suffix(".png").stat().st_size for path in paths) < 200_000
    assert {row["icon"] for row in rows_of_the_menu()[0].values()} == {"BLANK1"}  # without a window there are no icons
    monkeypatch.setattr(preset_icons, "of", lambda path: 1 + paths.index(path) if path in paths else 0)
    rows, _ = rows_of_the_menu()
    assert sorted(row["icon_value"] for row in rows.values() if "icon" not in row) == [1 + n for n in range(len(paths))]
    assert rows["My Bog"]["icon"] == rows["My Heath"]["icon"] == "BLANK1"


def test_pictures_that_were_freed_are_read_again(addon):
    snow = presets.FOLDER / "snow.json"
    assert preset_icons.read(snow)
    preset_icons.unregister()
    assert state.pictures is None
    assert preset_icons.read(snow)


def test_the_preset_menu_opens_at_once(addon, user_folder):
    assert min(rows_of_the_menu()[1] for _ in range(5)) < 0.020


def test_characters_and_soles_can_be_corrected(shot):
    character = shot.softground.characters[0]
    bpy.ops.softground.add_sole()
    assert [sole.name for sole in character.soles] == ["foot.L", "foot.R", "sole 1"]
    bpy.ops.softground.remove_sole()
    character.joints[0].bone = "nonsense"
    bpy.ops.softground.detect_bones()
    assert "nonsense" not in [joint.bone for joint in character.joints]
    assert [sole.name for sole in character.soles] == ["foot.L", "foot.R"]
    bpy.ops.softground.remove_character()
    assert not shot.softground.characters
    assert not bpy.ops.softground.remove_character.poll()
    assert not bpy.ops.softground.bake.poll()


def labels(draw, *arguments):
    """The texts that a part of a panel shows."""
    layout = MagicMock()
    draw(layout, *arguments)
    return [call.kwargs["text"] for call in layout.mock_calls if call[0].endswith("label")]


def test_who_has_selected_nobody_is_offered_a_figure(scene):
    def offered():
        panel = MagicMock(layout=MagicMock())
        panel.fields.return_value = panel.layout
        panels.SOFTGROUND_PT_character.draw(panel, bpy.context)
        buttons = [call.args[0] for call in panel.layout.mock_calls if call[0].endswith("operator")]
        return "softground.add_sample_scene" in buttons

    assert offered()
    for add in (bpy.ops.object.camera_add, bpy.ops.mesh.primitive_cube_add):  # as in the file that Blender starts with
        add()
        assert offered()
    bpy.context.object.keyframe_insert("location")
    assert not offered()
    bpy.ops.object.armature_add()
    assert not offered()


def test_a_ground_that_changes_over_time_is_told_of_before_any_bake(shot):
    bpy.ops.softground.create_ground()
    options = shot.softground
    assert labels(panels._changing_ground, options) == []
    options.ground.modifiers.new("Swell", "WAVE")
    options.frame_start = 7
    assert labels(panels._changing_ground, options) == ["'Swell' changes its shape", "Taken as it is at frame 7"]


@pytest.mark.parametrize(
    ("typical", "deepest", "shown"), [(0.04, 0.062, "4.0 cm, up to 6.2 cm"), (0.0618, 0.062, "6.2 cm")]
)
def test_a_depth_that_all_steps_share_is_told_once(typical, deepest, shown):
    summary = {"steps": 6, "peak_force_n": 900.0, "typical_depth_m": typical, "max_depth_m": deepest}
    assert labels(bake_result._result, summary) == [f"6 steps, {shown}"]


@pytest.mark.slow
def test_what_a_bake_warns_of_stays_in_the_panel_until_the_bake_goes(shot):
    def buttons():
        layout = MagicMock()
        bake_result._warnings(layout, bake_result.warnings_of(shot.softground.ground))
        return [call.kwargs["text"] for call in layout.mock_calls]

    assert buttons() == []
    character = shot.softground.characters[0]
    character.mass = 5000.0
    shot.softground.material.youngs_modulus = 1e8
    bpy.ops.softground.bake()
    assert buttons() == ["1 Warning"]
    description = bake_result.SOFTGROUND_OT_show_warnings.description(bpy.context, None)
    assert "weighs 5000 kg" in description
    menu = MagicMock()
    bake_result._draw_warnings(menu, bpy.context)
    lines = [call.kwargs["text"] for call in menu.layout.column().label.mock_calls]
    assert " ".join(lines) == description
    assert max(map(len, lines)) <= 90
    character.mass = 77.5
    bpy.ops.softground.bake()
    assert buttons() == []
    character.mass = 5000.0
    bpy.ops.softground.bake()
    bpy.ops.softground.clear_bake()
    assert buttons() == []
    assert not bpy.ops.softground.show_warnings.poll()
