"""Standard deviations of forces: larger for what is known worse, and as wide as the errors against known forces are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.deviation import force_deviation
from softground_addon.core.loads.estimate import CharacterLoads, estimate_loads
from softground_addon.core.motion.motion import CharacterMotion
from tests.core import spring_mass
from tests.core.loads.test_forces_of_springs import noisy

SOIL = GroundMaterial(youngs_modulus=1e6, poisson_ratio=0.3, characteristic_time=0.1)


def estimated(motion: CharacterMotion) -> CharacterLoads:
    return estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SOIL)


@pytest.fixture(scope="module")
def walking():
    """A walk on springs at 60 frames a second, and its forces [N]."""
    return spring_mass.motion_and_forces(spring_mass.walk(), rate=60.0)


@pytest.fixture(scope="module")
def walk(walking):
    return estimated(walking[0])


def test_it_is_positive_where_a_foot_bears_and_nothing_where_none_touches(walk):
    deviation = force_deviation(walk)
    vertical = walk.forces.forces[..., 2]
    assert deviation.shape == vertical.shape
    assert (deviation[vertical > 1] > 0).all()
    far = ~walk.contacts.touching & ~np.roll(walk.contacts.touching, 9, 0) & ~np.roll(walk.contacts.touching, -9, 0)
    np.testing.assert_array_equal(deviation[far], 0.0)


def test_it_goes_with_the_mass(walking, walk):
    heavy = estimated(dataclasses.replace(walking[0], mass=2 * walk.motion.mass))
    np.testing.assert_allclose(force_deviation(heavy), 2 * force_deviation(walk), rtol=1e-6, atol=1e-6)


def test_noise_widens_it(walking, walk):
    shaken = estimated(noisy(walking[0], 0.004))
    assert force_deviation(shaken).mean() > 1.2 * force_deviation(walk).mean()


def test_it_is_about_as_wide_as_the_error_against_known_forces(walking, walk):
    steps = (len(walk.motion.frames) - 1) // (len(walking[0].frames) - 1)
    error = np.abs(walk.forces.forces[::steps, :, 2] - walking[1][..., 2])
    bearing = walking[1][..., 2] > 20
    deviation = force_deviation(walk)[::steps]
    assert np.mean(error[bearing] < 2 * deviation[bearing]) > 0.85


def test_a_body_without_joints_has_none(walk):
    with pytest.raises(ValueError, match="joints"):
        force_deviation(dataclasses.replace(walk, motion=dataclasses.replace(walk.motion, joints={})))
