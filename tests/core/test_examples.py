"""The examples in the docstrings of the core hold."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

from softground_addon import core

SHOWN = sorted(path.stem for path in Path(core.__file__).parent.glob("*.py") if ">>> " in path.read_text("utf-8"))


@pytest.mark.parametrize("name", SHOWN)
def test_they_hold(name):
    result = doctest.testmod(import_module(f"softground_addon.core.{name}"))
    assert result.attempted > 0
    assert result.failed == 0
