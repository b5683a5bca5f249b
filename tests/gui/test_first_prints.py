"""The prints of the first steps are on the screen while a bake goes on, and one may look around and leave it."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("first_prints")


def test_the_first_prints_are_seen_long_before_the_bake_ends(facts):
    print(f"first print after {facts['seconds to the first print']:.1f} s of {facts['seconds in all']:.1f} s")
    assert facts["first: baking"]
    assert 1 <= facts["first: prints"] < facts["steps"] / 2
    assert facts["seconds to the first print"] < facts["seconds in all"] / 2
    assert facts["last: shown"] == 0


def test_one_may_look_around_and_leave_it(facts):
    assert facts["turned"]
    assert facts["left: shown"] == 0
    assert facts["left: as before"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
    assert "Error" not in facts["printed"].replace("ModuleNotFoundError: No module named 'cattrs'", "")  # Debian's own
