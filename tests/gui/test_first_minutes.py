"""The first five minutes of a new user, in a real Blender as it starts."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]

FIRST_SCREEN = 600
"""Height of the sidebar in which the first screen is whole [px]."""


@pytest.fixture
def facts(tell):
    return tell("first_minutes")


def test_a_scene_without_a_character_offers_one(facts):
    assert facts["to begin with"] == [["Camera", "Cube", "Light"], ["Cube"]]
    assert facts["sample"] == ["Walking Figure"]


def test_scenes_start_with_the_preset_of_the_preferences(facts):
    assert facts["preferred"] == "Mud"


def test_two_clicks_show_prints_with_feet_in_them(facts):
    assert facts["prints"]["steps"] >= 6
    assert facts["deepest in view"] < -0.02
    assert facts["prints"]["floating_mm"] < 10
    assert "SoftGround Response" in facts["tracks"]


def test_the_ground_is_wide_selected_and_in_the_active_collection(facts):
    size, selected, collection = facts["ground"]
    assert min(size) > 5.0
    assert selected == ["SoftGround"]
    assert "SoftGround" in collection


def test_the_first_screen_fits_with_the_result_on_it(facts):
    assert facts["height"] == pytest.approx(FIRST_SCREEN, abs=2)
    assert facts["scrolled by"] == 0.0


def test_a_preset_brings_its_look_and_asks_for_another_bake(facts):
    assert facts["snow"][1] == "Snow"
    assert facts["mud"][1] == "Mud"
    assert facts["snow"][0] != facts["mud"][0]


def test_the_button_says_bake_again_at_its_place(facts):
    assert "softground.bake(" in facts["up to date"]
    assert "softground.bake_again(" in facts["outdated"]
    assert "softground.bake(" in facts["up to date again"]
    assert facts["mud prints"]["typical_depth_m"] != pytest.approx(facts["prints"]["typical_depth_m"], rel=0.02)


def test_a_depth_that_is_typed_is_what_a_bake_gives(facts):
    shown, title = facts["typed"]
    assert title == "Mud (modified)"
    assert shown == pytest.approx(9.0, rel=0.005)
    assert facts["typed prints"]["typical_depth_m"] == pytest.approx(0.09, rel=0.02)


def test_clear_bake_leaves_nothing_switched_on(facts):
    assert facts["cleared"]["deepest"] == 0.0
    assert facts["cleared"]["tracks"] == []
    assert facts["cleared"]["action"]
    assert not facts["cleared"]["grounding"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
