"""All panels, drawn by a real Blender; those of objects where Blender has them."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(900)]


@pytest.fixture
def facts(tell):
    return tell("every_panel")


def test_each_panel_is_drawn(facts):
    assert len(facts["panels"]) == 13


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
