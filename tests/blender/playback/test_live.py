"""Live mode: what the timeline shows, whatever way the playhead takes, and nothing left behind."""

from itertools import islice
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest

from softground_addon.blender import handlers, reuse, session, settings
from softground_addon.blender.baking import bake_report
from softground_addon.blender.debris import debris_object
from softground_addon.blender.ground import baked_ground, created_ground, ground_mesh
from softground_addon.blender.live import live, live_start
from softground_addon.blender.playback import own_data
from softground_addon.blender.reading import analysis
from softground_addon.blender.state import state
from tests.blender import fingerprints
from tests.blender.shots import walker
from tests.tiers import slow_but_one

LEVEL = 1e-9
"""How far the undisturbed ground may be from the plane that it was fitted to [m]."""


def on_its_ground(scene):
    walker(scene, frames=48)
    bpy.ops.softground.add_character()
    bpy.ops.softground.create_ground()


@pytest.fixture
def shot(opened_as):
    return opened_as(on_its_ground)


@pytest.fixture
def live_shot(shot):
    shot.frame_set(1)
    assert bpy.ops.softground.live() == {"FINISHED"}
    yield shot
    live.discard()


def heights(scene):
    """World heights of the evaluated ground."""
    ground = scene.softground.ground
    mesh = ground.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", positions)
    return positions.reshape(-1, 3)[:, 2].copy()


def ages(scene):
    mesh = baked_ground.display_mesh_of(scene.softground.ground).data
    age = np.empty(len(mesh.vertices), dtype=np.float32)
    mesh.attributes[ground_mesh.AGE].data.foreach_get("value", age)
    return age


@pytest.mark.slow
def test_the_age_of_prints_is_that_of_a_bake_at_every_frame(live_shot):
    shown = {}
    for frame in (30, 48, 21, 1):
        live_shot.frame_set(frame)
        shown[frame] = ages(live_shot)
    bpy.ops.softground.live()
    assert (shown[1] == -1).all()
    for frame in (48, 30, 21):
        live_shot.softground.frame_end = frame
        bpy.ops.softground.bake()
        assert shown[frame] == pytest.approx(ages(live_shot), abs=1e-4)
        bpy.ops.softground.clear_bake()
        assert (shown[frame] >= 0).sum() > 300


@pytest.mark.parametrize("preset", slow_but_one(["Snow", "Mud", "Fresh Snow"]))
def test_scrubbing_back_and_forth_shows_every_frame_as_it_was(live_shot, preset):
    bpy.ops.softground.load_preset(name=preset)
    shown = {}
    for frame in range(1, 49):
        live_shot.frame_set(frame)
        shown[frame] = heights(live_shot)
    assert np.abs(shown[1]).max() < LEVEL
    assert shown[48].min() < -0.01
    for frame in (30, 12, 47, 1, 33, 13, 48, 2, 25, 41):
        live_shot.frame_set(frame)
        assert (heights(live_shot) == shown[frame]).all(), frame


def test_jumping_ahead_presses_the_frames_between(live_shot):
    live_shot.frame_set(48)
    jumped = heights(live_shot)
    bpy.ops.softground.live()
    live_shot.frame_set(1)
    bpy.ops.softground.live()
    for frame in range(1, 49):
        live_shot.frame_set(frame)
    assert (heights(live_shot) == jumped).all()


def test_the_last_frame_is_that_of_a_bake(live_shot):
    live_shot.frame_set(48)
    shown = heights(live_shot)
    bpy.ops.softground.live()
    bpy.ops.softground.bake()
    baked = ground_mesh.displayed_positions(live_shot.softground.ground)
    assert baked[:, 2] == pytest.approx(shown, abs=1e-6)


def test_discarding_leaves_the_file_as_it_was(shot):
    shot.frame_set(1)
    before = fingerprints.of_file()
    bpy.ops.softground.live()
    shot.frame_set(40)
    assert fingerprints.of_file()["meshes"] != before["meshes"]
    bpy.ops.softground.live()
    shot.frame_set(1)
    assert fingerprints.of_file() == before


