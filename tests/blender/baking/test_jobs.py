"""Jobs compute in slices, so that Blender answers between them."""

import time
from contextlib import ExitStack

import bpy
import numpy as np
import pytest

from softground_addon.blender.baking import bake_job, step_edits
from softground_addon.blender.ground import baked_ground, baked_steps, created_ground
from softground_addon.blender.jobs import Progress, meanwhile, run
from softground_addon.blender.live import live, live_start
from softground_addon.blender.plants import give_way_nodes
from softground_addon.blender.reading import analysis
from softground_addon.blender.state import state
from softground_addon.blender.viewport import step_editing
from softground_addon.blender.weather import ground_weather
from softground_addon.core.composers.ground_plan import GroundPlan
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.numerics.slices import sliced
from softground_addon.core.record.edits import StepEdit
from tests.blender.shots import walker
from tests.pace import at_pace
from tests.tiers import slow_but_one

LONGEST_STEP = 0.1
"""Longest time that a step of a bake may take of the processor [s], on a machine of the usual pace."""

LONGEST_IN_A_WINDOW = 0.3
"""Longest time that any step may take there, on a ground of any size [s]."""

NOW = Progress("write", 0.5)


@sliced
def halved(number):
    while number > 1:
        yield
        number /= 2
    return number


def test_a_job_comes_back_before_each_slice_and_ends_with_the_result():
    assert list(meanwhile(NOW, halved.slices(8))) == [NOW] * 4
    assert run(meanwhile(NOW, halved.slices(8))) == halved(8) == 1


def test_whoever_waits_is_shown_each_progress_once():
    def job():
        yield Progress("sample", 1.0)
        return (yield from meanwhile(NOW, halved.slices(8)))

    shown = []
    run(job(), shown.append)
    assert shown == [Progress("sample", 1.0), NOW]


def test_what_goes_wrong_in_a_slice_is_told():
    @sliced
    def failing():
        yield
        return 1 / 0

    with pytest.raises(ZeroDivisionError):
        run(meanwhile(NOW, failing.slices()))
    with pytest.raises(ZeroDivisionError):
        failing()


def steps_of(job):
    """What each step of a job takes of the processor [s], the longest first, each with how far it came."""
    steps, progress, began = [], None, time.thread_time()
    for progress in job:
        steps.append((time.thread_time() - began, progress))
        began = time.thread_time()
    return sorted([*steps, (time.thread_time() - began, progress)], key=lambda step: -step[0])


def share_of_longest(steps):
    """The part of all of their time that the longest of some steps takes."""
    return steps[0][0] / sum(seconds for seconds, _ in steps)


def test_a_large_ground_is_laid_out_in_short_steps():
    along = np.linspace(0.0, 15.0, 1500)
    plan = GroundPlan(np.full(2, -5.0), np.full(2, 20.0), FlatTerrain(), np.stack([along, along], axis=-1), 0.01)
    close_up = created_ground.CloseUp(0.0025, np.ones(len(along), dtype=bool), 10**7)
    steps = steps_of(created_ground.lay_out.slices(plan, 0.01, 1.0, reach=0.1, close_up=close_up))
    assert share_of_longest(steps) < 0.3, steps[:5]


@pytest.mark.slow
@pytest.mark.alone
def test_the_mesh_of_a_large_created_ground_is_made_in_short_steps(scene):
    plan = GroundPlan(np.full(2, -7.0), np.full(2, 7.0), FlatTerrain())
    layout = created_ground.lay_out(plan, 0.01, 1.0)
    assert len(layout.vertices) > 1_900_000
    with ExitStack() as drafts:
        steps = steps_of(meanwhile(NOW, created_ground.draft.slices(drafts, layout, 0.5)))
    assert steps[0][0] < at_pace(LONGEST_IN_A_WINDOW), steps[:5]


@pytest.mark.slow
@pytest.mark.alone
def test_no_step_of_live_mode_on_two_million_vertices_takes_long(scene):
    """The ground is coarse, and gets a copy along the trail."""
    walker(scene, frames=250, coarseness=1.0)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=1414, y_subdivisions=1414, size=200.0)
    scene.softground.ground = bpy.context.object
    bpy.context.view_layer.update()
    scene.frame_set(200)
    for keep in (False, True):
        steps = steps_of(live_job(scene, keep=keep))
        assert steps[0][0] < at_pace(LONGEST_IN_A_WINDOW), steps[:5]
    assert not live.is_on()
    assert "softground_record" in baked_ground.display_mesh_of(scene.softground.ground).data


