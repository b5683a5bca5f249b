"""Several soft grounds: each contact is on the one that most of the sole is over, and all of the load is shared out."""

import numpy as np
import pytest

from softground_addon.core.ground.hard_ground import SeveralGrounds, bare, up_to
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.raised_rests import reach_of
from softground_addon.core.loads.shared_ground import NO_GROUND, grounds_under, loads_on
from tests.core import prop_bodies
from tests.core.ground.test_hard_ground import slab
from tests.core.walkers import box_sole, pressed, standing, walk

SNOW = GroundMaterial(youngs_modulus=375e3, poisson_ratio=0.3, characteristic_time=0.05)


def grounds_of(motion, *slabs):
    return SeveralGrounds(tuple(slabs), reach_of([motion]))


def test_the_highest_within_reach_bears_and_in_one_plane_the_first():
    loads = standing(box_sole(0.26, 0.1), [(0.0, 0.0, 0.0)], 700.0)
    floor, crate, bridge = slab((-1, 1), (-1, 1), 0.0), slab((-1, 0), (-1, 1), 0.1), slab((-1, 1), (-1, 1), 3.0)
    grounds = grounds_of(loads.motion, floor, crate, bridge, floor)
    x, y = np.array([-0.05, 0.05, 5.0]), np.zeros(3)
    assert grounds.heights(x, y)[:2].tolist() == [0.1, 0.0]
    assert grounds.numbers(x, y).tolist() == [1, 0, -1]
    apart = grounds.apart([])
    own = [~np.isnan(bare(terrain).heights(x[:2], y[:2])) for terrain in apart]
    assert np.array(own)[[0, 1, 3]].tolist() == [[False, True], [True, False], [False, False]]


def test_where_all_are_above_the_limit_the_lowest_counts():
    loads = standing(box_sole(0.26, 0.1), [(0.0, 0.0, -0.2)], 700.0)  # keyed in the snow
    grounds = grounds_of(loads.motion, slab((-1, 1), (-1, 1), 0.0), slab((-1, 1), (-1, 1), 0.1))
    x = np.zeros(1)
    assert up_to(grounds, np.array([-0.1])).heights(x, x).tolist() == [0.0]
    assert up_to(grounds, np.array([0.05])).heights(x, x).tolist() == [0.0]
    assert grounds.heights(x, x).tolist() == [0.1]


def test_a_foot_across_an_edge_is_all_on_the_ground_under_most_of_it():
    for place, expected in ((-0.04, 0), (0.04, 1)):
        loads = standing(box_sole(0.26, 0.1), [(place, 0.0, 0.0)], 700.0)
        grounds = grounds_of(loads.motion, slab((-1, 0), (-1, 1), 0.0), slab((0, 1), (-1, 1), 0.005))
        on = grounds_under(loads, grounds)
        assert set(on[loads.contacts.touching]) == {expected}
        assert set(on[~loads.contacts.touching]) <= {NO_GROUND}


def test_a_walk_over_two_grounds_prints_on_each_as_on_one_and_all_of_it():
    loads = walk()
    middle = float(np.mean([sole.transforms[..., 0, 3].mean() for sole in loads.motion.soles]))
    low, high = slab((-9, middle), (-9, 9), 0.0), slab((middle, 9), (-9, 9), 0.0)
    grounds = grounds_of(loads.motion, low, high)
    on = grounds_under(loads, grounds)
    shares = [loads_on(loads, on, number) for number in range(2)]
    whole = loads.contacts.touching
    assert np.array_equal(shares[0].contacts.touching ^ shares[1].contacts.touching, whole)
    assert all(share.contacts.touching.any() for share in shares)
    _, alone = pressed(loads, SNOW)
    alone = {(step.sole, step.start_frame): step for step in alone}
    for share, terrain in zip(shares, grounds.apart([]), strict=True):
        _, prints = pressed(share, SNOW, terrain=terrain)
        inside = [step for step in prints if np.abs(step.window.corners(step.cell_size)[0][0] - middle) > 0.6]
        assert inside
        for step in inside:
            same = alone[step.sole, step.start_frame]
            assert step.compressed_m3 == pytest.approx(same.compressed_m3, rel=1e-6)
            assert step.rim_m3 == pytest.approx(same.rim_m3, rel=1e-6)
            assert step.max_depth_m == pytest.approx(same.max_depth_m, rel=1e-6)


def test_a_wheel_changes_its_ground_as_it_rolls_on():
    loads = prop_bodies.rolling(120.0)
    x = loads.motion.soles[0].transforms[:, 0, 0, 3]
    middle = float((x[0] + x[-1]) / 2)
    grounds = grounds_of(loads.motion, slab((-9, middle), (-9, 9), 0.0), slab((middle, 9), (-9, 9), 0.0))
    on = grounds_under(loads, grounds)[:, 0]
    touching = loads.contacts.touching[:, 0]
    assert set(on[touching]) == {0, 1}
    assert (np.diff(on[touching]) >= 0).all()
    changes = x[touching][np.flatnonzero(np.diff(on[touching]))]
    assert changes == pytest.approx([middle], abs=loads.motion.soles[0].sole.length)
