"""Hard objects on a soft ground: soles stand on the highest surface within reach, and print beside it only."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.hard_ground import HardOnSoft, Reach, bare
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.terrain import MeshTerrain
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.loads.raised_rests import raised_rests, reach_of
from tests.core.prop_bodies import rolling
from tests.core.walkers import pressed, walk

SNOW = GroundMaterial(youngs_modulus=375e3, poisson_ratio=0.05, characteristic_time=0.2)
SQUARE = np.array([(0, 1, 2), (0, 2, 3)])


def slab(x, y, z):
    """A level rectangle, x and y its (low, high)."""
    corners = np.array([(x[0], y[0], z), (x[1], y[0], z), (x[1], y[1], z), (x[0], y[1], z)], float)
    return MeshTerrain.from_mesh(corners, SQUARE)


def standing_on(motions, *slabs):
    return HardOnSoft(FlatTerrain(), MeshTerrain.joined(list(slabs)), reach_of(motions))


def lifted(motion, height, start, end):
    """The motion, raised where its soles and hips are between two places along x [m]."""
    up = np.zeros((len(motion.frames), 1, 4, 4))
    hips = motion.hips[:, 0]
    up[:, 0, 2, 3] = height * ((hips > start) & (hips < end))
    soles = tuple(replace(sole, transforms=sole.transforms + up) for sole in motion.soles)
    return replace(motion, soles=soles, joints={key: at + up[:, 0, :3, 3] for key, at in motion.joints.items()})


def test_the_highest_surface_within_reach_counts_for_each_place():
    reach = Reach.of(np.array([[0.5, 0.5, 0.4]]), 1.0)
    terrain = HardOnSoft(
        FlatTerrain(), MeshTerrain.joined([slab((0, 1), (0, 1), 0.2), slab((0, 3), (0, 1), 2.0)]), reach
    )
    x, y = np.array([0.5, 1.5, 2.5, 0.5]), np.array([0.5, 0.5, 0.5, 1.5])
    assert terrain.heights(x, y).tolist() == [0.2, 0.0, 0.0, 0.0]
    assert np.isnan(bare(terrain).heights(x, y)).tolist() == [True, False, False, False]
    above = HardOnSoft(FlatTerrain(), terrain.hard, Reach.of(np.array([[0.5, 0.5, 2.1]]), 1.0))
    assert above.heights(x, y).tolist() == [2.0, 2.0, 0.0, 0.0]


def test_a_wheel_that_rolls_onto_a_slab_is_on_it_from_where_it_reaches_it():
    motion = rolling(30.0, seconds=2.0).motion
    terrain = standing_on([motion], slab((1.0, 9.0), (-1, 1), 0.0))
    loads = estimate_loads(motion, terrain, force_model="IMPULSE", material=SNOW)
    contacts, x = loads.contacts, loads.motion.soles[0].transforms[:, 0, 0, 3]
    assert contacts.hard[x > 1.1, 0].all()  # as far as it is still close to the soft ground behind it
    assert contacts.touching[x < 1.0, 0].all()
    assert not (contacts.hard & contacts.touching).any()


def test_a_ground_below_a_bridge_is_pressed_bit_for_bit_as_without_it():
    motion = walk().motion
    bridge = standing_on([motion], slab((-9, 9), (-9, 9), 2.0))
    loads = [
        estimate_loads(motion, terrain, force_model="WHOLE_BODY", material=SNOW) for terrain in (FlatTerrain(), bridge)
    ]
    (_, without), (_, below) = (
        pressed(each, SNOW, terrain=terrain) for each, terrain in zip(loads, (None, bridge), strict=True)
    )
    assert len(without) == len(below) > 4
    for footprint, other in zip(without, below, strict=True):
        assert footprint.compression.amounts.tobytes() == other.compression.amounts.tobytes()
        assert footprint.rim.amounts.tobytes() == other.rim.amounts.tobytes()


@pytest.mark.parametrize("height", [0.0, 0.1, 0.5])
def test_steps_on_a_slab_bear_and_leave_no_print_and_those_beside_it_are_as_on_their_own(height):
    flat = walk(steps=8).motion
    middle = flat.hips[:, 0].mean()
    over = (middle - 0.7, middle + 0.7)
    motion = lifted(flat, height, *over) if height else flat
    terrain = standing_on([motion], slab(over, (-1, 1), height))
    loads = estimate_loads(motion, terrain, force_model="IMPULSE", material=SNOW)
    contacts = loads.contacts
    assert contacts.hard.any()
    assert not (contacts.hard & contacts.touching).any()
    assert (loads.forces.forces[..., 2][contacts.hard] > 0).any()
    _, footprints = pressed(loads, SNOW, terrain=terrain)
    assert footprints
    for footprint in footprints:
        columns = footprint.window.column + footprint.compression.cells % footprint.window.columns
        x = (columns + 0.5) * footprint.cell_size
        assert not ((x > over[0]) & (x < over[1])).any()


def test_a_rest_well_above_the_ground_is_where_something_is_missing():
    flat = walk(steps=8).motion
    assert not list(raised_rests(flat, FlatTerrain()))
    middle = flat.hips[:, 0].mean()
    raised = list(raised_rests(lifted(flat, 0.2, middle - 0.7, middle + 0.7), FlatTerrain()))
    assert raised
    for rest in raised:
        assert abs(rest.place[2] - 0.2) < rest.near
        assert abs(rest.place[0] - middle) < 1.2
