"""What can be had without the panel: Blender's own menus, the search, pictures in the preset menu, and force curves."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]

MENU = 0.02
"""Longest that the preset menu may take to open [s]."""


@pytest.fixture
def facts(tell):
    return tell("menus")


def test_the_preset_menu_shows_a_picture_of_each_ground_and_opens_at_once(facts):
    assert facts["pictures"]
    assert all(facts["pictures"].values())
    assert min(facts["preset menu"]) < MENU


def test_a_ground_of_ones_own_gets_its_prediction_at_once(facts):
    assert 0.5 < facts["predicted"] < 50.0


def test_the_object_menu_bakes(facts):
    assert facts["ground"] == "Terrain"
    assert facts["baked"]


def test_apply_look_goes_over_the_users_material_and_only_when_asked(facts):
    assert facts["before Apply Look"] == ["Meadow"]
    assert facts["after Apply Look"] == ["Meadow with Snow Prints"]
    assert facts["their material"] == facts["cleared"][0] == ["Meadow"]


def test_the_graph_editor_shows_the_force_curves(facts):
    assert len([path for path in facts["curves"] if " force" in path]) == 2


def test_the_add_menu_has_the_sample_figure(facts):
    assert facts["added"] == ["Walking Figure"]


def test_the_preferences_open_the_manual_that_came_with_the_add_on(facts):
    (address,) = facts["manual"]
    assert address.startswith("file:///")
    assert address.endswith("/softground/manual/index.html")


def test_the_preferences_copy_what_a_bug_report_needs(facts):
    for word in ("SoftGround", "Blender", "Mesa", "Terrain"):
        assert word in facts["bug report"]


def test_clear_bake_leaves_nothing(facts):
    assert facts["cleared"] == [["Meadow"], []]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
