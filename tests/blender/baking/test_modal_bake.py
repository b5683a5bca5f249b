"""A bake that is left in any of its states has changed nothing."""

import time
from functools import partial
from types import SimpleNamespace

import bpy
import pytest

from softground_addon.blender import jobs, reuse, session
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.operators import modal_bake, modal_job
from softground_addon.blender.reading import analysis
from softground_addon.blender.settings import snapshot
from softground_addon.blender.setup import shot_setup as operators
from softground_addon.blender.state import state
from softground_addon.core.composers import pressed_shot
from softground_addon.core.errors import InputError
from tests.blender import fingerprints
from tests.blender.redraws import fill, least_seconds, walk_over_all_objects
from tests.blender.shots import walker
from tests.tiers import slow_but_one


def prepare(scene, ground):
    """A walker of bare bones, whose soles are quickly known, and the ground that it is to walk on."""
    armature = walker(scene, frames=12)
    for skin in armature.children:
        bpy.data.meshes.remove(skin.data)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.03
    if ground == "fine":
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=120, y_subdivisions=120, size=6.0)
    elif ground == "coarse":
        bpy.ops.mesh.primitive_plane_add(size=20.0)
    if ground != "created":
        scene.softground.ground = bpy.context.object
    bpy.context.view_layer.update()


def state_of(progress):
    """How far a bake is, and roughly how much of it there is in the file."""
    kinds = ("objects", "meshes", "materials", "node_groups", "scenes", "shape_keys", "hair_curves")
    attributes = sorted(len(mesh.attributes) for mesh in bpy.data.meshes)
    nodes = sum(len(tree.nodes) for tree in bpy.data.node_groups)
    fraction = progress.fraction if progress.stage == "write" else 0.0
    return progress.stage, fraction, tuple(len(getattr(bpy.data, kind)) for kind in kinds), tuple(attributes), nodes


def states_left(scene):
    """Leave a bake in each state that it comes to but the last, and yield the states; at last it is finished."""
    known = set()
    while True:
        job = bake_job.bake(scene)
        for progress in job:
            state = state_of(progress)
            if state not in known and progress.overall < 1.0:
                known.add(state)
                job.close()
                yield state
                break
        else:
            return


@pytest.mark.parametrize(
    ("ground", "again"), slow_but_one([("fine", True), ("created", False), ("coarse", False), ("coarse", True)])
)
def test_a_bake_left_in_any_state_leaves_the_file_as_it_was(scene, ground, again):
    prepare(scene, ground)
    if again:
        jobs.run(bake_job.bake(scene))
        scene.softground.characters[0].mass *= 1.5
    before, keys = fingerprints.of_file(), len(bpy.data.shape_keys)
    stages = []
    for reached in states_left(scene):
        assert (fingerprints.of_file(), len(bpy.data.shape_keys)) == (before, keys), reached
        stages.append(reached[0])
    assert {"sample", "simulate", "write"} == set(stages)
    assert stages.count("write") > 2
    assert fingerprints.of_file() != before


def test_prints_are_shown_as_they_are_pressed_where_somebody_looks_on(scene):
    prepare(scene, "fine")
    jobs.run(bake_job.bake(scene))
    assert state.pressing is None
    reuse.forget()
    session.show_bake(0.0, "")
    counts = []
    for progress in bake_job.bake(scene):
        if progress.stage == "simulate" and 0.0 < progress.fraction < 1.0:
            counts.append(len(state.pressing.footprints))
    assert 0 in counts
    assert counts == sorted(counts)
    record = baked_ground.record_of(scene.softground.ground)
    (pressed,) = state.results["prints", ""][1].grounds
    assert sorted(map(id, state.pressing.footprints)) == sorted(map(id, pressed.record.footprints))
    assert len(record.footprints) == len(state.pressing.footprints) > 0
    session.show_no_bake()
    assert state.pressing is None


