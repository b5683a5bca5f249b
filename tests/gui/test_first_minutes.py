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


def test_who_enables_it_is_told_where_it_is(facts):
    assert facts["told where it is"]


def test_scenes_start_with_the_preset_of_the_preferences(facts):
    assert facts["preferred"] == "Mud"


def test_two_clicks_show_prints_with_feet_in_them(facts):
    assert facts["prints"]["steps"] >= 6
    assert facts["deepest in view"] < -0.02
    assert facts["prints"]["floating_mm"] < 10
    assert "SoftGround Response" in facts["layers"]


PRINT = 50
"""Least width of a print that is seen well [px]; it has been five."""


def test_the_first_bake_shows_its_last_prints_in_a_low_light(facts):
    seen = [width for across, up, width in facts["prints in view"] if 0 < across < 0.8 and 0 < up < 1]
    assert len(seen) >= 3
    assert min(seen) > PRINT
    assert facts["shading"] == ["outdoor.sl", True, False]


def test_the_ground_is_wide_in_the_active_collection_and_leaves_the_figure_selected(facts):
    size, selected, collection = facts["ground"]
    assert min(size) > 5.0
    assert selected == ["Walking Figure"]
    assert "SoftGround" in collection


def test_the_first_screen_fits_with_the_result_on_it(facts):
    assert facts["height"] == pytest.approx(FIRST_SCREEN, abs=2)
    assert facts["scrolled by"] == 0.0


def test_a_preset_brings_its_look_and_asks_for_another_bake(facts):
    assert facts["snow"][1] == "Snow"
    assert facts["mud"][1] == "Soft Mud"
    assert facts["snow"][0] != facts["mud"][0]


def test_the_button_says_bake_again_at_its_place(facts):
    assert "softground.bake(" in facts["up to date"]
    assert "softground.bake_again(" in facts["outdated"]
    assert "softground.bake(" in facts["up to date again"]
    assert facts["mud prints"]["typical_depth_m"] != pytest.approx(facts["prints"]["typical_depth_m"], rel=0.02)


def test_a_depth_that_is_typed_is_what_a_bake_gives(facts):
    shown, title = facts["typed"]
    assert title == "Soft Mud (modified)"
    assert shown == pytest.approx(9.0, rel=0.005)
    assert facts["typed prints"]["typical_depth_m"] == pytest.approx(0.09, rel=0.02)


def test_clear_bake_leaves_nothing_switched_on(facts):
    assert facts["cleared"]["deepest"] == 0.0
    assert facts["cleared"]["layers"] == []
    assert facts["cleared"]["action"]
    assert not facts["cleared"]["grounding"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
