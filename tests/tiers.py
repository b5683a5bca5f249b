"""Which tier of the tests a case belongs to."""

from collections.abc import Iterable
from typing import Any

import pytest


def slow_but_one(cases: Iterable[Any]) -> list[Any]:
    """Parameters of a test: the first case is quick, the others are in the slow tier. A tuple is several parameters."""
    first, *others = (case if isinstance(case, tuple) else (case,) for case in cases)
    return [pytest.param(*first), *(pytest.param(*case, marks=pytest.mark.slow) for case in others)]
