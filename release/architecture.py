"""`make architecture`: the import contracts of pyproject.toml as a picture, for docs/development.md.

A package is a box with its layers as rows. Each row imports only from those below it, and what stands side by side in
a row knows nothing of each other. A package whose layers a contract names is drawn with them inside.

    python -m release.architecture docs/images/architecture.svg
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).parents[1]

LINE, PAD, GAP, LETTER = 24, 8, 5, 6.9
"""Height of a line of text, room within a box and between boxes, width of a letter [px]."""
FILLS = ("#ffffff", "#f2efe9", "#e2e9ee", "#d3dde5", "#ffffff")
"""Of boxes, from the outermost to the innermost."""


@dataclass(frozen=True)
class Box:
    """A package or module, and in it rows of others, from the highest layer to the lowest."""

    title: str
    rows: Sequence[Sequence[Box]] = ()

    @property
    def width(self) -> int:
        """Least width, in whole numbers, whose sums are the same in every Python [px]."""
        rows = [sum(box.width + GAP for box in row) - GAP for row in self.rows]
        return max(ceil(len(self.title) * LETTER), *rows, 0) + 2 * PAD

    @property
    def height(self) -> int:
        """Height [px]."""
        rows = [max(box.height for box in row) + GAP for row in self.rows]
        return LINE + (sum(rows) + PAD - GAP if rows else 0)

    def drawn(self, x: float, y: float, width: float, depth: int = 0, height: float | None = None) -> list[str]:
        """Elements of an SVG; a row shares what it has of room among its boxes."""
        tall = height or self.height
        text_y = y + (LINE if self.rows else tall) / 2 + 4
        weight = ' font-weight="bold"' if self.rows else ""
        elements = [
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{tall:.1f}" rx="4" fill="{FILLS[depth]}"/>',
            f'<text x="{x + width / 2:.1f}" y="{text_y:.1f}"{weight}>{escape(self.title)}</text>',
        ]
        y += LINE
        for row in self.rows:
            row_height = max(box.height for box in row)
            spare = (width - 2 * PAD - GAP * (len(row) - 1) - sum(box.width for box in row)) / len(row)
            start = x + PAD
            for box in row:
                elements += box.drawn(start, y, box.width + spare, depth + 1, row_height)
                start += box.width + spare + GAP
            y += row_height + GAP
        return elements


def packages(contracts: Sequence[Mapping[str, Any]]) -> dict[str, list[list[str]]]:
    """Full names of what is in each layer of each package; those of the topmost are of no package."""
    return {
        package: [
            [f"{package}.{name.strip()}".lstrip(".") for name in layer.split("|")] for layer in contract["layers"]
        ]
        for contract in contracts
        if contract["type"] == "layers"
        for package in contract.get("containers", [""])
    }


def box(name: str, layers: Mapping[str, list[list[str]]], barred: Mapping[str, list[str]]) -> Box:
    """A package with all that contracts say of its inside."""
    title = name.rpartition(".")[2]
    if name in barred:
        title += f" (without {', '.join(barred[name])})"
    return Box(title, [[box(inner, layers, barred) for inner in row] for row in layers.get(name, ())])


def picture(pyproject: str) -> str:
    """The SVG of the contracts in the text of a pyproject.toml."""
    contracts = tomllib.loads(pyproject)["tool"]["importlinter"]["contracts"]
    barred = {
        source: contract["forbidden_modules"]
        for contract in contracts
        if contract["type"] == "forbidden"
        for source in contract["source_modules"]
    }
    whole = Box("imports go down", box("", packages(contracts), barred).rows)
    others = [f"also: {contract['name']}" for contract in contracts if contract["type"] not in ("layers", "forbidden")]
    width, height = whole.width, whole.height
    elements = whole.drawn(0, 0, width)
    elements += [
        f'<text x="{width / 2:.1f}" y="{height + LINE * (number + 0.7):.1f}">{escape(line)}</text>'
        for number, line in enumerate(others)
    ]
    full = height + LINE * len(others)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-1 -1 {width + 2:.0f} {full + 2:.0f}" '
        f'font-family="sans-serif" font-size="12" text-anchor="middle">\n'
        f"<style>rect {{ stroke: #5d6b75; }} text {{ fill: #1c2429; }}</style>\n"
        f'<rect x="-1" y="-1" width="{width + 2:.0f}" height="{full + 2:.0f}" fill="#ffffff" stroke="none"/>\n'
        + "\n".join(elements)
        + "\n</svg>\n"
    )


if __name__ == "__main__":
    text = picture((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    Path(sys.argv[1]).write_text(text, encoding="utf-8", newline="\n")
