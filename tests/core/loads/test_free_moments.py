"""Free moments against bodies whose turning is known in closed form."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.loads.free_moments import GRIP, free_moments
from tests.core import spring_mass
from tests.core.character import standing

RATE, MASS = 120.0, 70.0
INNER = slice(40, -40)
"""Frames away from the ends of the motion."""
SOIL = GroundMaterial(youngs_modulus=1e6, poisson_ratio=0.3, characteristic_time=0.1)


def estimated(motion):
    return estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SOIL)


def circling(radius, angle, height):
    """Two paths on opposite sides of the vertical through the origin."""
    around = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    return tuple(sign * radius * around + (0.0, 0.0, height) for sign in (1, -1))


def turning(angle, *, shoulders=0.0, reach=0.0, at=((0.0, 0.0, 0.0),)):
    """A body upright over the origin that turns its shoulders and its outstretched arms by `angle` (N,) [rad]."""
    count = len(angle)
    upright = {name: np.tile((0.0, 0.0, height), (count, 1)) for name, height in (("neck", 1.4), ("head", 1.5))}
    joints = {}
    for name, radius in (("shoulder", shoulders), ("elbow", shoulders + reach), ("wrist", shoulders + 2 * reach)):
        joints[f"{name}_l"], joints[f"{name}_r"] = circling(radius, angle, 1.4)
    return standing(count, at=at, rate=RATE, mass=MASS, **upright, **joints)


def swing(count=361, amplitude=0.25, frequency=1.0):
    """Angle [rad], and its second derivative."""
    phase = 2 * np.pi * frequency * np.arange(count) / RATE
    return amplitude * np.sin(phase), -amplitude * (2 * np.pi * frequency) ** 2 * np.sin(phase)


def at_frames(motion, values):
    """Values at the simulation's steps at the frames of the motion that was given."""
    return values[:: (len(values) - 1) // (len(motion.frames) - 1)]


def inertia(shoulders, reach):
    """About the vertical of both arms, and of the quarters of the trunk at the shoulders [kg·m²]; de Leva's table."""
    trunk = 0.4346 * (1 - 0.5138) / 2 * shoulders**2
    arms = (
        0.0271 * (shoulders + 0.5772 * reach) ** 2
        + 0.0162 * (shoulders + 1.4574 * reach) ** 2
        + 0.0061 * (shoulders + 2.25 * reach) ** 2
    )
    return MASS * (trunk + 2 * arms)


@pytest.mark.parametrize(("shoulders", "reach"), [(0.18, 0.0), (0.18, 0.28)])
def test_who_swings_arms_and_shoulders_about_the_vertical_twists_the_foot_that_stands(shoulders, reach):
    angle, faster = swing()
    motion = turning(angle, shoulders=shoulders, reach=reach)
    moment = at_frames(motion, free_moments(estimated(motion)))[:, 0]
    wanted = inertia(shoulders, reach) * faster
    assert np.abs(wanted).max() > 0.5
    np.testing.assert_allclose(moment[INNER], wanted[INNER], atol=0.06 * np.abs(wanted).max())


def test_two_feet_share_the_twist_as_they_share_the_load():
    angle, faster = swing()
    motion = turning(angle, shoulders=0.18, reach=0.28, at=((0.0, 0.1, 0.0), (0.0, -0.1, 0.0)))
    moment = at_frames(motion, free_moments(estimated(motion)))[INNER]
    wanted = inertia(0.18, 0.28) * faster[INNER]
    np.testing.assert_allclose(moment[:, 0], moment[:, 1], atol=0.05 * np.abs(moment).max())
    np.testing.assert_allclose(moment.sum(axis=1), wanted, atol=0.06 * np.abs(wanted).max())


def test_mirrored_bodies_twist_the_other_way_and_still_ones_not_at_all():
    angle, _ = swing()
    first, other = (free_moments(estimated(turning(a, shoulders=0.18, reach=0.28))) for a in (angle, -angle))
    np.testing.assert_allclose(first, -other, atol=1e-6)
    assert np.abs(free_moments(estimated(turning(0 * angle, shoulders=0.18, reach=0.28)))).max() < 1e-6


def test_a_twist_is_held_by_the_grip_of_a_sole_and_ends_in_flight():
    angle, _ = swing(frequency=3.0, amplitude=1.5)
    loads = estimated(turning(angle, shoulders=0.18, reach=0.28))
    load = loads.forces.forces[..., 2]
    moment = np.abs(free_moments(loads))
    assert (moment <= GRIP * loads.motion.leg_length * load + 1e-9).all()
    assert (moment > 0.99 * GRIP * loads.motion.leg_length * load).any()
    run = estimated(spring_mass.motion_and_forces(spring_mass.run(3.5), rate=120.0)[0])
    assert (free_moments(run)[~run.contacts.touching] == 0).all()


def test_a_body_without_joints_has_none():
    loads = estimated(turning(swing()[0]))
    with pytest.raises(ValueError, match="joints"):
        free_moments(dataclasses.replace(loads, motion=dataclasses.replace(loads.motion, joints={})))
