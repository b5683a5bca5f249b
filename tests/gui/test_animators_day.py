"""The animator goes on keying after a bake, in a real Blender: the keys act at once, are kept, and stay theirs."""

import math

import pytest

from tests.gui.stories.animators_day import FEET, KEYED

pytestmark = [pytest.mark.gui, pytest.mark.timeout(900)]


@pytest.fixture
def facts(tell):
    return tell("animators_day")


def test_the_action_stays_active_under_the_response(facts):
    assert "SoftGround Response" in facts["layers"]
    assert facts["active action"] == "Walk"


def test_a_key_acts_at_once_and_the_feet_stay_in_the_ground(facts):
    before, after = facts["poses"]
    assert math.dist(before[KEYED], after[KEYED]) > 0.05
    for foot in FEET:
        assert math.dist(before[foot], after[foot]) < 1e-4


def test_bake_again_turns_up_and_settles_it(facts):
    assert "animation" in facts["stale"]
    assert facts["stale after"] == ""
    assert facts["mode"] == "POSE", "who keys goes on keying"


def test_the_key_is_in_the_file(facts):
    assert facts["reopened"]["Walk"] == facts["cleared"]["Walk"]
    assert keys_of(facts["reopened"]["Walk"], KEYED) != keys_of(facts["before"]["Walk"], KEYED)


def test_cleared_the_actions_are_those_before_but_for_the_key(facts):
    assert set(facts["cleared"]) == set(facts["before"])
    assert facts["layers after"] == []
    others = [
        [curve for curve in facts[when]["Walk"] if f'"{KEYED}"' not in curve[0]] for when in ("before", "cleared")
    ]
    assert others[0] == others[1]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback


def keys_of(curves, bone):
    return [curve for curve in curves if f'"{bone}"' in curve[0]]
