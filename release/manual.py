"""The manual in the package: the pages of docs/ for artists, as HTML that a browser shows without a network."""

from __future__ import annotations

import html
import io
import posixpath
import re
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token
from PIL import Image

FOLDER = "manual"
"""Where the pages are in the package."""

WIDEST = 1200
"""Width of pictures on pages [px]: half as much again as that of the text."""

_QUALITY = 82
"""Quality of those that were wider, as JPEG [%]."""

_NOT_IN_IT = {"development", "gallery", "library", "publishing"}
"""Pages for those who make the add-on or work without Blender, and one that is only pictures."""

_FIRST = "docs/shots.md"
"""Page that the manual opens with."""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
body {{ max-width: 52rem; margin: 2rem auto; padding: 0 1rem; font: 1rem/1.5 sans-serif; }}
img {{ max-width: 100%; }}
table {{ border-collapse: collapse; }}
td, th {{ border: 1px solid #ccc; padding: .3rem .6rem; text-align: left; vertical-align: top; }}
pre {{ overflow-x: auto; padding: .6rem; background: #f3f3f3; }}
code {{ background: #f3f3f3; }}
</style>
</head>
<body>
<nav>{contents}</nav>
{text}</body>
</html>
"""


def files(sources: Path) -> dict[str, bytes]:
    """Pages and the pictures on them, by their names in the package; the first is that of the shots."""
    docs = sources / "docs"
    paths = [path for path in sorted(docs.glob("*.md")) if path.stem not in _NOT_IN_IT]
    above = {path.relative_to(sources).as_posix(): path.stem + ".html" for path in paths} | {_FIRST: "index.html"}
    shots = sorted((docs / "shots").glob("*.md"))
    pages = above | {path.relative_to(sources).as_posix(): f"shots_{path.stem}.html" for path in shots}
    texts = {source: (sources / source).read_text(encoding="utf-8") for source in pages}
    titles = {page: texts[source].splitlines()[0].lstrip("# ") for source, page in pages.items()}
    order = sorted(above.values(), key=lambda page: (page != "index.html", titles[page]))
    contents = " · ".join(f'<a href="{page}">{html.escape(titles[page].split(":")[0])}</a>' for page in order)
    built: dict[str, bytes] = {}
    for source, page in pages.items():
        parser = MarkdownIt("commonmark").enable("table")
        tokens = parser.parse(texts[source])
        built |= _follow_links(tokens, source, pages, sources)
        text = parser.renderer.render(tokens, parser.options, {})
        whole = _PAGE.format(title=html.escape(titles[page]), contents=contents, text=text)
        built[f"{FOLDER}/{page}"] = whole.encode()
    return built


def anchor(heading: str) -> str:
    """What a link to a heading says after its `#`, as on GitHub."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _follow_links(tokens: list[Token], source: str, pages: dict[str, str], sources: Path) -> dict[str, bytes]:
    """Let links lead to pages and pictures of the manual, and make those elsewhere in the sources plain text; returns
    the pictures, by their names in the package."""
    pictures: dict[str, bytes] = {}
    for number, token in enumerate(tokens):
        if token.type == "heading_open":
            token.attrSet("id", anchor(tokens[number + 1].content))
        opened: list[bool] = []
        for child in token.children or ():
            if child.type == "image":
                name, picture = _fitting(sources / _path(source, str(child.attrs["src"])))
                pictures[f"{FOLDER}/images/{name}"] = picture
                child.attrSet("src", f"images/{name}")
            elif child.type == "link_open":
                opened.append(_follow(child, source, pages))
            if child.type in ("link_open", "link_close"):
                child.hidden = not opened[-1]
            if child.type == "link_close":
                opened.pop()
        if token.children:
            token.children = [child for child in token.children if not child.hidden]
    return pictures


def _fitting(path: Path) -> tuple[str, bytes]:
    """Name and content of a picture as pages show it: what is wider is a smaller JPEG, unless that has more bytes."""
    whole = path.read_bytes()
    if path.suffix not in (".png", ".jpg"):
        return path.name, whole
    with Image.open(path) as image:
        if image.mode not in ("RGB", "P") or image.width <= WIDEST:
            return path.name, whole
        shown = image.convert("RGB")
    shown.thumbnail((WIDEST, shown.height), Image.Resampling.LANCZOS)
    smaller = io.BytesIO()
    shown.save(smaller, "JPEG", quality=_QUALITY, optimize=True, progressive=True)
    return (f"{path.stem}.jpg", smaller.getvalue()) if smaller.tell() < len(whole) else (path.name, whole)


def _follow(link: Token, source: str, pages: dict[str, str]) -> bool:
    """Let a link lead to where it leads in the manual; False if it leads nowhere there."""
    target, *section = str(link.attrs["href"]).split("#")
    if "://" in target or not target:
        return True
    page = pages.get(_path(source, target))
    if page:
        link.attrSet("href", "#".join([page, *section]))
    return page is not None


def _path(source: str, target: str) -> str:
    """The path in the sources that a link on a page names."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
