"""The moving picture of Blender's window shows: prints that appear as it plays, and deepen as a field is dragged."""

import pytest
from PIL import Image

from tests.gui.conftest import OUTPUT, WINDOWS

pytestmark = [pytest.mark.film, pytest.mark.timeout(1500)]


@pytest.fixture
def facts(tell):
    return tell("filmed")


def test_every_frame_is_there_as_it_played(facts):
    played = [moment for part, moment, *_ in facts["pictures"] if part == "played"]
    assert played == list(range(played[0], played[-1] + 1))
    assert len(played) >= 70


def test_the_field_is_dragged_there_and_part_of_the_way_back(facts):
    depths = facts["depths"]
    assert max(depths) > 1.5 * depths[0]
    assert depths[0] < depths[-1] < max(depths)


def test_prints_deepen_meanwhile(facts):
    assert facts["deepest"][1] < 1.5 * facts["deepest"][0] < 0


def test_pictures_are_of_the_window(facts, suite):
    part, moment, *_ = facts["pictures"][-1]
    with Image.open(OUTPUT / suite / "filmed" / f"{part}_{moment:03d}.png") as picture:
        assert picture.size == WINDOWS["filmed"]
