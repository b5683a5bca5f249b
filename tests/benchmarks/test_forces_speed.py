"""What contacts and forces cost: 1,000 frames of a walk on the spot."""

import time

import numpy as np
import pytest

from softground_addon.core.body_dynamics import body_dynamics
from softground_addon.core.contact_timing import refine_contacts
from softground_addon.core.contacts import detect_contacts
from softground_addon.core.forces import whole_body_forces
from softground_addon.core.heightfield import FlatTerrain
from softground_addon.core.motion import steps_per_frame
from tests.core.character import character, flat_sole

FRAMES = 1000
REPEATS = 20
LIMIT_MS = 50.0
"""Processor time for 1,000 frames."""


def runner(rate):
    """A body that bounces from foot to foot at 2.8 steps a second, with flight between."""
    time_ = np.arange(FRAMES) / rate
    feet, height = [], np.zeros(FRAMES)
    for side, phase in ((0.1, 0.0), (-0.1, 0.5)):
        cycle = (time_ * 1.4 + phase) % 1.0
        lift = np.where(cycle < 0.35, 0.0, 0.2 * np.sin(np.pi * (cycle - 0.35) / 0.65))
        feet.append(flat_sole(np.stack([0 * time_, 0 * time_ + side, lift], axis=1)))
        height = np.maximum(height, np.where(cycle < 0.35, -0.06 * np.sin(np.pi * cycle / 0.35), -1.0))
    hips = np.stack([0 * time_, 0 * time_, 0.9 + np.where(height > -1, height, 0.0)], axis=1)
    joints = {
        name: hips + np.array([0.0, y, z]) for name, y, z in (("neck", 0, 0.6), ("hip_l", 0.1, 0), ("hip_r", -0.1, 0))
    }
    joints |= {f"{joint}_{side}": hips for joint in ("knee", "ankle", "elbow", "wrist", "shoulder") for side in "lr"}
    return character(feet, hips=hips, rate=rate, **joints)


@pytest.mark.benchmark
@pytest.mark.parametrize("rate", [24.0, 60.0, 120.0])
def test_forces_for_a_thousand_frames(rate):
    motion = runner(rate).resampled(steps_per_frame(rate))
    costs = {"contacts": np.inf, "forces": np.inf}
    for _ in range(REPEATS):
        start = time.process_time()
        contacts = detect_contacts(motion, FlatTerrain())
        middle = time.process_time()
        body = body_dynamics(motion)
        whole_body_forces(motion, refine_contacts(motion, contacts, body), body)
        end = time.process_time()
        costs["contacts"] = min(costs["contacts"], (middle - start) * 1e3)
        costs["forces"] = min(costs["forces"], (end - middle) * 1e3)
    print(f"\n{FRAMES} frames at {rate:.0f} fps: contacts {costs['contacts']:.1f} ms, forces {costs['forces']:.1f} ms")
    assert costs["forces"] < LIMIT_MS
