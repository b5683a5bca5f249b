"""The page of the physics: the code cites sections that it has, and it names modules that there are."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
CORE = ROOT / "softground_addon" / "core"
PAGE = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
SOURCES = {
    path.relative_to(ROOT): path.read_text(encoding="utf-8") for path in (ROOT / "softground_addon").rglob("*.py")
}


def test_the_code_cites_sections_and_corrections_of_the_page():
    sections = set(re.findall(r"^## (\d)\. ", PAGE, re.MULTILINE))
    cited = {(path, number) for path, text in SOURCES.items() for number in re.findall(r"model\.md section (\d)", text)}
    assert len(cited) > 5
    assert {number for _, number in cited} <= sections


def test_no_page_outside_the_repository_is_cited():
    """Pages are docs/NAME.md or stand at the root."""
    for path, text in SOURCES.items():
        for page in re.findall(r"[\w/]+\.md\b", text):
            assert (ROOT / page).is_file(), (path, page)


def test_the_page_names_modules_of_the_core():
    section, named = "", []
    for line in PAGE.splitlines():
        section = line if line.startswith("## ") else section
        folder = CORE / "skin" if "skin" in section else CORE
        named += [folder / name for name in re.findall(r"`(?:skin/)?([\w/]+\.py)`", line)]
    assert len(named) > 15
    assert [path for path in named if not path.is_file()] == []
