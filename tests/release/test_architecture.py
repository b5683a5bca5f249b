"""The picture of the architecture is drawn from the contracts as they are, and shows everything that they name."""

import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

from release import architecture

ROOT = Path(__file__).parents[2]
CONTRACTS = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
SVG = "{http://www.w3.org/2000/svg}"


def boxes(svg):
    """Title and (left, top, right, bottom) of each box, in the order in which they are drawn."""
    root = ElementTree.fromstring(svg)
    corners = [[float(box.get(key)) for key in ("x", "y", "width", "height")] for box in root.iter(f"{SVG}rect")]
    titles = [text.text.split(" (")[0] for text in root.iter(f"{SVG}text")]
    return list(zip(titles, [(x, y, x + w, y + h) for x, y, w, h in corners[1:]], strict=False))  # after the background


def test_it_is_up_to_date():
    drawn = (ROOT / "docs/images/architecture.svg").read_text(encoding="utf-8")
    assert drawn == architecture.picture(CONTRACTS), "run `make architecture`"


def test_every_layer_of_every_contract_has_its_box_above_those_that_it_imports():
    drawn = boxes(architecture.picture(CONTRACTS))
    for contract in tomllib.loads(CONTRACTS)["tool"]["importlinter"]["contracts"]:
        if contract["type"] != "layers":
            continue
        container = contract.get("containers", ["imports go down"])[0].rpartition(".")[2]
        x, y, right, bottom = next(corners for title, corners in drawn if title == container)
        above = y
        for layer in contract["layers"]:
            names = [name.strip() for name in layer.split("|")]
            inside = [
                corners
                for title, corners in drawn
                if title in names and x < corners[0] and right > corners[2] and above < corners[1] < bottom
            ]
            assert len(inside) >= len(names), layer
            tops = [top for _, top, _, _ in inside]
            above = min(tops)


def test_no_text_is_wider_than_its_box_and_development_md_shows_it():
    for title, (x, _, right, _) in boxes(architecture.picture(CONTRACTS)):
        assert len(title) * architecture.LETTER <= right - x, title
    page = (ROOT / "docs/development.md").read_text(encoding="utf-8")
    assert re.search(r"!\[.+\]\(images/architecture\.svg\)", page)
