"""What contacts and forces cost: 1,000 frames of a walk and of a run."""

import functools
import time

import numpy as np
import pytest

from softground_addon.core.dynamics.body_dynamics import body_dynamics
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.loads.contact_timing import refine_contacts
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.loads.forces import whole_body_forces
from softground_addon.core.motion.motion import steps_per_frame
from tests.benchmarks.bars import below
from tests.core import spring_mass
from tests.core.character import character, flat_sole
from tests.core.spring_mass import LEG, motion_and_forces

FRAMES = 1000
REPEATS = 20
LIMIT_MS = 50.0
"""Processor time for 1,000 frames."""


def body_on_springs(gait, rate):
    """The gait's point mass as a body with all its joints, on soles with heel, ball and toe."""
    motion, _ = motion_and_forces(gait, rate=rate, seconds=FRAMES / rate)
    hips = motion.joints["hips"]
    places = {"neck": (0.0, 0.6), "head": (0.0, 0.7)}
    for joint, z in {"shoulder": 0.5, "elbow": 0.2, "wrist": -0.1, "hip": 0.0, "knee": -0.4, "ankle": -0.8}.items():
        places |= {f"{joint}_l": (0.1, z), f"{joint}_r": (-0.1, z)}
    joints = {name: hips + np.array([0.0, y, z]) for name, (y, z) in places.items()}
    soles = [flat_sole(sole.transforms[:, 0, :3, 3], name=sole.sole.name) for sole in motion.soles]
    return character(soles, hips=hips, rate=rate, leg_length=LEG, **joints)


@pytest.mark.benchmark
@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("gait", [spring_mass.walk, functools.partial(spring_mass.run, 3.5)], ids=["walk", "run"])
def test_forces_for_a_thousand_frames(gait, rate):
    motion = body_on_springs(gait(), rate).resampled(steps_per_frame(rate))
    costs = {"contacts": np.inf, "forces": np.inf}
    for _ in range(REPEATS):
        start = time.process_time()
        contacts = detect_contacts(motion, FlatTerrain())
        middle = time.process_time()
        body = body_dynamics(motion, ~contacts.touching.any(axis=1))
        whole_body_forces(motion, refine_contacts(motion, contacts, body), body)
        end = time.process_time()
        costs["contacts"] = min(costs["contacts"], (middle - start) * 1e3)
        costs["forces"] = min(costs["forces"], (end - middle) * 1e3)
    name = getattr(gait, "__name__", "run")
    below(f"forces of {FRAMES} frames of a {name} at {rate:.0f} fps", costs["forces"], LIMIT_MS, "ms")