def test_keeping_leaves_a_bake_of_the_frames_so_far(live_shot):
    live_shot.frame_set(30)
    shown = heights(live_shot)
    bpy.ops.softground.live(keep=True)
    assert not live.is_on()
    assert ground_mesh.is_baked(live_shot.softground.ground)
    bpy.context.view_layer.update()
    assert heights(live_shot) == pytest.approx(shown, abs=3e-4)
    bpy.ops.softground.clear_bake()
    assert np.abs(heights(live_shot)).max() < LEVEL


def test_kept_prints_say_which_frames_they_are_of(live_shot):
    live_shot.frame_set(30)
    bpy.ops.softground.live(keep=True)
    _, about = baked_ground.load(live_shot.softground.ground)
    assert about["inputs"]["frames"] == [1, 30]
    assert bake_report.stale_reasons(live_shot) == ("The settings have changed",)
    live_shot.softground.frame_end = 30
    assert bake_report.stale_reasons(live_shot) == ()


@pytest.mark.parametrize(("softer", "sinks", "outdated"), [(30, True, True), (30, False, False), (1, True, False)])
def test_kept_prints_are_outdated_where_a_bake_would_carve_too(live_shot, softer, sinks, outdated):
    options = live_shot.softground
    options.sink_feet = sinks
    options.material.layer_depth, options.frame_end = 0.6, 30
    options.material.youngs_modulus /= softer
    live_shot.frame_set(30)
    bpy.ops.softground.live(keep=True)
    assert bool(bake_report.stale_reasons(live_shot)) == outdated


@pytest.mark.slow
def test_kept_prints_are_pressed_with_the_settings_that_they_are_stamped_with(live_shot):
    """Also those that were changed a moment before, and had not shown yet."""
    material, options = live_shot.softground.material, live_shot.softground
    live_shot.frame_set(30)
    stiff = material.youngs_modulus
    material.youngs_modulus /= 4
    options.pressure = "CENTRE_OF_PRESSURE"
    options.frame_end = 30
    bpy.ops.softground.live(keep=True)
    footprints, about = baked_ground.load(options.ground)
    assert about["inputs"]["material"]["youngs_modulus"] == stiff / 4
    assert bake_report.stale_reasons(live_shot) == ()
    bpy.ops.softground.bake()
    baked, _ = baked_ground.load(options.ground)
    assert [f.max_depth_m for f in footprints] == [f.max_depth_m for f in baked]


def test_kept_prints_show_the_tread_as_baked_ones_do(live_shot):
    live_shot.frame_set(live_shot.softground.frame_end)
    live_shot.softground.tread = 0.003
    bpy.ops.softground.live(keep=True)
    mesh = live_shot.softground.ground.data
    marks = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes[own_data.SOLE].data.foreach_get("vector", marks)
    assert marks.reshape(-1, 3)[:, 2].max() == pytest.approx(0.003, rel=1e-6)


@pytest.mark.slow
def test_weather_acts_on_kept_prints_as_on_baked_ones_and_waits_for_them(live_shot):
    live_shot.frame_set(live_shot.softground.frame_end)
    with pytest.raises(RuntimeError, match="press Keep, then add weather"):
        bpy.ops.softground.add_weather(preset="SNOWFALL")
    live_shot.softground.steps_feel_weather = True
    bpy.ops.softground.live(keep=True)
    assert baked_ground.load(live_shot.softground.ground)[1]["inputs"]["weather"] is None
    live_shot.softground.steps_feel_weather = False
    shown = {}
    for again in (False, True):
        if again:
            bpy.ops.softground.clear_bake()
            bpy.ops.softground.bake()
        bpy.ops.softground.add_weather(preset="SNOWFALL")
        for frame in (20, 48, 200):
            live_shot.frame_set(frame)
            shown[again, frame] = heights(live_shot)
    assert np.ptp(shown[True, 48]) > 0.03
    for frame in (20, 48, 200):
        assert np.array_equal(shown[False, frame], shown[True, frame])


