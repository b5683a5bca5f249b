"""What prints is chosen by hand where nothing is found, in a real Blender."""

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("no_feet")


def test_a_rig_without_feet_is_added_with_an_empty_list(facts):
    assert facts["soles"] == 0


def test_a_bone_is_chosen_by_name_or_from_the_selection(facts):
    assert facts["waits for a bone"] == [""]
    assert facts["from the selection"] == ["Bone"]
