"""Root Motion, Clean Feet and a foot lock by clicks in a real Blender."""

import pytest

from sample_scenes.gait import Gait
from tests.gui.stories.clean_feet import FRAME, FRAMES, RATE

pytestmark = [pytest.mark.gui, pytest.mark.timeout(900)]


@pytest.fixture
def facts(tell):
    return tell("clean_feet")


def test_a_walk_on_the_spot_travels(facts):
    before, after = facts["travel"]
    assert before < 0.1
    assert after == pytest.approx(Gait().speed * (FRAMES - 1) / RATE, rel=0.05)
    assert facts["said"] == pytest.approx(Gait().speed, rel=0.02)


def test_its_feet_are_cleaned_in_a_layer_of_their_own(facts):
    assert {"SoftGround Clean Feet", "SoftGround Root Motion"} <= set(facts["layers"])


def test_a_contact_is_locked_where_the_playhead_is(facts):
    foot, frame, mode = facts["lock"]
    assert foot.startswith("foot.")
    assert (frame, mode) == (FRAME, "FLAT")
    assert facts["undone"] == 0


def test_the_locked_foot_lies_flat(facts):
    rolling, flat = facts["pitch"]
    assert flat < 1.0
    assert flat < rolling + 1e-3


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
