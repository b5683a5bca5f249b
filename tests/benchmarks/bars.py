"""Bars of the benchmarks, and the table of what was measured."""

from math import inf

ROWS: list[tuple[str, float, float, str]] = []
"""What was measured, its value, the most that it may be, and the unit of both."""


def note(what: str, value: float, most: float = inf, unit: str = "times") -> None:
    """Note a value in the table."""
    ROWS.append((what, float(value), float(most), unit))


def below(what: str, value: float, most: float = inf, unit: str = "times") -> None:
    """Note a value in the table; AssertionError where it is more than its bar, if it has one."""
    note(what, value, most, unit)
    assert value <= most, f"{what}: {value:.3g} {unit}, bar {most:.3g}"


def table() -> list[str]:
    """Lines of the table; those whose bars are missed say so."""
    width = max((len(what) for what, *_ in ROWS), default=0)
    lines = [f"{'':{width}}  measured        bar"]
    for what, value, most, unit in ROWS:
        missed = "" if value <= most else "   MISSED"
        lines.append(f"{what:{width}} {_number(value):>9} {_number(most):>10} {unit}{missed}")
    return lines


def _number(value: float) -> str:
    return "-" if value == inf else f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
