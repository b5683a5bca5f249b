"""The map in docs/development.md shows every module, in the row of its folder, and none that is not there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HALVES = {half: ROOT / "softground_addon" / half for half in ("core", "batch", "blender")}
FOLDERS = [
    (half, path.parent.name)
    for half, root in HALVES.items()
    for path in sorted(root.glob("*/__init__.py"))
    if path.parent.name != "properties"
]


def modules(folder):
    """Names of the modules in a folder, without those in folders below it."""
    return {path.stem for path in folder.glob("*.py")} - {"__init__"}


def section(name):
    text = (ROOT / "docs/development.md").read_text(encoding="utf-8")
    return re.search(rf"^### {name}\b.*?(?=^##)", text, re.MULTILINE | re.DOTALL)[0]


def shown(text):
    return sorted(re.findall(r"`(\w+)`", text))


@pytest.mark.parametrize("half", HALVES)
def test_the_map_has_a_row_for_each_folder(half):
    rows = re.findall(r"^\| `(\w+)/`", section(half), re.MULTILINE)
    assert sorted(rows) == [folder for of, folder in FOLDERS if of == half]


@pytest.mark.parametrize(("half", "folder"), FOLDERS)
def test_the_row_of_a_folder_shows_its_modules(half, folder):
    (row,) = re.findall(rf"^\| `{folder}/`.*", section(half), re.MULTILINE)
    assert shown(row) == sorted(modules(HALVES[half] / folder))


@pytest.mark.parametrize(("half", "folders"), [("core", set()), ("batch", set()), ("blender", {"properties"})])
def test_the_first_row_shows_what_is_in_no_folder(half, folders):
    (row,) = re.findall(rf"^\| `softground_addon/{half}` itself.*", section(half), re.MULTILINE)
    assert shown(row) == sorted(modules(HALVES[half]) | folders)


@pytest.mark.parametrize(("half", "folder"), FOLDERS)
def test_a_folder_says_what_it_is_for(half, folder):
    assert (HALVES[half] / folder / "__init__.py").read_text(encoding="utf-8").startswith('"""')


def test_stories_ask_for_modules_that_are_there():
    """Real Blenders name the add-on otherwise, so that stories import its modules by their names."""
    stories = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests/gui").rglob("*.py"))
    names = set(re.findall(r'\bmodule\("([\w.]+)"\)', stories))
    assert names
    for name in names:
        assert (HALVES["blender"] / f"{name.replace('.', '/')}.py").is_file(), name