@pytest.mark.slow
def test_kept_prints_are_a_bake_like_any_other(live_shot, tmp_path):
    live_shot.frame_set(live_shot.softground.frame_end)
    bpy.ops.softground.live(keep=True)
    ground = live_shot.softground.ground
    summary = ground_mesh.summary_of(ground)
    assert bake_report.stale_reasons(live_shot) == ()
    assert bpy.ops.softground.export(filepath=str(tmp_path / "ground.pc2"), format="PC2") == {"FINISHED"}
    bpy.ops.softground.bake()
    baked = ground_mesh.summary_of(ground)
    assert summary == {key: pytest.approx(baked[key]) for key in summary}


@pytest.mark.slow
def test_kept_prints_throw_what_those_of_a_bake_throw(live_shot):
    live_shot.frame_set(live_shot.softground.frame_end)
    ground = live_shot.softground.ground
    live_shot.softground.debris = True  # at the last moment, as live mode shows none
    assert debris_object.of(ground) is None
    bpy.ops.softground.live(keep=True)
    footprints, pieces = baked_ground.load(ground)[0], fingerprints.of_mesh(debris_object.of(ground).data)
    assert bake_report.stale_reasons(live_shot) == ()
    bpy.ops.softground.bake()
    baked = baked_ground.load(ground)[0]
    assert [each.rim_m3 for each in footprints] == [each.rim_m3 for each in baked]
    assert fingerprints.of_mesh(debris_object.of(ground).data) == pieces
    live_shot.softground.debris = False
    bpy.ops.softground.bake()
    full = baked_ground.load(ground)[0]
    assert sum(each.rim_m3 for each in full) > 1.02 * sum(each.rim_m3 for each in baked)


def lowest(scene):
    return display_heights(scene).min()


def answered(scene, *, part=0.0):
    """Let the timer's function do its work; the deepest point after each part of it, as somebody would see it."""
    seen = [lowest(scene)]
    while live.is_answering():
        live.answer(part)
        assert live.is_on()
        seen.append(lowest(scene))
    return seen


def baked_heights(scene):
    """What a bake shows at the last frame, with the settings of the moment."""
    bpy.ops.softground.live()
    bpy.ops.softground.bake()
    return display_heights(scene)


CHANGES = {
    "softer": lambda options: setattr(options.material, "youngs_modulus", options.material.youngs_modulus / 4),
    "heel to toe": lambda options: setattr(options, "pressure", "CENTRE_OF_PRESSURE"),
    "heavier": lambda options: setattr(options.characters[0], "mass", 2 * options.characters[0].mass),
    "another preset": lambda _: bpy.ops.softground.load_preset(name="Paper Mud"),  # without debris, whose rims lack it
    "smoother": lambda options: setattr(options.material, "blur_sigma", 0.02),
    "coarser": lambda options: setattr(options, "cell_size", 0.015),
}


@pytest.mark.slow
@pytest.mark.parametrize("change", slow_but_one(CHANGES))
def test_a_slider_presses_the_prints_that_are_shown_again_as_a_bake_would(live_shot, change):
    live_shot.frame_set(48)
    before = display_heights(live_shot)
    CHANGES[change](live_shot.softground)
    assert live.is_answering()
    answered(live_shot)
    shown = display_heights(live_shot)
    assert np.abs(shown - before).max() > 1e-3
    live_shot.frame_set(20)
    live_shot.frame_set(48)
    assert (display_heights(live_shot) == shown).all()
    assert baked_heights(live_shot) == pytest.approx(shown, abs=1e-6)


def test_a_redraw_looks_at_the_settings_for_a_refusal_only_after_one(live_shot, monkeypatch):
    monkeypatch.setattr(settings, "snapshot", MagicMock(side_effect=AssertionError))
    assert live.refusal() == ""


