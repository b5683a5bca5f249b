"""The order of a frame: the tilt of frame k sees the ground of frame k - 1."""

import numpy as np
import pytest

from softground_addon.core.response.response import SUPPORT_TIME, TiltOptions, _lean, _support
from softground_addon.core.response.tilt import TiltGains
from tests.core.character import standing
from tests.core.legs.test_grounding import walk


class Sudden:
    """Level ground that rises by 10° along x from one frame on."""

    def __init__(self, frame):
        self.frame = frame

    def heights(self, x, y, frame):
        return np.where(np.asarray(frame) >= self.frame - 1e-9, np.tan(np.radians(10)) * x, 0.0) + 0.0 * y


def test_the_lean_answers_what_the_ground_was_one_frame_before_and_nothing_later():
    motion, touching = walk()
    tilt = TiltOptions(TiltGains(), strength=1.0)
    level = _lean(motion, touching, Sudden(np.inf), tilt)
    for frame in (10.0, 41.0, 60.0):
        lean = _lean(motion, touching, Sudden(frame), tilt)
        seen = int(np.searchsorted(motion.frames, frame)) + 1  # the frame after it
        assert np.array_equal(lean[:seen], level[:seen])
        assert lean[seen, 0] > 0
        assert lean[seen + 8, 0] > np.radians(1.0)


@pytest.mark.parametrize("rate", [24, 30, 60, 120])
def test_a_body_gains_support_over_the_same_time_at_any_frame_rate(rate):
    """Whatever the frame rate, a landing is spread over a bell of one standard deviation in seconds."""
    time = np.arange(2 * rate + 1) / rate
    support = _support(standing(len(time), rate=rate), np.repeat(time[:, None] >= 1.0, 2, axis=1))
    gained, middle = np.diff(support), (time[1:] + time[:-1]) / 2
    mean = gained @ middle
    assert gained.sum() == pytest.approx(1.0)
    assert mean == pytest.approx(1.0, abs=0.5 / rate + 1e-9)
    assert np.sqrt(gained @ (middle - mean) ** 2) == pytest.approx(SUPPORT_TIME, rel=0.03)
