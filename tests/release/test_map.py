"""The map in docs/development.md shows every module, in the row of its folder, and none that is not there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLENDER = ROOT / "softground_addon/blender"
FOLDERS = sorted(path.parent.name for path in BLENDER.glob("*/__init__.py") if path.parent.name != "properties")


def modules(folder):
    """Names of the modules in a folder, without those in folders below it."""
    return {path.stem for path in folder.glob("*.py")} - {"__init__"}


def section(name):
    text = (ROOT / "docs/development.md").read_text(encoding="utf-8")
    return re.search(rf"^### {name}\b.*?(?=^##)", text, re.MULTILINE | re.DOTALL)[0]


def shown(text):
    return sorted(re.findall(r"`(\w+)`", text))


def test_every_module_of_the_core_is_on_the_map_once():
    assert shown(section("core")) == sorted(modules(ROOT / "softground_addon/core"))


def test_the_map_has_a_row_for_each_folder():
    assert sorted(re.findall(r"^\| `(\w+)/`", section("blender"), re.MULTILINE)) == FOLDERS


@pytest.mark.parametrize("folder", FOLDERS)
def test_the_row_of_a_folder_shows_its_modules(folder):
    (row,) = re.findall(rf"^\| `{folder}/`.*", section("blender"), re.MULTILINE)
    assert shown(row) == sorted(modules(BLENDER / folder))


def test_the_first_row_shows_what_is_in_no_folder():
    (row,) = re.findall(r"^\| `softground_addon/blender` itself.*", section("blender"), re.MULTILINE)
    assert shown(row) == sorted({*modules(BLENDER), "properties"})


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_folder_says_what_it_is_for(folder):
    assert (BLENDER / folder / "__init__.py").read_text(encoding="utf-8").startswith('"""')
