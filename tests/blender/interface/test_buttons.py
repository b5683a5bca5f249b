"""Each button that starts a job, as it is pressed in a window: also where the job is done at once, or refused."""

import itertools
from types import SimpleNamespace

import bpy
import pytest

from sample_scenes.body import Body
from sample_scenes.gait import Gait, walk
from softground_addon.blender import session
from softground_addon.blender.ground import baked_ground, baked_steps, ground_mesh
from softground_addon.blender.live import live
from softground_addon.blender.operators import modal_job
from softground_addon.blender.operators.modal_job import ModalJob
from softground_addon.blender.reading import analysis
from softground_addon.blender.state import state
from softground_addon.blender.viewport import step_editing
from softground_addon.blender.weather import ground_weather as weather
from softground_addon.core.record.edits import StepEdit
from tests.blender import fingerprints
from tests.blender.response.test_root_motion import FRAMES, on_the_spot, speed_of
from tests.blender.shots import walker

TIMER = SimpleNamespace(type="TIMER", value="NOTHING")


def kinds(of=ModalJob):
    """Names of all operators with a job."""
    names = {
        subclasse.bl_idname.partition(".")[2] for subclasse in of.__subclasses__() if "bl_idname" in vars(subclasse)
    }
    return names.union(*map(kinds, of.__subclasses__()))


@pytest.fixture
def press(scene, monkeypatch):
    """A way to press a button, and to let its job run to its end; what came of it and how often it gave way.

    It does so after each slice of its work, however fast the machine is.
    """
    monkeypatch.setattr(modal_job, "TICK", 0.0)

    # There are no events in background, where Blender never calls `invoke`: this is what that does in a window.
    def pressed(name, **values):
        with monkeypatch.context() as patch:
            patch.setattr(ModalJob, "execute", ModalJob._start)
            result, ticks = getattr(bpy.ops.softground, name)(**values), 0
        while state.jobs:
            assert session.current().is_baking
            result = state.jobs[0].modal(bpy.context, TIMER)
            ticks += 1
        assert not session.current().is_baking
        return result, ticks

    yield pressed
    modal_job.stop()


READING = ("detect_bones", "create_ground", "use_as_ground", "predict_depth", "overlay", "read_again")
BAKING = ("bake", "bake_again", "sink_feet", "clean_feet", "make_keys")
EDITING = ("mute_step", "duplicate_step", "add_step", "reset_step", "reset_steps")
ON_THE_SPOT = ("walk_ahead", "root_motion")
PLANTS = ("add_sample_meadow", "give_way")


def test_all_buttons_with_a_job_are_pressed_here(addon):
    named = {"add_character", "add_weather", "change_step", "drop_steps", "live"}
    assert kinds() == {*named, *READING, *BAKING, *EDITING, *ON_THE_SPOT, *PLANTS}


def test_each_button_works_in_a_window_and_once_more_where_the_shot_is_known(scene, press):
    walker(scene, frames=24)
    scene.softground.cell_size = 0.03
    assert press("add_character")[0] == {"FINISHED"}
    for name in READING:
        options = {"use_selected": False} if name == "create_ground" else {}
        assert [press(name, **options)[0] for _ in range(2)] == [{"FINISHED"}] * 2, name
    for name in BAKING:
        result, ticks = press(name)
        assert (result, ticks > 3) == ({"FINISHED"}, True), name


@pytest.mark.slow
def test_live_mode_starts_ends_and_is_kept_in_a_window(scene, press):
    walker(scene, frames=24)
    scene.softground.cell_size = 0.03
    press("add_character")
    ground = press("create_ground", use_selected=False) and scene.softground.ground
    for keep in (False, True):
        result, ticks = press("live")
        assert (result, ticks > 3, live.is_on()) == ({"FINISHED"}, True, True)
        scene.frame_set(24)
        assert press("live", keep=keep)[0] == {"FINISHED"}
        assert (live.is_on(), ground_mesh.is_baked(ground)) == (False, keep)


@pytest.fixture
def steps(scene):
    """A bake, and the names of its steps."""
    walker(scene, frames=40)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.03
    bpy.ops.softground.bake()
    return [step.name for step in baked_steps.of(scene.softground.ground)]


@pytest.mark.slow
def test_each_button_that_changes_steps_works_in_a_window(scene, press, steps):
    session.choose_steps(steps[0])
    for name in EDITING:
        result, ticks = press(name)
        assert (result, ticks > 3) == ({"FINISHED"}, True), name
    assert not baked_ground.edits_of(scene.softground.ground)


