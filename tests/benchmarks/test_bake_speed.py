"""What a whole bake costs against what Blender needs to step through the same shot; in processor time."""

import time
from math import inf

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs, reuse
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.rigs.rig_mapping import map_rig
from softground_addon.blender.sampling.rig_sampling import sample_character
from softground_addon.blender.sampling.take import Take
from tests.benchmarks.bars import below, note
from tests.benchmarks.test_playback_speed import heavy_walker
from tests.blender import shots

pytestmark = pytest.mark.benchmark

FRAMES = 250
DEEP_FRAMES = 60


def bare_frames(scene):
    """Seconds to step through the frames of the shot as it is."""
    started = time.process_time()
    for frame in range(1, FRAMES + 1):
        scene.frame_set(frame)
    return time.process_time() - started


def production_character(scene):
    """21 bones under a skin as heavy as a production character's."""
    heavy_walker(scene, FRAMES)


def light_character(scene):
    """The same bones under the few thousand vertices of the project's own walker."""
    shots.walker(scene, frames=FRAMES, coarseness=1.0)


def bones_only(scene):
    """The same bones without any mesh."""
    shots.walker(scene, frames=FRAMES, coarseness=1.0)
    for thing in list(scene.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)


ONCE = "ground and playback are made once for a shot, and cost more than 250 frames of so few bones"


@pytest.mark.parametrize(
    "character",
    [production_character, light_character, pytest.param(bones_only, marks=pytest.mark.xfail(reason=ONCE))],
)
def test_a_whole_bake_costs_at_most_twice_the_bare_frames_plus_the_simulation(scene, character):
    ratios = []
    for _ in range(3):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        character(scene)
        bpy.context.view_layer.update()
        bare = bare_frames(scene)
        scene.frame_set(1)
        bpy.ops.softground.add_character()
        stages = dict.fromkeys(jobs.STAGES, 0.0)
        job, before = bake_job.bake(scene), time.process_time()
        for progress in job:
            now = time.process_time()
            stages[progress.stage] += now - before
            before = now
        ratios.append((stages["sample"] + stages["write"]) / bare)
    below(f"a bake over bare frames, {character.__name__.replace('_', ' ')}", min(ratios), 2.0)


def test_keys_are_read_in_half_the_time_in_which_they_are_evaluated(scene):
    armature = shots.import_motion("zombie")
    mapping, frames = map_rig(armature), range(1, 501)

    def milliseconds():
        take, started = Take.about(armature, scene, frames), time.process_time()
        sampling = sample_character(take, armature, mapping, mass=70.0)
        while next(sampling) < len(frames):
            pass
        sampling.close()
        return (time.process_time() - started) / len(frames) * 1e3

    read = min(milliseconds() for _ in range(5))
    armature.constraints.new("LIMIT_LOCATION")  # which does nothing, but is more than keys
    evaluated = min(milliseconds() for _ in range(5))
    below("reading of keys, over evaluating them", read / evaluated, 0.5)


@pytest.mark.parametrize("preset", ["Snow", "Mud", "Dry Sand"])
def test_a_bake_under_weather_takes_at_most_a_tenth_longer(scene, preset):
    heavy_walker(scene, FRAMES)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name=preset)
    jobs.run(bake_job.bake(scene))
    seconds = {False: [], True: []}
    for _ in range(3):
        for under_weather, taken in seconds.items():
            if under_weather:
                bpy.ops.softground.add_weather()
            elif bpy.ops.softground.remove_weather.poll():
                bpy.ops.softground.remove_weather()
            taken.append(_anew(scene))
    without, with_weather = min(seconds[False]), min(seconds[True])
    below(f"a bake under weather over one without, {preset}", with_weather / without, 1.1)


def seconds_to_bake(scene):
    """Processor time of a bake [s]."""
    started = time.process_time()
    jobs.run(bake_job.bake(scene))
    return time.process_time() - started


def walk_in_snow(scene, frames):
    """A walk with the settings that scenes begin with, and what its first bake takes [s]."""
    shots.walker(scene, frames=frames)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.relief, options.debris, options.cell_size, options.sink_feet = "FINE", True, 0.0051, True
    return seconds_to_bake(scene)


@pytest.mark.parametrize("frames", [96, 400])
def test_a_bake_on_the_ground_of_the_first_takes_little_longer(scene, frames):
    first = walk_in_snow(scene, frames)
    again = min(_anew(scene) for _ in range(3))
    below(f"a bake on the ground of the first over the first, {frames} frames", again / first, 1.5)


def _anew(scene):
    reuse.forget()
    return seconds_to_bake(scene)


@pytest.mark.parametrize(
    ("setting", "values", "share"),
    [
        ("relief_strength", (0.8, 1.0), 0.4),
        ("relief", ("OFF", "FINE"), 0.65),
        ("pressure", ("UNIFORM", "CENTRE_OF_PRESSURE"), 0.95),
    ],
)
def test_a_bake_after_a_change_works_out_only_what_follows_from_it(scene, setting, values, share):
    walk_in_snow(scene, 400)
    took = {True: [], False: []}
    for number in range(6):
        setattr(scene.softground, setting, values[number // 2 % 2])
        if number % 2:
            reuse.forget()
        took[bool(number % 2)].append(seconds_to_bake(scene))
    whole, again = min(took[True]), min(took[False][1:])
    below(f"a bake after a change of {setting} over a whole one", again / whole, share)


@pytest.mark.parametrize("relief", ["OFF", "FINE"])
@pytest.mark.parametrize("cell", [0.01, 0.005])
def test_a_bake_with_carving_takes_little_longer_and_plays_as_fast(scene, cell, relief):
    shots.walker(scene, frames=DEEP_FRAMES, coarseness=1.0)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.frame_end, options.cell_size, options.sink_feet, options.relief = DEEP_FRAMES, cell, True, relief
    options.pressure, options.material.layer_depth = "CENTRE_OF_PRESSURE", 0.6
    options.material.youngs_modulus, options.material.poisson_ratio = 123e3, 0.0  # in which it sinks 35 cm
    baked, played, recorded = {}, {}, {}
    for turn in range(3):
        for options.carve in (False, True):
            seconds = _anew(scene)
            mesh = baked_ground.display_mesh_of(options.ground).data
            recorded[options.carve] = len(bytes(mesh[ground_mesh.RECORD]))
            frames = _least_of_frames(scene, range(2, DEEP_FRAMES, 3))
            if turn:  # the first makes the ground
                baked[options.carve] = min(seconds, baked.get(options.carve, inf))
            played[options.carve] = np.minimum(frames, played.get(options.carve, inf))
    steps = len(baked_ground.record_of(options.ground).carves)
    of_cells = f"cells of {cell * 1e3:g} mm, relief {relief.lower()}"
    rows = (
        (f"a bake with carving over one without, {of_cells}", baked[True] / baked[False], 1.6, "times"),
        (f"a frame of it over one without, {of_cells}", played[True].mean() / played[False].mean(), 1.15, "times"),
        (
            f"its record over one without, {of_cells}",
            (recorded[True] - recorded[False]) / steps / 1e6,
            0.4,
            "MB a step",
        ),
    )
    for what, value, most, unit in rows:
        note(what, value, most, unit)
    assert all(value <= most for _, value, most, _ in rows)


def _least_of_frames(scene, frames, turns=2):
    """Least time of the clock that each frame takes [s], (F,)."""
    taken = np.full((turns, len(frames)), inf)
    for turn in range(turns):
        for number, frame in enumerate(frames):
            started = time.perf_counter()
            scene.frame_set(frame)
            taken[turn, number] = time.perf_counter() - started
    return taken.min(axis=0)
