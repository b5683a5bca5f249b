"""What the add-on hooks into Blender costs nothing while it is idle, and leaves with it."""

import sys

import bpy
import pytest

import softground_addon
from softground_addon.blender import handlers
from softground_addon.blender.ground import ground_mesh
from softground_addon.blender.live import live
from softground_addon.blender.reading import analysis
from softground_addon.blender.sampling import sampling_scene
from softground_addon.blender.settings import snapshot
from tests.blender.shots import walker

IDLE_LINES = 8
"""Most lines of Python that a handler may run while nothing is armed."""


def lines_run(function, *arguments):
    """How many lines of Python a call runs, in whatever it calls too."""
    lines = []

    def trace(frame, event, _):
        if event == "line":
            lines.append(frame.f_lineno)
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        function(*arguments)
    finally:
        sys.settrace(before)
    return len(lines)


@pytest.mark.parametrize("handler", [handlers.follow_frame, handlers.notice_edits])
def test_an_idle_handler_costs_next_to_nothing(scene, handler):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    analysis.forget()
    assert 1 <= lines_run(handler, scene, depsgraph) <= IDLE_LINES


def test_each_handler_is_there_once_and_survives_a_new_file(scene):
    bpy.ops.wm.read_homefile(use_empty=True)
    for name, handler in handlers._HANDLERS:
        assert list(getattr(bpy.app.handlers, name)).count(handler) == 1


def test_disabling_the_add_on_in_live_mode_takes_the_prints_and_the_handlers_away(scene):
    walker(scene, frames=48)
    bpy.ops.softground.add_character()
    bpy.ops.softground.create_ground()
    ground = scene.softground.ground
    bpy.ops.softground.live()
    scene.frame_set(40)
    assert ground_mesh.is_baked(ground)
    softground_addon.unregister()
    try:
        assert not live.is_on()
        assert not ground_mesh.is_baked(ground)
        assert not hasattr(bpy.types.Scene, "softground")
        for name, handler in handlers._HANDLERS:
            assert handler not in getattr(bpy.app.handlers, name)
        scene.frame_set(41)
    finally:
        softground_addon.register()


def test_an_edited_action_makes_the_prediction_worthless(scene):
    armature = walker(scene, frames=48)
    bpy.ops.softground.add_character()
    analysis.read(scene)
    assert analysis.known(snapshot(scene))
    action = armature.animation_data.action
    action.update_tag()
    bpy.context.view_layer.update()
    assert analysis.known(snapshot(scene)) is None


def test_a_working_scene_that_an_autosave_brought_back_is_removed(scene, tmp_path):
    path, mine = str(tmp_path / "autosave.blend"), scene.name
    with sampling_scene.sampling_scene(scene, "", (), ()):
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert [s.name for s in bpy.data.scenes] == [mine]


def test_a_scene_of_the_users_stays_whatever_its_name(scene):
    mine = bpy.data.scenes.new(sampling_scene.TEMPORARY)
    handlers.after_load()
    handlers.after_undo()
    assert mine.name in bpy.data.scenes
