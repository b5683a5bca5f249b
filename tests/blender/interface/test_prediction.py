"""What panels and the overlay tell of a bake to come: nothing is computed while they are drawn."""

import bpy
import pytest

from softground_addon.blender import compat, ground_presets, handlers, jobs, settings
from softground_addon.blender.live import live
from softground_addon.blender.operators import prediction
from softground_addon.blender.reading import analysis
from softground_addon.blender.state import state
from softground_addon.core.composers.prediction import pressed_again
from softground_addon.core.errors import InputError
from softground_addon.core.ground import presets
from tests.blender.shots import walker
from tests.tiers import slow_but_one


@pytest.fixture
def shot(scene):
    walker(scene, frames=48)
    bpy.ops.softground.add_character()
    yield scene
    live.discard()
    prediction.unregister()


@pytest.fixture
def drawing(monkeypatch):
    """Whatever takes its time fails."""

    def fail(*_arguments):
        raise AssertionError("computed while drawing")

    def draw(scene):
        with monkeypatch.context() as patch:
            for heavy in ("estimate_shot", "read_shot", "pressed_contacts", "typical_depth"):
                patch.setattr(analysis, heavy, fail)
            return prediction.look(scene)[1]

    return draw


def softer(scene):
    scene.softground.material.youngs_modulus /= 2


def heavier(scene):
    scene.softground.characters[0].mass *= 2


def by_impulse(scene):
    scene.softground.characters[0].force_model = "IMPULSE"


def test_there_is_none_before_the_shot_was_read(shot, drawing):
    assert drawing(shot) is None


@pytest.mark.parametrize("change", [softer, heavier, by_impulse])
def test_a_change_is_marked_at_once_and_worked_out_soon(shot, drawing, change):
    bpy.ops.softground.predict_depth()
    before = drawing(shot)
    assert before.is_current
    change(shot)
    outdated = drawing(shot)
    assert not outdated.is_current
    assert outdated.depth == before.depth
    assert bpy.app.timers.is_registered(prediction._work_out)
    prediction._work_out()
    after = drawing(shot)
    assert after.is_current
    assert after.depth == analysis.expected_depth(shot)
    assert after.depth != pytest.approx(before.depth, rel=1e-3)


def test_all_contacts_are_pressed_once_the_sliders_rest(shot, drawing):
    """A sample answers while a slider moves; contacts that become typical in another material count after a moment."""
    known = analysis.read(shot)
    shot.softground.material.youngs_modulus /= 4
    drawing(shot)
    prediction._work_out()
    sampled = drawing(shot)
    assert sampled.is_current
    assert bpy.app.timers.is_registered(prediction._refine)
    while prediction._refine() is not None:
        pass
    refined = drawing(shot)
    material = settings.snapshot(shot).material
    assert refined.is_current
    assert refined.depth == pressed_again(known.contacts, material, shot.softground.pressure).typical
    assert refined.depth == pytest.approx(sampled.depth, rel=0.05)


@pytest.mark.slow
def test_a_change_ends_what_is_refined(shot, drawing):
    analysis.read(shot)
    softer(shot)
    drawing(shot)
    prediction._work_out()
    drawing(shot)
    state.refining.append(analysis.pressing_all(settings.snapshot(shot)))
    next(state.refining[0])
    softer(shot)
    drawing(shot)
    assert not state.refining
    assert not bpy.app.timers.is_registered(prediction._refine)


def test_what_cannot_be_worked_out_is_known_no_more(shot, drawing, monkeypatch):
    def refuse(*_arguments):
        raise InputError("nobody touches the ground")

    bpy.ops.softground.predict_depth()
    drawing(shot)
    heavier(shot)
    assert not drawing(shot).is_current
    with monkeypatch.context() as patch:
        patch.setattr(analysis, "estimate_shot", refuse)
        prediction._work_out()
    assert drawing(shot) is None  # and not worked out at every drawing


def test_a_heavier_character_presses_deeper_in_live_mode_from_then_on(shot, drawing):
    bpy.ops.softground.live()
    shot.frame_set(48)

    def deepest():
        return min(vertex.co.z for vertex in shot.softground.ground.data.vertices)

    before = deepest()
    heavier(shot)
    drawing(shot)
    assert prediction._work_out() is not None  # live mode's prints come first
    live.answer(seconds=60.0)
    assert prediction._work_out() is None
    assert deepest() < 1.5 * before