@pytest.mark.slow
def test_what_a_dialog_or_the_mouse_changed_of_a_step_is_pressed_in_a_window(scene, monkeypatch, press, steps):
    monkeypatch.setattr(step_editing.SOFTGROUND_OT_change_step, "_in_dialog", True)
    state.edits = moved = {steps[1]: StepEdit(move_m=(0.1, 0.0))}
    for name, values in (("change_step", {"step": steps[0], "strength": 0.5}), ("drop_steps", {})):
        result, ticks = press(name, **values)
        assert (result, ticks > 3) == ({"FINISHED"}, True), name
    assert baked_ground.edits_of(scene.softground.ground) == {steps[0]: StepEdit(strength=0.5), **moved}
    assert not state.edits


def test_edits_that_change_nothing_touch_nothing(scene, press, steps):
    before = fingerprints.of_file()
    mesh = scene.softground.ground.data
    mesh["noticed"] = written = mesh[ground_mesh.RECORD][:]
    assert press("reset_steps") == press("reset_step", step=steps[0]) == ({"FINISHED"}, 0)
    assert scene.softground.ground.data == mesh
    assert mesh["noticed"][:] == written
    del mesh["noticed"]
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_an_edit_that_is_left_in_any_state_has_changed_nothing(scene, monkeypatch, steps):
    before, undone = fingerprints.of_file(), 0
    monkeypatch.setattr(ModalJob, "execute", ModalJob._start)
    monkeypatch.setattr(modal_job, "TICK", 0.0)
    for ticks in itertools.count(step=9):
        bpy.ops.softground.mute_step(step=steps[1])
        for _ in range(ticks):
            if state.jobs:
                state.jobs[0].modal(bpy.context, TIMER)
        if not state.jobs:
            break
        state.jobs[0].modal(bpy.context, SimpleNamespace(type="ESC", value="PRESS"))
        assert fingerprints.of_file() == before
        undone += 1
    assert undone > 3
    assert fingerprints.of_file() != before


@pytest.mark.slow
def test_weather_comes_in_short_steps_and_not_at_all_where_they_are_left(scene, press, steps):
    before = fingerprints.of_file()
    for ticks in itertools.count(1, 3):
        job = weather.adding(scene.softground.ground)
        if len(list(itertools.islice(job, ticks))) < ticks:
            break
        job.close()
        assert fingerprints.of_file() == before
    assert ticks > 3
    bpy.ops.softground.remove_weather()
    for preset in ("SNOWFALL", "THAW"):
        result, ticks = press("add_weather", preset=preset)
        assert (result, ticks > 0) == ({"FINISHED"}, True)
    assert weather.values_of(scene.softground.ground)["Temperature"] == weather.PRESETS["THAW"][1]["Temperature"]


@pytest.mark.slow
def test_plants_give_way_in_short_steps_and_not_at_all_where_they_are_left(scene, monkeypatch, press, steps):
    before = fingerprints.of_file()
    for ticks in (1, 4):
        with monkeypatch.context() as patch:
            patch.setattr(ModalJob, "execute", ModalJob._start)
            assert bpy.ops.softground.add_sample_meadow() == {"RUNNING_MODAL"}
        for _ in range(ticks):
            state.jobs[0].modal(bpy.context, TIMER)
        state.jobs[0].modal(bpy.context, SimpleNamespace(type="ESC", value="PRESS"))
        assert fingerprints.of_file() == before
    result, ticks = press("add_sample_meadow")
    assert (result, ticks > 3) == ({"FINISHED"}, True)
    (grass,) = (obj for obj in scene.objects if obj.type == "CURVES")
    grass.modifiers.clear()
    bpy.context.view_layer.objects.active = grass
    grass.select_set(True)
    assert press("give_way", kind="REEDS")[0] == {"FINISHED"}
    assert len(grass.modifiers) == 1


@pytest.mark.parametrize("button", ON_THE_SPOT)
def test_a_walk_on_the_spot_gets_its_travel_where_the_shot_is_known(scene, press, button):
    armature = on_the_spot(scene, walk(Body(), Gait(), FRAMES, 24), Gait().speed, 24, hips_held=False)
    analysis.read(scene)
    before = speed_of(scene, armature)
    assert press(button)[0] == {"FINISHED"}
    assert speed_of(scene, armature) == pytest.approx(before + Gait().speed, rel=0.05)


def test_a_refused_job_says_why_and_leaves_nothing_running(scene, press):
    walker(scene, frames=40)
    press("add_character")
    analysis.read(scene)
    with pytest.raises(RuntimeError, match="'Walker' does not walk on the spot"):
        press("walk_ahead")
    assert not state.jobs
