"""The file browsers of the exports in a real Blender."""

from pathlib import Path

import pytest

pytestmark = [pytest.mark.gui, pytest.mark.timeout(900)]


@pytest.fixture
def facts(tell):
    return tell("export_files")


def test_a_file_beside_the_shot_is_proposed(facts):
    folder, name = facts["proposed"]
    assert Path(folder) == Path(facts["shot"]).parent
    assert name == "My Shot_SoftGround.pc2"
    assert facts["forces"][1] == "My Shot_forces.csv"


def test_a_shot_that_was_not_saved_yet_has_a_name_proposed_too(facts):
    for proposed, name in (("unsaved", "untitled_SoftGround.pc2"), ("unsaved forces", "untitled_forces.csv")):
        assert Path(facts[proposed][0]).is_absolute()
        assert facts[proposed][1] == name


def test_the_name_follows_the_format_and_what_blender_was_built_without_cannot_be_chosen(facts):
    assert facts["chosen"] == {
        "ALEMBIC": ["PC2", "My Shot_SoftGround.pc2"],
        "USD": ["PC2", "My Shot_SoftGround.pc2"],
        "PC2": ["PC2", "My Shot_SoftGround.pc2"],
        "EXR": ["EXR", "My Shot_SoftGround.exr"],
        "OBJ": ["OBJ", "My Shot_SoftGround.obj"],
    }


def test_return_writes_the_file(facts):
    assert facts["obj"] == ["My Shot.blend", "My Shot_SoftGround.obj"]
    assert facts["written"] == ["My Shot.blend", "My Shot_SoftGround.obj", "My Shot_forces.csv"]


def test_nothing_goes_wrong_on_the_console(facts):
    assert "softground_addon" not in facts["printed"]  # as in the lines of a traceback
