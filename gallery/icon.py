"""The icon of the extensions platform: a print in snow, 256 pixels wide.

python -m gallery.icon
"""

from __future__ import annotations

import shutil
from pathlib import Path

from gallery.preset_pictures import prints

TARGET = Path(__file__).parents[1] / "docs" / "images" / "icon.png"
SIZE = 256
"""As the platform wants it [px]."""


def main() -> None:
    """Put the picture of the preset menu, larger, where docs/publishing.md shows it."""
    for _, rendered in prints(["Snow"], SIZE):
        shutil.copyfile(rendered, TARGET)


if __name__ == "__main__":
    main()