def test_live_mode_that_can_read_its_shot_no_longer_says_why_it_ends_until_the_next_bake(live_shot):
    live_shot.frame_set(48)
    shown, rig = display_heights(live_shot), live_shot.softground.characters[0].armature
    rig.scale = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    analysis.forget()
    live.answer(np.inf)
    assert not live.is_on()
    assert live.refusal().startswith("Live mode has ended: ")
    assert rig.name in live.refusal()
    assert (display_heights(live_shot) == shown).all()
    session.show_bake(0.0, "")
    session.show_no_bake()
    assert live.refusal() == ""


def test_another_file_does_not_say_why_live_mode_has_ended_in_the_last(scene):
    live.forget("the rig is too small")
    bpy.ops.wm.read_homefile(use_empty=True)
    assert live.refusal() == ""


@pytest.mark.slow
def test_cells_that_nobody_waits_for_are_refused_in_words_and_the_prints_stay(live_shot):
    live_shot.frame_set(48)
    shown, size = display_heights(live_shot), live_shot.softground.cell_size
    live_shot.softground.cell_size = 1e-4
    answered(live_shot)
    assert live.is_on()
    assert "set a cell size of at least" in live.refusal()
    assert not live.is_answering()
    assert (display_heights(live_shot) == shown).all()
    live_shot.softground.cell_size = size
    assert live.refusal() == ""
    answered(live_shot)
    assert live.is_on()
    assert (display_heights(live_shot) == shown).all()


@pytest.mark.slow
def test_newest_steps_follow_a_slider_first_and_while_it_is_dragged(scene):
    """Each move of a drag shows at the feet; what lies further back follows when it rests."""
    walker(scene, frames=150)
    bpy.ops.softground.add_character()
    bpy.ops.softground.create_ground()
    scene.frame_set(1)
    bpy.ops.softground.live()
    scene.frame_set(150)
    before = display_heights(scene)
    newest, oldest = (ages(scene) >= 0) & (ages(scene) < 0.3), ages(scene) > 2.5
    depths = []
    for _ in range(3):
        scene.softground.material.youngs_modulus /= 1.3
        shown = display_heights(scene)
        while np.array_equal(shown, display_heights(scene)):
            live.answer(0.0)
        depths.append(display_heights(scene))
    assert before[newest].min() > depths[0][newest].min() > depths[1][newest].min() > depths[2][newest].min()
    assert {depth[oldest].min() for depth in depths} == {before[oldest].min()}
    answered(scene)
    shown = display_heights(scene)
    assert shown[oldest].min() < 1.5 * before[oldest].min()
    assert baked_heights(scene) == pytest.approx(shown, abs=1e-6)


def test_a_new_setting_presses_nothing_while_a_render_runs(live_shot):
    live_shot.frame_set(30)
    before = display_heights(live_shot)
    handlers.begin_render()
    live_shot.softground.material.youngs_modulus /= 4
    live.answer()
    assert (display_heights(live_shot) == before).all()
    handlers.end_render()
    answered(live_shot)
    assert lowest(live_shot) < 1.5 * before.min()


@pytest.mark.parametrize("gone", ["ground", "armature"])
def test_deleting_the_ground_or_the_rig_midway_ends_in_peace(live_shot, gone):
    live_shot.frame_set(20)
    options = live_shot.softground
    bpy.data.objects.remove(options.ground if gone == "ground" else options.characters[0].armature)
    live_shot.frame_set(21)
    live_shot.frame_set(10)
    if gone == "ground":
        assert not live.is_on()


def test_renaming_and_duplicating_the_ground_change_nothing(live_shot):
    live_shot.frame_set(20)
    ground = live_shot.softground.ground
    copy = ground.copy()
    copy.data = ground.data.copy()
    live_shot.collection.objects.link(copy)
    ground.name, copy.name = "Renamed", ground.name
    before = fingerprints.of_mesh(copy.data)
    live_shot.frame_set(48)
    assert heights(live_shot).min() < -0.01
    assert fingerprints.of_mesh(copy.data) == before


def test_another_scene_s_frames_do_not_press(live_shot):
    live_shot.frame_set(5)
    before = heights(live_shot)
    other = bpy.data.scenes.new("Other")
    other.frame_set(40)
    assert (heights(live_shot) == before).all()


