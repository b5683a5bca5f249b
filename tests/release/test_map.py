"""The map in docs/development.md shows every module, and none that is not there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def modules(package):
    """Names of the modules and packages of a part of the add-on."""
    folder = ROOT / "softground_addon" / package
    names = {path.stem for path in folder.glob("*.py")} | {path.parent.name for path in folder.glob("*/__init__.py")}
    return names - {"__init__"}


@pytest.mark.parametrize("package", ["core", "blender"])
def test_every_module_is_on_the_map_once(package):
    text = (ROOT / "docs/development.md").read_text(encoding="utf-8")
    section = re.search(rf"^### {package}\b.*?(?=^##)", text, re.MULTILINE | re.DOTALL)
    shown = re.findall(r"`(\w+)`", section[0])
    assert sorted(shown) == sorted(modules(package))
