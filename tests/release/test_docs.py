"""Pages of the docs: links lead somewhere, and pages of shots name buttons, panels and presets as they are."""

import ast
import json
import re
from pathlib import Path

import pytest

from release.manual import anchor
from tests.release.test_platform_rules import TREES

ROOT = Path(__file__).parents[2]
SHOTS = sorted((ROOT / "docs" / "shots").glob("*.md"))
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *SHOTS]
NOT_NAMES = (
    "What goes wrong most often.",
    "The ground.",
    "The animation.",
    "The events.",
    "−",
    "+",
    "N",
    "Add",
    "Physics",
)
"""In bold, but a tab of Blender's, beginnings of paragraphs, signs and keys, or what a button says before a name."""


def text_of(page):
    """A page without its code."""
    return re.sub(r"^ *```.*?^ *```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


def targets(page):
    """Pages and sections that links on a page lead to, but for the web's."""
    links = re.findall(r"\]\(([^)\s]+)\)", text_of(page))
    for path, _, section in (link.partition("#") for link in links if "://" not in link):
        yield (page.parent / path).resolve() if path else page, section


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files_and_headings(page):
    for target, section in targets(page):
        assert target.exists(), target
        headings = re.findall(r"^#+ (.+)", target.read_text(encoding="utf-8"), re.MULTILINE) if section else ()
        assert not section or section in map(anchor, headings), (target.name, section)


@pytest.fixture(scope="module")
def names():
    """All words of the add-on's code, among them its labels, and the names of its presets."""
    words = {node.value for tree in TREES.values() for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    presets = (ROOT / "softground_addon" / "presets").glob("*.json")
    return words | {json.loads(path.read_text(encoding="utf-8"))["name"] for path in presets}


@pytest.mark.parametrize("page", SHOTS, ids=lambda page: page.stem)
def test_a_page_of_a_shot_names_buttons_and_panels_as_they_are(page, names):
    bold = " > ".join(re.findall(r"\*\*(.+?)\*\*", " ".join(text_of(page).split())))
    named = set(bold.split(" > ")) - set(NOT_NAMES)
    assert named
    assert named <= names


@pytest.mark.parametrize("page", SHOTS, ids=lambda page: page.stem)
def test_a_page_of_a_shot_is_short_and_leads_to_the_reference(page):
    assert len(page.read_text(encoding="utf-8").splitlines()) <= 35
    linked = [target for target, _ in targets(page)]
    assert sum(target.parent.name == "images" for target in linked) <= 3
    assert any(target.parent == ROOT / "docs" for target in linked)


def test_the_front_page_leads_to_every_shot_and_the_readme_to_it():
    front = ROOT / "docs" / "shots.md"
    assert {target for target, _ in targets(front)} >= set(SHOTS)
    first = next(target for target, _ in targets(ROOT / "README.md") if target.suffix == ".md")
    assert first == front