def test_nothing_is_written_while_a_render_runs(live_shot):
    live_shot.frame_set(5)
    before = fingerprints.of_mesh(live_shot.softground.ground.data)
    handlers.begin_render()
    live_shot.frame_set(40)
    assert fingerprints.of_mesh(live_shot.softground.ground.data) == before
    handlers.end_render()
    live_shot.frame_set(41)
    assert fingerprints.of_mesh(live_shot.softground.ground.data) != before


def status():
    header = MagicMock()
    for draw in getattr(bpy.types.STATUSBAR_HT_header.draw, "_draw_funcs", ()):
        if "softground_addon" in draw.__module__:
            draw(header, bpy.context)
    return [call.kwargs["text"] for call in header.layout.label.mock_calls]


@pytest.mark.parametrize("end", slow_but_one(["discard", "keep", "delete the ground", "new file"]))
def test_the_status_bar_says_that_live_mode_is_on_until_it_ends(shot, end):
    assert status() == []
    bpy.ops.softground.live()
    (line,) = status()
    assert line.startswith("Live Footprints")
    if end == "delete the ground":
        bpy.data.objects.remove(shot.softground.ground)
        shot.frame_set(20)
    elif end == "new file":
        bpy.ops.wm.read_homefile(use_empty=True)
    else:
        bpy.ops.softground.live(keep=end == "keep")
    assert status() == []


def test_a_new_file_ends_live_mode(live_shot):
    live_shot.frame_set(20)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not live.is_on()
    assert not bpy.context.window_manager.softground.is_live


def test_the_add_on_is_disabled_with_the_ground_in_edit_mode_and_the_prints_can_be_cleared_later(live_shot):
    live_shot.frame_set(30)
    ground = live_shot.softground.ground
    bpy.context.view_layer.objects.active = ground
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Edit Mode"):
        bpy.ops.softground.live()
    assert live.is_on()
    handlers.unregister()
    handlers.register()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not live.is_on()
    bpy.ops.softground.clear_bake()
    assert np.abs(heights(live_shot)).max() < LEVEL


def test_a_file_saved_in_live_mode_can_be_cleared_after_it_is_opened_again(live_shot, tmp_path):
    live_shot.frame_set(48)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "live.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "live.blend"))
    assert not live.is_on()
    scene = bpy.context.scene
    assert heights(scene).min() < -0.01
    bpy.ops.softground.clear_bake()
    bpy.context.view_layer.update()
    assert np.abs(heights(scene)).max() < LEVEL


@pytest.fixture
def coarse_shot(scene):
    """A walk over a plane of four corners."""
    walker(scene, frames=48)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    scene.softground.ground = bpy.context.object
    scene.frame_set(1)
    bpy.context.view_layer.update()
    yield scene
    live.discard()


def display_heights(scene):
    display_mesh = baked_ground.display_mesh_of(scene.softground.ground)
    return ground_mesh.displayed_positions(display_mesh)[:, 2] - ground_mesh.rest_positions(display_mesh.data)[:, 2]


@pytest.mark.slow
def test_a_plane_of_four_corners_shows_the_prints_that_a_bake_gives_it(coarse_shot):
    bpy.ops.softground.live()
    coarse_shot.frame_set(48)
    live_depth = display_heights(coarse_shot).min()
    assert coarse_shot.softground.ground.hide_get() or coarse_shot.softground.ground.hide_viewport
    coarse_shot.frame_set(1)
    assert np.abs(display_heights(coarse_shot)).max() == 0.0
    live.discard()
    bpy.ops.softground.bake()
    assert live_depth == pytest.approx(display_heights(coarse_shot).min(), rel=0.05)