def sculpted_ground(scene):
    scene.softground.ground.data.vertices[0].co.z += 0.3


def sculpted_foot(scene):
    scene.objects["Walker Figure"].data.vertices[0].co.z += 0.3


def later_key(scene):
    point = compat.action_curves(scene.objects["Walker"].animation_data.action)[0].keyframe_points[5]
    point.co.y += 0.1


def another_range(scene):
    scene.softground.frame_end -= 5


def a_cube(_scene):
    bpy.ops.mesh.primitive_cube_add()


def another_frame(scene):
    scene.frame_set(20)


def the_view_of_the_ground(scene):
    scene.softground.ground.display_type = "WIRE"


@pytest.mark.parametrize("change", slow_but_one([sculpted_ground, sculpted_foot, later_key, another_range]))
def test_it_is_known_no_more_when_an_undo_has_brought_back_something_else(shot, change):
    bpy.ops.softground.create_ground()
    bpy.ops.softground.predict_depth()
    change(shot)
    handlers.after_undo()
    assert prediction.look(shot)[1] is None


@pytest.mark.parametrize("change", slow_but_one([another_frame, a_cube, the_view_of_the_ground, softer]))
def test_it_survives_an_undo_of_something_else(shot, change):
    bpy.ops.softground.create_ground()
    bpy.ops.softground.predict_depth()
    change(shot)
    handlers.after_undo()
    assert prediction.look(shot)[1] is not None


def test_it_survives_that_a_bake_and_its_ground_are_undone(shot):
    bpy.ops.softground.predict_depth()
    bpy.ops.softground.bake()
    assert prediction.look(shot)[1] is not None
    bpy.data.objects.remove(shot.softground.ground)
    handlers.after_undo()
    assert prediction.look(shot)[1] is not None


def test_an_edit_of_the_grounds_mesh_ends_it_and_a_bake_does_not(shot):
    bpy.ops.softground.create_ground()
    bpy.ops.softground.predict_depth()
    bpy.ops.softground.bake()
    bpy.context.view_layer.update()
    handlers.compare_prediction()
    assert prediction.look(shot)[1] is not None
    bpy.ops.softground.clear_bake()
    sculpted_ground(shot)
    bpy.context.view_layer.update()
    assert not bpy.app.timers.is_registered(handlers.compare_prediction)  # in background nobody looks at it
    handlers.compare_prediction()
    assert prediction.look(shot)[1] is None


@pytest.mark.parametrize("depth", [0.03, 0.08])
def test_a_depth_that_is_typed_or_dragged_is_met_after_a_moment(shot, drawing, depth):
    analysis.read(shot)
    drawing(shot)
    while prediction._work_out() is not None:
        pass
    assert drawing(shot).is_current
    prediction.aim_at(shot, depth)
    assert prediction.shown_cm(shot.softground) == pytest.approx(100 * depth)
    while prediction._work_out() is not None:
        pass
    assert analysis.expected_depth(shot) == pytest.approx(depth, rel=0.005)


def test_a_bake_ends_the_search_for_a_depth_that_was_typed(shot, drawing):
    ground_presets.apply_preset(
        shot.softground, presets.find("soft_mud")
    )  # where the depth is no share of the stiffness
    analysis.read(shot)
    drawing(shot)
    while prediction._work_out() is not None:
        pass
    drawing(shot)
    prediction.aim_at(shot, 0.04)
    jobs.run(prediction.settling(shot.session_uid))
    assert analysis.expected_depth(shot) == pytest.approx(0.04, rel=0.005)


def test_a_scene_may_be_deleted_while_its_depth_is_worked_out(shot, drawing):
    analysis.read(shot)
    drawing(shot)
    while prediction._work_out() is not None:
        pass
    drawing(shot)
    prediction.aim_at(shot, 0.04)
    settling = prediction.settling(shot.session_uid)
    next(settling)
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    compat.remove_scene(shot)
    jobs.run(settling)


def test_what_was_typed_is_forgotten_where_the_stiffness_is_set(shot, drawing):
    analysis.read(shot)
    drawing(shot)
    prediction._work_out()
    drawing(shot)
    prediction.aim_at(shot, 0.05)
    shot.softground.material.youngs_modulus = 1e6
    while prediction._work_out() is not None:
        pass
    assert shot.softground.material.youngs_modulus == 1e6
