"""Steps of a bake, chosen, muted and dragged by real clicks."""

import pytest

from tests.pace import at_pace

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("edit_steps")


def test_a_click_in_the_list_chooses_a_step_and_goes_to_its_frame(facts):
    assert facts["chosen"].startswith("Walker/foot.")
    shown, wanted = facts["frame"]
    assert shown == wanted
    assert facts["off centre"] < 1e-3


def test_mute_is_one_undo_step(facts):
    assert facts["muted"] == facts["redone"] == {facts["chosen"]: [True, 0.0, 0.0]}
    assert facts["undone"] == [{}, []]


def test_a_print_is_dragged_in_the_viewport(facts):
    assert facts["under the mouse"]
    took = facts["seconds an update"]
    assert took[len(took) // 2] < at_pace(0.1)
    ((_, (mute, _, along_y)),) = facts["dragged"].items()
    assert not mute
    assert along_y == pytest.approx(0.3, abs=0.02)


def test_escape_leaves_everything_as_it_was(facts):
    assert facts["escaped"] == [{}, []]


def test_the_drag_is_one_undo_step_and_lasts(facts):
    assert facts["dragged undone"] == [{}, []]
    assert facts["dragged redone"] == [facts["dragged"], True]
    assert facts["reloaded"] == [facts["dragged"], True]
    assert facts["baked again"] == facts["dragged"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback


def test_a_box_chooses_the_steps_in_it_and_they_are_dragged_together(facts):
    chosen, wanted = facts["boxed"]
    assert chosen == wanted
    first, other = facts["dragged together"]
    assert first == pytest.approx(0.2, abs=0.02)
    assert other == pytest.approx(first, abs=1e-5)


def test_a_mesh_presses_a_step_until_that_is_undone(facts):
    before, shod = facts["in a shoe"]
    assert shod == pytest.approx(0.2 * 0.4, rel=0.15)
    assert facts["without the shoe"] == before


def test_what_a_dialog_changes_of_a_step_is_pressed_as_a_job(facts):
    assert facts["changed in a dialog"] != facts["chosen in a dialog"]
