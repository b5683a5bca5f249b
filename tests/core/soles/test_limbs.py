"""Hands, knees and paws beside the feet: when they touch, and how the load spreads over many contacts."""

import numpy as np
import pytest

from softground_addon.core.dynamics.centre_of_mass import centre_of_mass
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.motion.motion import CharacterMotion
from softground_addon.core.motion.sole_motion import SoleMotion
from tests.core.prop_bodies import prop_sole, sphere
from tests.core.walkers import pose

GRAVITY, MASS = 9.81, 70.0
PALM = 0.05
SNOW = GroundMaterial(375e3, 0.05, 0.2)
PLACES = {"hand.L": (0.45, 0.18), "hand.R": (0.45, -0.18), "knee.L": (-0.05, 0.12), "knee.R": (-0.05, -0.12)}


def on_all_fours(paths, hips, neck, rate=30.0):
    """A body on four round limbs that follow paths (F, 3), with joints at the hips and the neck."""
    soles = tuple(
        SoleMotion(prop_sole(*sphere(PALM, rings=24), name=name), pose(path)[:, None]) for name, path in paths.items()
    )
    frames = 1.0 + np.arange(len(hips))
    return CharacterMotion("crawler", MASS, 0.9, frames, rate, soles, {"hips": hips, "neck": neck}, GRAVITY)


def loads_of(motion):
    return estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SNOW)


def test_hands_and_knees_that_stand_still_share_the_weight_by_moment():
    count = 60
    paths = {name: np.tile([x, y, PALM], (count, 1)) for name, (x, y) in PLACES.items()}
    hips, neck = np.tile([0.0, 0.0, 0.5], (count, 1)), np.tile([0.5, 0.0, 0.5], (count, 1))
    loads = loads_of(on_all_fours(paths, hips, neck))
    vertical = loads.forces.forces[30, :, 2]
    assert vertical.sum() == pytest.approx(MASS * GRAVITY, rel=1e-3)
    places = np.array(list(PLACES.values()))
    centre = centre_of_mass(loads.motion)[30, :2]
    assert vertical @ places / vertical.sum() == pytest.approx(centre, abs=0.02)
    assert vertical[0] == pytest.approx(vertical[1], rel=0.01)
    assert vertical[2] == pytest.approx(vertical[3], rel=0.01)


def crawl(rate=30.0, seconds=6.0, period=1.5, stride=0.4):
    """Each limb swings for a third of the cycle, diagonal ones together; the trunk goes on evenly."""
    time = np.arange(round(seconds * rate) + 1) / rate
    paths, swinging = {}, {}
    for (name, (x, y)), phase in zip(PLACES.items(), (0.0, 0.5, 0.5, 0.0), strict=True):
        cycle = time / period + phase
        u = np.clip((cycle % 1.0) / 0.33, 0, 1)
        smooth = u**2 * (3 - 2 * u)
        paths[name] = np.stack(
            [x + stride * (np.floor(cycle) + smooth - phase - 0.8), y + 0 * time, PALM + 0.07 * np.sin(np.pi * u)], -1
        )
        swinging[name] = (u > 0.15) & (u < 0.85)
    ahead = stride / period * time[:, None] * (1.0, 0.0, 0.0)
    return on_all_fours(paths, ahead + np.array([0.0, 0.0, 0.5]), ahead + np.array([0.5, 0.0, 0.5]), rate), swinging


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0])
def test_a_crawl_presses_by_hands_and_knees_in_turn_and_bears_one_weight(rate):
    motion, swinging = crawl(rate)
    loads = loads_of(motion)
    at_frames = loads.motion.on_frames
    inner = slice(round(rate), -round(rate))
    vertical = loads.forces.forces[at_frames][inner, :, 2]
    assert vertical.sum(axis=1).mean() == pytest.approx(MASS * GRAVITY, rel=0.01)
    x = loads.forces.centre_of_pressure[at_frames][inner, :, 0]
    arm = x - centre_of_mass(loads.motion)[at_frames][inner, :1]
    # Two limbs at a time need not span the centre of mass, which is why this holds to a tenth of their distance.
    assert (vertical * arm).sum(axis=1).mean() / (MASS * GRAVITY) == pytest.approx(0.0, abs=0.05)
    for number, name in enumerate(PLACES):
        assert vertical[swinging[name][inner], number].max() < 0.02 * MASS * GRAVITY
        assert vertical[:, number].mean() > 0.05 * MASS * GRAVITY, name
        touches = np.diff(loads.contacts.touching[:, number].astype(int))
        assert 3 <= (touches > 0).sum() <= 4


def test_a_hand_that_swings_by_close_to_the_ground_does_not_touch_it():
    motion, _ = crawl()
    soles = list(motion.soles)
    lifted = soles[0].transforms.copy()
    lifted[..., 2, 3] += 0.08
    soles[0] = SoleMotion(soles[0].sole, lifted)
    joints, frames = motion.joints, motion.frames
    loads = loads_of(CharacterMotion("crawler", MASS, 0.9, frames, 30.0, tuple(soles), joints, GRAVITY))
    assert not loads.contacts.touching[:, 0].any()
