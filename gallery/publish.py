"""`make gallery`: puts what was built where the project shows it.

The pictures of the pages of docs go to docs/images, the .blend files that are small to sample_scenes.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from PIL import Image

from sample_scenes.make_all import SCENES
from sample_scenes.production import OUTPUT

ROOT = Path(__file__).parents[1]

PAGES = ("gallery.md", "figures.md", "ground.md", "after.md")

LARGEST = 2_000_000
"""A .blend file larger than this stays out of the repository [bytes]."""


def publish(built: Path, root: Path) -> list[Path]:
    """Copy pictures and small scenes into a project; returns what was written.

    Parameters
    ----------
    built : Path
        Folder into which the scenes were built.
    root : Path
        The project, with these pages and sample_scenes.
    """
    pages = "".join((root / "docs" / page).read_text(encoding="utf-8") for page in PAGES)
    pictures = [built / name for name in re.findall(r"\(images/([\w.]+)\)", pages)]
    blends = [built / f"{name}.blend" for name in SCENES]
    copies = [(picture, root / "docs" / "images") for picture in pictures if picture.is_file()]
    copies += [
        (blend, root / "sample_scenes") for blend in blends if blend.is_file() and blend.stat().st_size <= LARGEST
    ]
    return [_put(source, folder / source.name) for source, folder in copies]


def _put(source: Path, target: Path) -> Path:
    """Copy a file; plots have 256 colours then, a third of their bytes."""
    if source.suffix != ".png":
        return Path(shutil.copyfile(source, target))
    with Image.open(source) as plot:
        plot.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)
    return target


if __name__ == "__main__":
    for path in publish(OUTPUT, ROOT):
        print(path.relative_to(ROOT))
