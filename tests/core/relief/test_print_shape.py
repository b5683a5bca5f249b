"""Shapes of prints: distances against scipy's, and depths that stay those of the record."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.relief.print_shape import nearest, shape_of
from tests.core.walkers import box_sole, loads_of, pose, pressed, sphere_sole, standing, walk

SNOW = GroundMaterial(375e3, 0.05, 0.2, blur_sigma=0.005)


@pytest.mark.parametrize("seed", range(4))
def test_distances_are_exact_within_reach(seed):
    random = np.random.default_rng(seed)
    chosen = random.random((31, 44)) < (0.02, 0.1, 0.5, 0.95)[seed]
    distance, which = nearest(chosen, 12)
    exact = distance_transform_edt(~chosen)
    near = exact <= 12
    assert np.allclose(distance[near], exact[near])
    assert (distance[~near] == 12).all()
    row, column = np.divmod(which, 44)
    at = np.indices(chosen.shape)
    assert chosen.ravel()[which[near]].all()
    assert np.allclose(np.hypot(row - at[0], column - at[1])[near], exact[near])


def test_the_floor_is_as_deep_as_the_record_says_and_goes_on_beyond_the_outline():
    _, footprints = pressed(walk(steps=1), SNOW)
    step = footprints[0]
    shape = shape_of(step, SNOW.blur_sigma)
    outline, floor = shape.fields[:2]
    assert floor[outline > 0.012].mean() == pytest.approx(shape.depth, rel=0.05)
    assert floor[np.abs(outline) < 0.02].min() > 0.5 * shape.depth
    assert shape.depth < step.max_depth_m


@pytest.mark.parametrize(("radius", "has_shape"), [(0.3, True), (0.05, True), (0.004, False)])
def test_balls_have_a_shape_down_to_a_few_cells(radius, has_shape):
    step = pressed(standing(sphere_sole(radius), [(0.0, 0.0, 0.0)], 400.0 * radius), SNOW, 0.005)[1][0]
    shape = shape_of(step, SNOW.blur_sigma)
    assert (shape is not None) == has_shape
    if shape:
        assert np.isfinite(shape.fields).all()
        assert 0 < shape.fineness <= 1


@pytest.mark.parametrize("pitch", [0.0, -0.25])
def test_heel_and_toes_are_those_of_the_sole_however_little_of_it_pressed(pitch):
    """A box on its front edge, as a runner on the ball of the foot: a tread is as large there as under a whole sole."""
    count, length = 61, 0.27
    place = pose((0.3, 0.1, length / 2 * np.sin(-pitch)), 0.7, pitch)
    loads = loads_of([box_sole(length, 0.1)], [np.tile(place, (count, 1, 1, 1))], np.full((count, 1), 500.0),
                     np.ones((count, 1), bool), 30.0)  # fmt: skip
    (step,) = pressed(loads, SNOW, 0.005)[1]
    shape = shape_of(step, SNOW.blur_sigma)
    x, y = np.meshgrid(*shape.window.centres(shape.cell_size))
    inside = shape.fields[0] > 0
    printed = np.ptp(shape.under_sole(x[inside], y[inside])[0])
    assert np.ptp(shape.along) == pytest.approx(length * np.cos(pitch), abs=1e-4)
    assert np.ptp(shape.across) == pytest.approx(0.1, abs=1e-4)
    assert printed < (0.75 if pitch else 1.05) * length
    middle = np.array([0.3, 0.1])
    along, across = shape.under_sole(*middle[:, None])
    assert sum(shape.along) / 2 == pytest.approx(along[0], abs=1e-4)
    assert sum(shape.across) / 2 == pytest.approx(across[0], abs=1e-4)
