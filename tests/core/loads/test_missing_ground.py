"""Feet beside or beyond the edge of the ground keep their load: the others bear no more than on the whole ground."""

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.loads.missing_ground import LevelBeyondEdge
from tests.core.character import Slope
from tests.core.walkers import walk

SNOW = GroundMaterial(youngs_modulus=375e3, poisson_ratio=0.05, characteristic_time=0.2)


class Part:
    """Level ground where `there` says so."""

    def __init__(self, covers):
        self.there = covers

    def heights(self, x, y):
        x, y = np.broadcast_arrays(x, y)
        return np.where(self.there(x, y), 0.0, np.nan)


def loads_on(terrain):
    return estimate_loads(walk().motion, terrain, force_model="WHOLE_BODY", material=SNOW)


PARTS = {
    "beside a kerb": (lambda x, y: y > 0, (True, False)),
    "under a third of a foot": (lambda x, y: y > 0.1, (True, False)),
    "on a rail": (lambda x, y: (y > 0.07) & (y < 0.1), (True, False)),
    "beyond a cliff": (lambda x, y: x < 1.2, None),
    "where the ground begins": (lambda x, y: x > 1.2, None),
    "over a gap": (lambda x, y: (x < 1.0) | (x > 1.9), None),
}


@pytest.mark.parametrize("name", PARTS)
def test_what_is_on_the_ground_bears_as_on_all_of_it_and_the_rest_bears_nothing(name):
    covers, soles = PARTS[name]
    whole, part = loads_on(FlatTerrain()), loads_on(Part(covers))
    on = part.contacts.touching
    assert on.any()
    if soles:
        assert tuple(on.any(axis=0)) == soles
    assert (on <= whole.contacts.touching).all()
    lost = whole.contacts.touching & ~on
    assert lost.any()
    assert not part.forces.forces[lost].any()
    assert np.isinf(part.contacts.clearance[lost]).all()
    weight = whole.motion.mass * whole.motion.gravity
    assert np.abs(part.forces.forces - whole.forces.forces)[on].max() < 0.01 * weight
    assert np.allclose(part.forces.total, part.forces.forces.sum(axis=1))


def test_the_ground_goes_on_level_from_its_nearest_edge():
    slope = Slope(height=0.1, slope=0.2, edge=1.0)
    beyond = LevelBeyondEdge(slope, np.array([[0.0, 0.0], [0.9, 0.0], [0.9, 2.0]]))
    x, y = np.array([0.5, 1.0, 1.2, 4.0]), np.array([0.0, 0.0, 0.0, 2.0])
    assert np.allclose(beyond.heights(x, y), [0.2, 0.3, 0.3, 0.3], atol=1e-3)
