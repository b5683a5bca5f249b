"""All panels, drawn by a real Blender; those of objects where Blender has them."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(900)]


@pytest.fixture
def facts(tell):
    return tell("every_panel")


def test_each_panel_is_drawn(facts):
    assert len(facts["panels"]) == 13


def test_a_button_opens_the_physics_of_character_and_ground(facts):
    (_, of_feet, walker), (_, of_prints, ground) = facts["opened"]
    assert (of_feet, of_prints) == ("PHYSICS", "PHYSICS")
    assert walker == "Walker"
    assert ground != walker


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
