"""The table of what benchmarks have measured."""

import pytest

from tests.benchmarks import bars


def test_a_value_stands_beside_its_bar_and_one_beyond_it_fails(monkeypatch):
    monkeypatch.setattr(bars, "ROWS", [])
    bars.below("an edit", 20.04, 30, "ms")
    bars.below("a frame", 1.5)
    with pytest.raises(AssertionError, match="a file: 172 KB, bar 150"):
        bars.below("a file", 172.4, 150, "KB")
    assert bars.table() == [
        "         measured        bar",
        "an edit        20         30 ms",
        "a frame       1.5          - times",
        "a file        172        150 KB   MISSED",
    ]
