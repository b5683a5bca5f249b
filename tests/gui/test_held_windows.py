"""While a bake runs, neither another add-on's sidebar nor a second window changes the scene."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(600)]


@pytest.fixture
def facts(tell):
    return tell("held_windows")


def test_the_sidebar_of_others_changes_nothing_while_it_bakes(facts):
    assert not facts["Item while it bakes: moved"]
    assert facts["still bakes"]
    assert facts["Item after it: moved"]


def test_a_second_window_changes_nothing_while_it_bakes(facts):
    assert not facts["second window while it bakes: selected"]
    assert facts["second window after it: selected"]


def test_a_bake_is_cancelled_from_a_second_window_too(facts):
    assert facts["cancelled from the second window"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