def test_each_print_is_shown_once_where_bodies_lean(scene, monkeypatch):
    prepare(scene, "fine")
    scene.softground.tilt.use = True
    monkeypatch.setattr(pressed_shot, "leans_anew", lambda now, before: before is None)
    reuse.forget()
    session.show_bake(0.0, "")
    jobs.run(bake_job.bake(scene))
    shown = len(state.pressing.footprints)
    session.show_no_bake()
    assert shown == len(baked_ground.record_of(scene.softground.ground).footprints)


def pictures_of(scene, folder):
    """The pixels of a small render of frame 20."""
    scene.frame_set(20)
    scene.render.filepath = str(folder / "frame.png")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(folder / "frame.png"))
    pixels = list(image.pixels)
    bpy.data.images.remove(image)
    return pixels


@pytest.mark.slow
def test_renders_between_the_steps_of_a_bake_change_neither(scene, tmp_path):
    walker(scene, frames=24)
    bpy.ops.softground.add_character()
    bpy.ops.softground.create_ground()
    scene.collection.objects.link(camera := bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
    camera.location, scene.camera = (0.3, 0, 4), camera
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x = scene.render.resolution_y = 16
    picture = pictures_of(scene, tmp_path)
    undisturbed = jobs.run(bake_job.bake(scene, write=False)).report
    job, rendered = bake_job.bake(scene), 0
    try:
        for step in range(1000):
            progress = next(job)
            if step % 12 == 0 and progress.overall < 1.0:
                assert pictures_of(scene, tmp_path) == picture
                rendered += 1
    except StopIteration as finished:
        result = finished.value.report
    assert rendered >= 4
    assert (result["steps"], result["input_hash"]) == (undisturbed["steps"], undisturbed["input_hash"])


def test_no_bake_and_no_live_mode_begins_during_a_render(scene, monkeypatch):
    walker(scene, frames=24)
    bpy.ops.softground.add_character()
    assert bpy.ops.softground.bake.poll()
    assert bpy.ops.softground.live.poll()
    monkeypatch.setattr(session, "is_rendering", lambda: True)
    assert not bpy.ops.softground.bake.poll()
    assert not bpy.ops.softground.live.poll()


def test_what_was_deleted_under_a_bake_is_named(scene):
    armature = walker(scene, frames=24)
    bpy.ops.softground.add_character()
    needed = modal_job._needed_by_job(scene)
    armature.name = "Renamed"
    modal_job._check_still_there(needed)
    bpy.data.objects.remove(armature)
    with pytest.raises(InputError, match="'Walker' was deleted"):
        modal_job._check_still_there(needed)


def remove_characters(options):
    options.characters.clear()


def add_characters(options):
    for _ in range(100):  # more than the list has room for where it is
        options.characters.add()


def delete_rig(options):
    bpy.data.objects.remove(options.characters[0].armature)


def delete_ground(options):
    bpy.data.objects.remove(options.ground)


def purge(_options):
    bpy.ops.outliner.orphans_purge(do_recursive=True)


MOMENTS = {"sample": 0.0, "simulate": 0.5, "write": 0.6}
"""Progress of the stages at which a bake is disturbed."""


def end_of(scene, stage, disturb):
    """The error with which a bake ends that is disturbed in a stage, None if it is finished."""
    prepare(scene, "coarse")
    scene.softground.tilt.use = scene.softground.grounding.use = True
    job, undisturbed = bake_job.bake(scene), True
    try:
        for progress in job:
            if undisturbed and progress.stage == stage and progress.fraction >= MOMENTS[stage]:
                undisturbed = False
                disturb(scene.softground)
    except InputError as error:
        return str(error)
    assert not undisturbed
    return None


@pytest.mark.parametrize("stage", slow_but_one(MOMENTS))
@pytest.mark.parametrize("disturb", slow_but_one([remove_characters, add_characters]))
def test_a_bake_goes_on_whatever_becomes_of_the_list_of_characters(scene, stage, disturb):
    assert end_of(scene, stage, disturb) is None


@pytest.mark.parametrize("stage", slow_but_one(MOMENTS))
@pytest.mark.parametrize(("disturb", "gone"), slow_but_one([(delete_rig, "Walker"), (delete_ground, "Plane")]))
def test_a_bake_whose_parts_go_names_what_is_gone(scene, stage, disturb, gone):
    assert end_of(scene, stage, disturb).startswith((f"'{gone}' was deleted", f"Object '{gone}' was deleted"))


def test_a_bake_whose_draft_is_purged_says_so(scene):
    assert end_of(scene, "write", purge).startswith("'Plane Trail' was deleted")


def works_after(bake, seconds):
    """True if a tick works that comes some time after the last one [s]."""
    before = bake.worked
    bake._ticked = time.perf_counter() - seconds
    modal_job.ModalJob._tick(bake)
    return bake.worked > before


def test_events_come_before_more_work_where_blender_draws_for_long(scene):
    bake = SimpleNamespace(worked=0, _gave_way=False, _progress=None, _show_at=0.0, _needed={})
    bake._work = lambda until: setattr(bake, "worked", bake.worked + 1)
    long = 10 * modal_job.LONG_DRAWING
    assert works_after(bake, 0.0)
    assert [works_after(bake, long) for _ in range(4)] == [False, True, False, True]  # it goes on all the same
    assert works_after(bake, 0.0)


def test_drawing_the_progress_takes_a_small_part_of_the_time_however_long_it_takes(scene, monkeypatch):
    clock, drawing, drawn = [0.0], 0.3, []
    monkeypatch.setattr(modal_job.time, "perf_counter", lambda: clock[0])
    bake = SimpleNamespace(
        _gave_way=False, _progress=jobs.Progress("sample", 0.5), _show_at=0.0, _ticked=0.0, _needed={}
    )

    def work(until):
        clock[0] = until

    bake._work, bake._show_progress = work, lambda _progress: drawn.append(clock[0])
    while clock[0] < 30.0:
        before = len(drawn)
        modal_job.ModalJob._tick(bake)
        bake._ticked = clock[0]
        clock[0] += modal_job.TIMER_STEP + (drawing if len(drawn) > before else 0.0)
    assert 15 < len(drawn) < 30.0 / (modal_job.WORK_PER_DRAWING * drawing)


def test_a_tick_ends_where_blender_draws_its_window_anew(scene):
    def job():
        for step in range(5):
            if step == 2:
                bpy.data.meshes.new("Ground")
            yield jobs.Progress("write", step / 10)
        yield jobs.Progress("write", 1.0)
        return "written"

    bake = SimpleNamespace(
        scene=scene, _job=job(), _progress=None, _changing=partial(analysis.own_changes, scene), _needed={}
    )
    forever = time.perf_counter() + 1e6
    assert modal_job.ModalJob._work(bake, forever) is False
    assert bake._progress.fraction == 0.2
    assert modal_job.ModalJob._work(bake, forever) is True
    assert bake._result == "written"


def test_a_bake_whose_prints_are_still_to_come_says_how_to_see_them(scene):
    prepare(scene, "created")
    result = jobs.run(bake_job.bake(scene, write=False))
    first = min(step["frame_start"] for step in result.report["steps"])
    reports = []
    for is_first, frame in ((False, first - 1), (False, first + 1), (True, first + 1)):
        operator = SimpleNamespace(report=lambda _kind, text: reports.append(text), _is_first=is_first)
        scene.frame_set(int(frame))
        modal_bake.SOFTGROUND_OT_bake._show(operator, result)
    of_steps = [text for text in reports if "steps" in text]
    assert [text.endswith(". Press Play to see them") for text in of_steps] == [True, False, True]


def click(tab, place=(50, 50), kind="LEFTMOUSE", *, ctrl=False):
    """True if a bake lets an event through to a sidebar that shows a tab."""
    region = SimpleNamespace(type="UI", x=0, y=0, width=100, height=100, active_panel_category=tab)
    screen = SimpleNamespace(areas=[SimpleNamespace(type="VIEW_3D", regions=[region])])
    event = SimpleNamespace(type=kind, mouse_x=place[0], mouse_y=place[1], ctrl=ctrl)
    return modal_job._is_harmless(SimpleNamespace(screen=screen), event)


def test_a_bake_lets_clicks_through_to_its_own_panels_alone():
    assert click("SoftGround")
    assert not click("SoftGround", (150, 50))
    assert not click("Item")
    assert not click("SoftGround", kind="G")


def test_a_bake_lets_the_wheel_scroll_but_turn_no_values():
    assert click("Item", kind="WHEELUPMOUSE")
    assert not click("Item", kind="WHEELUPMOUSE", ctrl=True)


@pytest.mark.parametrize("baking", [False, True])
def test_another_window_is_held_while_a_bake_runs(addon, monkeypatch, baking):
    monkeypatch.setattr(state, "jobs", ["a bake"] if baking else [])
    context = SimpleNamespace(screen=None)

    def answer(kind, value="PRESS"):
        event = SimpleNamespace(type=kind, value=value, mouse_x=0, mouse_y=0, ctrl=False)
        return modal_job.SOFTGROUND_OT_hold_window.modal(None, context, event)

    held, let_through = {"RUNNING_MODAL"}, {"PASS_THROUGH"} if baking else {"FINISHED", "PASS_THROUGH"}
    assert answer("MOUSEMOVE", "NOTHING") == let_through
    assert answer("X") == answer("LEFTMOUSE") == (held if baking else let_through)
    assert not session.current().cancel_requested
    answer("ESC")
    assert session.current().cancel_requested == baking
    session.current().cancel_requested = False


@pytest.mark.parametrize("others", [0, 1])
def test_a_character_whose_reading_was_left_is_not_half_there(scene, others):
    for number in range(others):
        walker(scene, frames=40 + number)
        bpy.ops.softground.add_character()
    armature = walker(scene, frames=80)
    bpy.context.view_layer.update()

    def settings_now():
        options = scene.softground
        names = [character.name for character in options.characters]
        return names, options.active_character, options.frame_start, options.frame_end

    before, steps = settings_now(), 0
    job = operators._added(scene, armature, [armature])
    while settings_now() == before:
        next(job)
        steps += 1
    assert steps > 10  # its skin is looked at in as many
    job.close()
    assert settings_now() == before


def test_a_rig_that_is_deleted_while_its_feet_are_looked_for_is_named(scene):
    armature = walker(scene, frames=40)
    job = operators._added(scene, armature, [armature])
    for _ in range(5):
        next(job)
    bpy.data.objects.remove(armature)
    with pytest.raises(InputError, match="'Walker'"):
        jobs.run(job)
    assert not scene.softground.characters


@pytest.mark.slow
def test_a_tick_asks_for_what_it_reads_without_walking_over_all_objects(scene):
    prepare(scene, "coarse")
    fill(scene, 10_000)
    needed = modal_job._needed_by_job(scene)
    look = partial(modal_job._check_still_there, needed)
    assert least_seconds(look) < least_seconds(walk_over_all_objects) / 5


@pytest.mark.slow
def test_a_shot_is_read_in_steps_and_leaves_no_trace_where_that_ends(scene):
    walker(scene, frames=40)
    bpy.ops.softground.add_character()
    before = fingerprints.of_file()
    reuse.forget()
    steps = len(list(analysis.reading(scene)))
    assert steps > 30
    for end in range(0, steps, 7):
        analysis.forget()
        reuse.forget()
        job = analysis.reading(scene)
        for _ in range(end):
            next(job)
        job.close()
        assert fingerprints.of_file() == before
        assert analysis.known(snapshot(scene)) is None