def live_job(scene, *, keep):
    """What the button does that starts live mode, or ends it."""
    if not keep:
        live.begin((yield from live_start.starting(scene)))
    else:
        with analysis.own_changes(scene):
            yield from state.live.keeping()
            live.forget()


def create_plane():
    bpy.ops.mesh.primitive_plane_add(size=40.0)


def create_grid():
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=250, size=1.0, location=(9.0, 0.0, 0.0))
    bpy.context.object.scale = (24.0, 4.0, 1.0)


@pytest.mark.alone
@pytest.mark.parametrize("create", slow_but_one([None, create_plane, create_grid]))
def test_no_step_of_a_bake_of_250_frames_takes_long(scene, create):
    walker(scene, frames=250, coarseness=1.0)
    bpy.ops.softground.add_character()
    options = scene.softground
    if create:
        create()
        options.ground = bpy.context.object
        options.tilt.use = options.grounding.use = True
        bpy.context.view_layer.update()
    steps = steps_of(bake_job.bake(scene))
    assert options.frame_end == 250
    assert steps[0][0] < at_pace(LONGEST_STEP), steps[:5]


def edited(scene, edits):
    """What a button does that changes steps."""
    yield from step_edits.editing((yield from step_edits.reading(scene)), edits)


@pytest.mark.slow
@pytest.mark.alone
def test_no_step_of_weather_and_edits_on_a_million_vertices_takes_long(scene):
    """All steps are edited; then one more changes, and all are reset."""
    walker(scene, frames=160)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000, size=60.0)
    ground = scene.softground.ground = bpy.context.object
    scene.softground.detail = "NEVER"
    bpy.context.view_layer.update()
    run(bake_job.bake(scene))
    turned = [(step, StepEdit(turn_deg=5.0)) for step in baked_steps.of(ground)]
    assert len(turned) > 10
    run(edited(scene, step_editing.changed(ground, turned)))
    muted = step_editing.changed(ground, [(baked_steps.of(ground)[5], StepEdit(mute=True))])
    for edits in (muted, {}):
        steps = steps_of(edited(scene, edits))
        assert steps[0][0] < at_pace(LONGEST_IN_A_WINDOW), steps[:5]
    for _ in ("added", "renewed"):
        steps = steps_of(ground_weather.adding(ground, preset="SNOWFALL"))
        assert steps[0][0] < at_pace(LONGEST_IN_A_WINDOW), steps[:5]


@pytest.mark.slow
@pytest.mark.alone
def test_no_step_of_giving_way_takes_long_and_no_group_stays_when_it_is_cancelled(scene):
    steps = steps_of(meanwhile(NOW, give_way_nodes.ensure_group.slices()))
    assert steps[0][0] < at_pace(LONGEST_IN_A_WINDOW), steps[:5]
    (group,) = bpy.data.node_groups
    made = [node.bl_idname for node in group.nodes], len(group.links)
    assert give_way_nodes.ensure_group() == group
    bpy.data.node_groups.remove(group)
    for _ in zip(range(4), job := give_way_nodes.ensure_group.slices(), strict=False):
        pass
    job.close()
    assert not bpy.data.node_groups
    group = give_way_nodes.ensure_group()
    assert ([node.bl_idname for node in group.nodes], len(group.links)) == made


@pytest.mark.slow
@pytest.mark.alone
def test_clearing_beside_ten_thousand_objects_takes_as_long_as_blender_takes_to_add_one(scene):
    walker(scene, frames=48)
    bpy.ops.softground.add_character()
    scene.softground.sink_feet = True
    run(bake_job.bake(scene))
    for _ in range(10_000):
        scene.collection.objects.link(bpy.data.objects.new("Pebble", None))
    bpy.context.view_layer.update()
    began = time.thread_time()
    bpy.ops.object.empty_add()
    blenders = time.thread_time() - began
    began = time.thread_time()
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert time.thread_time() - began < 2.0 * blenders + at_pace(LONGEST_IN_A_WINDOW)
