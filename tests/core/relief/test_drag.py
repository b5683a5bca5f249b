"""Marks of soles that slide: where they did, as far as they did, and nowhere else."""

import numpy as np
import pytest

from softground_addon.core.record.pressed_ground import sample_at
from softground_addon.core.relief import amounts
from softground_addon.core.relief.drag import LEAST, Drag, drags_of
from softground_addon.core.relief.layers import Around
from softground_addon.core.relief.steps import ReliefSettings, all_together, relief_of_steps
from tests.core.relief.test_steps import MATERIALS, SHOWN, around, steps_on
from tests.core.walkers import GRAVITY, MASS, box_sole, loads_of, pose, pressed

LENGTH, DEPTH = 0.27, 0.03


def sliding(slide, *, from_part=0.75, to_part=1.0, heading=0.0):
    """The print of a box that stands for a second and slides ahead (m) in a part of that."""
    count = 121
    share = np.clip((np.linspace(0, 1, count) - from_part) / (to_part - from_part), 0, 1)
    ahead = slide * share
    place = np.stack([ahead * np.cos(heading), ahead * np.sin(heading), 0 * ahead], axis=-1)
    sole = box_sole(LENGTH, 0.1)
    loads = loads_of([sole], [pose(place, heading)[:, None]], np.full((count, 1), MASS * GRAVITY),
                     np.ones((count, 1), bool), 30.0)  # fmt: skip
    return pressed(loads, MATERIALS["mud"], 0.005)[1]


def test_who_does_not_slide_leaves_no_mark():
    assert [drags_of(step, LENGTH, DEPTH) for step in (*steps_on("mud"), *sliding(0.0))] == [[]] * 3
    assert drags_of(sliding(0.9 * LEAST)[0], LENGTH, DEPTH) == []


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_the_way_is_the_one_that_was_slid_at_the_end_or_at_the_beginning(heading):
    toward = np.array([np.cos(heading), np.sin(heading)])
    (leaving,) = drags_of(sliding(0.06, heading=heading)[0], LENGTH, DEPTH)
    assert leaving.way == pytest.approx(0.06 * toward, abs=1e-3)
    (landing,) = drags_of(sliding(0.06, from_part=0.0, to_part=0.25, heading=heading)[0], LENGTH, DEPTH)
    assert landing.way == pytest.approx(0.06 * toward, abs=2.5e-3)  # the way of the first step is not in it


def test_a_mark_is_of_lines_along_the_way_with_a_way_out_and_a_heap_before_it():
    mark = Drag(np.zeros(2), np.array([0.0, 0.06]), 0.035, DEPTH)
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.1, 0.1, 201), np.linspace(-0.1, 0.2, 301)))
    zero = np.zeros(len(x))

    def heights(pressed):
        return mark.heights(Around(3, x, y, x, y, zero, zero + pressed, 0.002, 1.0)).reshape(301, 201)

    inside = heights(1.0)
    middle = inside[120:150, 75:125]
    assert np.abs(np.diff(middle, axis=1)).mean() > 4 * np.abs(np.diff(middle, axis=0)).mean()
    out = heights(0.0) - inside
    assert out[160:175, 95:105].max() < -0.3 * DEPTH  # through the wall at the end of the way
    assert out[204:214, 95:105].min() > 0.05 * DEPTH
    far = np.hypot(x, np.clip(y, 0, 0.06) - y).reshape(301, 201) > 0.09
    assert not heights(0.0)[far].any()


def test_marks_keep_the_volume_and_give_the_same_bytes():
    steps = sliding(0.06)
    place = around(steps)
    wanted = ReliefSettings(amounts.of_look("mud"))
    first, again = (relief_of_steps(steps, *place, wanted, blur_sigma=MATERIALS["mud"].blur_sigma) for _ in range(2))
    assert np.array_equal(first[0].change, again[0].change)
    sample = sample_at(steps, *place, **SHOWN, blur_sigma=MATERIALS["mud"].blur_sigma)
    assert abs(all_together(first, place.shape[1])[:, 0].sum()) < 0.01 * sample.compression.sum()