def test_discarding_live_prints_takes_the_fine_copy_away(coarse_shot):
    before = fingerprints.of_file()
    bpy.ops.softground.live()
    coarse_shot.frame_set(40)
    assert fingerprints.of_file() != before
    coarse_shot.frame_set(1)
    bpy.ops.softground.live()
    bpy.context.view_layer.update()
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_kept_live_prints_stay_on_the_fine_copy_until_they_are_cleared(coarse_shot):
    before = fingerprints.of_file()
    bpy.ops.softground.live()
    coarse_shot.frame_set(30)
    shown = display_heights(coarse_shot)
    bpy.ops.softground.live(keep=True)
    assert display_heights(coarse_shot) == pytest.approx(shown, abs=3e-4)
    assert baked_ground.load(coarse_shot.softground.ground)[0]
    bpy.ops.softground.clear_bake()
    coarse_shot.frame_set(1)
    assert fingerprints.of_file() == before


def test_live_mode_on_a_coarse_ground_that_is_to_stay_coarse_says_what_to_do(coarse_shot):
    coarse_shot.softground.detail = "NEVER"
    before = fingerprints.of_file()
    with pytest.raises(RuntimeError, match=r"is too coarse: .* Set Detail to Automatic"):
        bpy.ops.softground.live()
    assert not live.is_on()
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_a_coarse_ground_deleted_in_live_mode_leaves_no_prints_behind(coarse_shot):
    bpy.ops.softground.live()
    coarse_shot.frame_set(40)
    bpy.data.objects.remove(coarse_shot.softground.ground)
    coarse_shot.frame_set(41)
    live.discard()
    assert not live.is_on()


def test_live_prints_are_kept_or_discarded_but_not_cleared(live_shot):
    live_shot.frame_set(30)
    assert not bpy.ops.softground.clear_bake.poll()
    bpy.ops.softground.live(keep=True)
    assert bpy.ops.softground.clear_bake.poll()


def test_live_mode_waits_until_a_bake_is_cleared(shot):
    bpy.ops.softground.bake()
    assert not bpy.ops.softground.live.poll()
    bpy.ops.softground.clear_bake()
    assert bpy.ops.softground.live.poll()


def steps_taken(job, most=10**6):
    """Steps of a job that is left after some of them, as Esc does, unless it ends before."""
    taken = sum(1 for _ in islice(job, most))
    job.close()
    return taken


@pytest.mark.slow
@pytest.mark.parametrize("ground", slow_but_one(["coarse", "none", "fine"]))
def test_esc_as_live_mode_starts_leaves_everything_as_it_was(coarse_shot, ground):
    if ground == "none":
        bpy.data.objects.remove(coarse_shot.softground.ground)
    elif ground == "fine":
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=200, y_subdivisions=200, size=4.0)
        coarse_shot.softground.ground = bpy.context.object
    coarse_shot.frame_set(30)
    before = fingerprints.of_file()
    steps = steps_taken(live_start.starting(coarse_shot))
    baked_ground.clear(coarse_shot.softground.ground)
    if ground == "none":
        bpy.ops.object.select_all(action="DESELECT")
        created_ground.discard(coarse_shot.softground.ground)
    bpy.context.view_layer.update()
    assert fingerprints.of_file()["objects"].keys() == before["objects"].keys()
    before = fingerprints.of_file()
    assert steps > 50
    for share in (0.2, 0.5, 0.8, 1.0):
        analysis.forget()
        reuse.forget()
        asked = int(share * (steps - 1))
        assert steps_taken(live_start.starting(coarse_shot), asked) == asked
        assert fingerprints.of_file() == before
        assert not live.is_on()


@pytest.mark.slow
def test_esc_as_prints_are_kept_leaves_live_mode_on(coarse_shot):
    bpy.ops.softground.live()
    coarse_shot.frame_set(30)
    shown, before = display_heights(coarse_shot), fingerprints.of_file()
    for most in (1, 40, 80, 120):
        assert steps_taken(state.live.keeping(), most) == most
        assert fingerprints.of_file() == before
    coarse_shot.frame_set(48)
    assert live.is_on()
    assert (display_heights(coarse_shot) != shown).any()
    bpy.ops.softground.live(keep=True)
    assert not live.is_on()
