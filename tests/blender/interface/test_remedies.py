"""What a warning tells its reader to press or to set is beside it, also when the file was opened since."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import pytest

from sample_scenes.body import Body
from sample_scenes.gait import Gait, walk
from softground_addon.blender import registration
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.operators import bake_result
from softground_addon.blender.panels import outdated
from softground_addon.blender.reading import analysis
from softground_addon.blender.settings import snapshot
from tests.blender.response.test_root_motion import FRAMES, on_the_spot
from tests.blender.shots import walker

NAMED = ["softground.walk_ahead", "mass", "cell_size"]
IN_PANEL = ["softground.walk_ahead", "cell_size"]
"""The mass of the character that is chosen is in the panel above."""


def drawn_on(layout):
    """What is drawn on a layout from now on: names of operators and properties, in order, each with its button."""
    drawn = {}
    layout.operator.side_effect = lambda name, **how: drawn.setdefault(name, SimpleNamespace(**how))
    layout.prop.side_effect = lambda _owner, name, **how: drawn.setdefault(name, SimpleNamespace(**how))
    return drawn


def in_panel(scene):
    layout, options = MagicMock(), scene.softground
    drawn = drawn_on(layout.column())
    summary = ground_mesh.summary_of(baked_ground.display_mesh_of(options.ground))
    bake_result.draw(layout, options, summary)
    return drawn


@pytest.fixture
def wrong(scene, tmp_path):
    """A bake that walks on the spot, weighs too much and has too large cells, opened again from its file."""
    on_the_spot(scene, walk(Body(), Gait(), FRAMES, 24), Gait().speed, 24, hips_held=False)
    scene.softground.cell_size = 0.04
    scene.softground.characters[0].mass = 5000.0
    bpy.ops.softground.bake()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wrong.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "wrong.blend"))
    return bpy.context.scene


@pytest.mark.slow
def test_the_remedies_that_a_warning_names_are_in_it_and_in_the_panel(wrong):
    assert analysis.known(snapshot(wrong)) is None
    popup = MagicMock()
    drawn = drawn_on(popup.layout.column())
    bake_result._draw_warnings(popup, bpy.context)
    assert sorted(drawn) == sorted(NAMED)
    assert popup.layout.column().operator_context == "INVOKE_DEFAULT"  # a popup has another one
    drawn = in_panel(wrong)
    assert list(drawn) == IN_PANEL
    assert (drawn[NAMED[0]].text, drawn[NAMED[0]].character) == ("Walk Ahead", "Walker")


@pytest.mark.slow
def test_remedies_stay_in_the_panel_while_their_finding_stands(wrong):
    state = bpy.context.window_manager.softground
    state.stale = "The settings have changed"
    assert list(in_panel(wrong)) == IN_PANEL
    bpy.ops.softground.walk_ahead(character="Walker")
    state.stale = "\n".join(bake_result.bake_report.stale_reasons(wrong))
    assert "softground.walk_ahead" not in in_panel(wrong)
    wrong.softground.characters[0].mass = 77.5
    wrong.softground.cell_size = 0.02
    bpy.ops.softground.bake()
    state.stale = ""
    assert in_panel(wrong) == {}


@pytest.mark.slow
def test_undo_brings_remedies_back_with_their_finding(wrong):
    bpy.ops.ed.undo_push(message="Opened")
    bpy.ops.softground.walk_ahead(character="Walker")
    bpy.ops.ed.undo_push(message="Walk Ahead")
    outdated.compare_bake()
    assert "softground.walk_ahead" not in in_panel(wrong)
    bpy.ops.softground.clear_bake()
    bpy.ops.ed.undo_push(message="Clear Bake")
    for named in (IN_PANEL[1:], IN_PANEL):  # first, the character has changed since the bake
        bpy.ops.ed.undo()
        outdated.compare_bake()
        assert analysis.known(snapshot(bpy.context.scene)) is None
        assert list(in_panel(bpy.context.scene)) == named


def test_a_mass_that_is_too_large_is_in_the_panel_once_whichever_character_is_chosen(wrong):
    layout, options = MagicMock(), wrong.softground
    options.characters.add().name = "Other"
    for active in (0, 1):
        layout.reset_mock()
        options.active_character = active
        drawn_on(layout.column())
        texts = ["'Walker' is too heavy. Set Mass.", "Feet were not lowered. Or switch Sink Feet off."]
        bake_result.draw_remedies(layout.column(), options, texts, in_panel=True)
        assert "sink_feet" not in [call.args[1] for call in layout.column().prop.mock_calls], "it is beside the button"
        owners = [call.args[0] for call in layout.column().prop.mock_calls if call.args[1] == "mass"]
        assert owners == [options.characters[0]] * active


@pytest.mark.slow
def test_a_remedy_is_for_the_character_that_its_warning_names(scene):
    first = on_the_spot(scene, walk(Body(), Gait(), FRAMES, 24), Gait().speed, 24, hips_held=False)
    second = walker(scene, frames=FRAMES)
    second.location.y = 3.0
    bpy.ops.softground.add_character()
    assert scene.softground.active_character == 1
    with pytest.raises(RuntimeError, match="There is no character 'Nobody': select one in the list"):
        bpy.ops.softground.walk_ahead(character="Nobody")
    bpy.ops.softground.walk_ahead(character=first.name)
    assert (first.parent.name, second.parent) == (f"{first.name} Travel", None)


def test_remedies_are_operators_and_settings_that_there_are(addon):
    names = {getattr(cls, "bl_idname", "") for cls in registration.CLASSES}
    assert names.issuperset([*bake_result._OF_CHARACTER.values(), *bake_result._OPERATORS.values()])
    fields = bpy.context.scene.softground.bl_rna.properties.keys()
    assert set(bake_result._FIELDS.values()) <= set(fields)
