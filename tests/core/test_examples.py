"""The examples in the docstrings of the core hold."""

import doctest
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from softground_addon import core

CORE = Path(core.__file__).parent
SHOWN = sorted(
    ".".join(path.relative_to(CORE).with_suffix("").parts)
    for path in CORE.rglob("*.py")
    if ">>> " in path.read_text("utf-8")
)


@pytest.mark.parametrize("name", SHOWN)
def test_they_hold(name):
    with np.printoptions(legacy="1.21"):  # numpy 2 shows its numbers as np.float64(0.25)
        result = doctest.testmod(import_module(f"softground_addon.core.{name}"))
    assert result.attempted > 0
    assert result.failed == 0
