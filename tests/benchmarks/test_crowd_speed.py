"""What a crowd costs against one figure; in processor time."""

import time
from dataclasses import replace

import bpy
import pytest

from softground_addon.blender import reuse
from softground_addon.blender.characters.selection import chosen, walkers_of
from softground_addon.blender.reading import staleness
from softground_addon.blender.settings import snapshot
from tests.benchmarks.bars import below
from tests.blender import shots

pytestmark = pytest.mark.benchmark

FRAMES = 96
FEW, MORE = 20, 60
CROWD = 12


def seconds(work, *inputs, turns=5):
    """Least processor time of some work [s]."""
    taken = []
    for _ in range(turns):
        started = time.process_time()
        work(*inputs)
        taken.append(time.process_time() - started)
    return min(taken)


def crowd(scene, count):
    """Walkers with one mesh and one action beside each other, all of them selected."""
    rig = shots.walker(scene, frames=FRAMES, coarseness=1.0)
    rigs = shots.copies(rig, [(2.0 * number, -0.3 * number, 0.0, 0.1 * number) for number in range(count)])
    bpy.context.view_layer.update()
    for each in rigs:
        each.select_set(True)
    return rigs


@pytest.mark.parametrize("looked_for", ["selected", "moving"])
def test_the_rigs_of_a_crowd_are_found_in_a_time_that_follows_their_pairs_at_most(scene, looked_for):
    taken = {}
    for count in (FEW, MORE):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        rigs = crowd(scene, count)
        if looked_for == "selected":
            taken[count] = seconds(chosen, scene, rigs[0], rigs)
        else:
            taken[count] = seconds(walkers_of, scene.objects)
    below(f"{MORE} {looked_for} rigs found over {FEW}", taken[MORE] / taken[FEW], (MORE / FEW) ** 2.5)


def test_a_crowd_that_does_the_same_is_added_in_a_third_of_what_its_figures_take_alone(scene):
    rigs, options = crowd(scene, CROWD), scene.softground

    def add():
        reuse.forget()
        options.characters.clear()
        bpy.ops.softground.add_character()

    of_all = seconds(add, turns=2)
    assert len(options.characters) == CROWD
    for each in rigs[1:]:
        each.select_set(False)
    of_one = seconds(add, turns=3)
    assert len(options.characters) == 1
    below(f"Add Character for {CROWD} that do the same, over each by itself", of_all / (CROWD * of_one), 1 / 3)


def test_what_a_crowd_shares_is_hashed_once(scene):
    crowd(scene, CROWD)
    bpy.ops.softground.add_character()
    of_all = snapshot(scene)
    of_one = replace(of_all, characters=of_all.characters[:1])
    alone = seconds(staleness.of_movers, scene.objects, of_one)
    together = seconds(staleness.of_movers, scene.objects, of_all)
    below(f"inputs of {CROWD} that do the same hashed, over those of each", together / (CROWD * alone), 0.4)
