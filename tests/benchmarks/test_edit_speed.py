"""What moving a step costs, ground by ground and in a long walk, in processor time."""

import time

import numpy as np
import pytest

from sample_scenes import demo
from softground_addon.blender import jobs
from softground_addon.blender.baking import step_edits
from softground_addon.core.composers.edited_steps import EditedSteps
from softground_addon.core.record.edits import StepEdit
from tests.benchmarks.bars import below
from tests.core.composers.test_edited_steps import CELL, baked, ground_of

pytestmark = pytest.mark.benchmark

BARS = {"Snow": 0.030, "Mud": 0.036, "Soil": 0.036, "Wet Sand (field)": 0.036, "Dry Sand": 0.080}
"""[s] at the median: of the default ground, and what the others keep; sand slides to its angle of repose."""
OF_A_THOUSAND = 0.050
"""[s] of one step of a thousand."""


def median_cost(steps, edits):
    """Median time of some edits, each alone [s]."""
    took = []
    for number, edit in edits:
        start = time.thread_time()  # whatever else the machine does
        steps.pressed_again({number: edit})
        took.append(time.thread_time() - start)
    return np.median(took)


@pytest.mark.parametrize("preset", BARS)
def test_a_step_of_the_demo_walk_follows_its_edit(scene, preset):
    lane = demo.bake_lane(scene, demo.create_walker(scene), preset, None)
    scene.softground.ground = lane.ground
    ways = np.random.default_rng(0).uniform(-0.1, 0.1, (24, 2)).tolist()
    numbers = (2 + number % (len(lane.footprints) - 3) for number in range(len(ways)))
    edits = [(n, StepEdit(move_m=(x, y), turn_deg=5.0)) for n, (x, y) in zip(numbers, ways, strict=True)]
    cost = median_cost(jobs.run(step_edits.reading(scene)).steps, edits)
    below(f"an edited step in {preset}", 1e3 * cost, 1e3 * BARS[preset], "ms")


def test_one_step_of_a_thousand_costs_no_more_than_one_of_fifty():
    edit, cost = StepEdit(move_m=(0.1, 0.0), turn_deg=5.0), {}
    for count in (50, 1000):
        _, record = baked(steps=count)
        cost[count] = median_cost(EditedSteps(record.footprints, ground_of(), CELL), [(n, edit) for n in range(20, 40)])
    below("an edited step of a thousand", 1e3 * cost[1000], 1e3 * OF_A_THOUSAND, "ms")
    below("an edited step of a thousand over one of fifty", cost[1000] / cost[50], 1.25)
