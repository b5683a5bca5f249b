"""What a body's motion says about the forces on it, against mechanics in closed form."""

import numpy as np
import pytest

from softground_addon.core.dynamics.body_dynamics import body_dynamics
from softground_addon.core.motion.motion import CharacterMotion, steps_per_frame

GRAVITY = 9.81
UPPER = 0.3795
"""Part of the mass that a body with hips and neck only has at its neck: 0.486 of the trunk, head and arms (de Leva)."""


@pytest.mark.parametrize("seconds", [0.5, 1.5])
@pytest.mark.parametrize("rate", [24, 30, 60, 120])
def test_a_trunk_that_tips_ever_faster_needs_the_moment_that_turns_it(rate, seconds):
    frames = round(seconds * rate)
    height, acceleration = 0.5, 2.0
    time = np.arange(frames) / rate
    hips = np.tile((0.0, 0.0, 1.0), (frames, 1))
    neck = hips + np.stack([acceleration / 2 * time**2, 0 * time, 0 * time + height], axis=-1)
    motion = CharacterMotion("two points", 70.0, 0.9, 1.0 + np.arange(frames), rate, (), {"hips": hips, "neck": neck})

    body = body_dynamics(motion.resampled(steps_per_frame(rate)))

    middle = len(body.moment) // 2
    expected = UPPER * (1 - UPPER) * height * acceleration / GRAVITY
    assert body.moment[middle] == pytest.approx((0.0, expected, 0.0), rel=0.01, abs=1e-6)
    assert body.force[middle] == pytest.approx((UPPER * acceleration / GRAVITY, 0.0, 1.0), rel=0.01, abs=1e-6)
