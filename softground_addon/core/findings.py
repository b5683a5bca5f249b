"""Findings: faults of a bake or of what it was given, and what to do about them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from .errors import joined

Severity = Literal["error", "warning", "note"]
"""Prints are wrong; prints may be wrong; prints are right, and something else is worth knowing. Worst first."""

_ORDER: tuple[Severity, ...] = ("error", "warning", "note")


@dataclass(frozen=True)
class Finding:
    """One of them.

    Attributes
    ----------
    code : str
        For scripts; docs/troubleshooting.md lists them.
    severity : 'error', 'warning' or 'note'
    message : str
        What is wrong.
    remedy : str
        What to do; of those of the core, in words of no panel.
    facts : mapping
        What it is about, for programs, in SI units.
    """

    code: str
    severity: Severity
    message: str
    remedy: str
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """Both, for people.

        Examples
        --------
        >>> Finding("code", "note", "It is small", "make it larger.").text
        'It is small: make it larger.'
        """
        return joined(self.message, self.remedy)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def listed(names: Iterable[str], most: int = 3) -> str:
    """Names in quotation marks, the first few of them where they are more.

    Examples
    --------
    >>> listed(["a", "b"]), listed("abcde")
    ("'a', 'b'", "'a', 'b', 'c' and 2 more")
    """
    quoted = [f"'{name}'" for name in names]
    return ", ".join(quoted[:most]) + (f" and {len(quoted) - most} more" if len(quoted) > most else "")


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """The worst first, those that are as bad in the order given."""
    return sorted(findings, key=lambda finding: _ORDER.index(finding.severity))
