"""The whole-body model against walks and runs on springs, whose forces are known: other bodies, speeds and rates."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import trapezoid

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import estimate_loads
from tests.core import spring_mass
from tests.core.spring_mass import WEIGHT, motion_and_forces

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
RUNS = {  # speed [m/s]: flight [s], stiffness [weights per leg length]
    2.5: (0.05, 20.0),
    3.5: (0.11, 25.0),
    5.0: (0.13, 30.0),
    7.0: (0.13, 40.0),
    9.0: (0.12, 55.0),
}


@cache
def run(speed):
    flight, stiffness = RUNS[speed]
    return spring_mass.run(speed, flight=flight, stiffness=stiffness)


@cache
def walk():
    return spring_mass.walk()


def errors(motion, forces):
    """Root mean square error of the vertical force in body weights: of the worse foot, and of the total."""
    loads = estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SNOW)
    steps = (len(loads.motion.frames) - 1) // (len(motion.frames) - 1)
    error = (loads.forces.forces[::steps] - forces)[..., 2] / WEIGHT
    return np.sqrt((error**2).mean(axis=0)).max(), np.sqrt((error.sum(axis=1) ** 2).mean())


def noisy(motion, noise, seed=0):
    random = np.random.default_rng(seed)
    soles = []
    for sole in motion.soles:
        transforms = sole.transforms.copy()
        transforms[:, 0, :3, 3] += noise * random.normal(size=(len(transforms), 3))
        soles.append(replace(sole, transforms=transforms))
    joints = {name: path + noise * random.normal(size=path.shape) for name, path in motion.joints.items()}
    return replace(motion, soles=tuple(soles), joints=joints)


def test_the_gaits_hold_their_weight_and_look_like_a_walk_and_a_run():
    for gait, contacts in ((walk(), 2), (run(3.5), 1)):
        vertical = gait.forces[..., 1]
        assert trapezoid(vertical.sum(axis=1), gait.times) / gait.times[-1] == pytest.approx(WEIGHT, rel=1e-3)
        assert (vertical > 0).sum(axis=1).max() == contacts
    hump = walk().forces[:, 1, 1]
    assert hump[2000:].min() < 0.8 * hump.max()


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0, 120.0, 240.0])
def test_a_walk_at_any_frame_rate(rate):
    foot, total = errors(*motion_and_forces(walk(), rate=rate))
    assert foot < 0.06  # the bars for measured walks
    assert total < 0.04


@pytest.mark.parametrize("rate", [60.0, 100.0, 240.0])
@pytest.mark.parametrize("speed", RUNS)
def test_a_run_at_any_speed_whose_contacts_the_frames_show(speed, rate):
    gait = run(speed)
    foot, total = errors(*motion_and_forces(gait, rate=rate))
    assert foot < (0.07 if gait.contact * rate > 5 else 0.1)
    assert total < (0.07 if gait.contact * rate > 5 else 0.12)


@pytest.mark.parametrize("speed", [2.5, 3.5])
def test_a_run_at_the_rates_of_film(speed):
    for rate in (24.0, 25.0, 30.0):
        foot, total = errors(*motion_and_forces(run(speed), rate=rate))
        assert foot < 0.08
        assert total < 0.09


@pytest.mark.parametrize("rate", [24.0, 60.0, 120.0])
@pytest.mark.parametrize(("speed", "most"), [(0.0, 0.1), (2.5, 0.065), (3.5, 0.115)])
def test_a_millimetre_of_noise_on_a_body_of_one_point(speed, most, rate):
    """White noise of 1 mm makes 0.14 body weights of it at 24 fps, and 3.6 at 120, before it is smoothed."""
    motion, forces = motion_and_forces(run(speed) if speed else walk(), rate=rate)
    assert np.mean([max(errors(noisy(motion, 0.001, seed), forces)) for seed in range(4)]) < most


@pytest.mark.parametrize("speed", [0.0, 3.5])
@pytest.mark.parametrize("size", [0.03, 0.3, 5.0, 100.0])
def test_mice_and_giants_at_the_time_of_their_size(speed, size):
    motion, forces = motion_and_forces(run(speed) if speed else walk(), rate=120.0, seconds=2.5)
    scaled = replace(
        motion,
        leg_length=motion.leg_length * size,
        frame_rate=motion.frame_rate / np.sqrt(size),
        joints={name: path * size for name, path in motion.joints.items()},
        soles=tuple(
            replace(
                sole,
                sole=replace(sole.sole, landmarks=sole.sole.landmarks * size),
                transforms=np.concatenate(
                    [
                        np.concatenate([sole.transforms[..., :3, :3], sole.transforms[..., :3, 3:] * size], axis=-1),
                        sole.transforms[..., 3:, :],
                    ],
                    axis=-2,
                ),
            )
            for sole in motion.soles
        ),
    )
    assert max(errors(scaled, forces)) < 0.04
