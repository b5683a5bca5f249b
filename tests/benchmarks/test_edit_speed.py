"""What moving a step of the demo's walk costs, ground by ground, in processor time."""

import time

import numpy as np
import pytest

from sample_scenes import demo
from softground_addon.blender.baking import step_edits
from softground_addon.core.record.edits import StepEdit

pytestmark = pytest.mark.benchmark

BARS = {"Snow": 0.030, "Mud": 0.040, "Soil": 0.040, "Dry Sand": 0.180}
"""[s] at the median: of the default ground, and what the others keep; sand slides to its angle of repose."""


@pytest.mark.parametrize("preset", BARS)
def test_a_step_of_the_demo_walk_follows_its_edit(scene, preset):
    lane = demo.bake_lane(scene, demo.create_walker(scene), preset, None)
    scene.softground.ground = lane.ground
    steps = step_edits.editable(scene).steps
    took = []
    for number, way in enumerate(np.random.default_rng(0).uniform(-0.1, 0.1, (24, 2))):
        edit = StepEdit(move_m=(float(way[0]), float(way[1])), turn_deg=5.0)
        start = time.thread_time()  # whatever else the machine does
        steps.pressed_again({2 + number % (len(lane.footprints) - 3): edit})
        took.append(time.thread_time() - start)
    print(f"{preset}: {1e3 * np.median(took):.1f} ms, at most {1e3 * max(took):.1f} ms")
    assert np.median(took) < BARS[preset]
