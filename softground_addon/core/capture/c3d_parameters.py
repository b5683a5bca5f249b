"""The parameters of a C3D file, as texts and numbers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..numerics.arrays import Array

_LONGEST_LABEL_LIST = 256
"""Parameters `LABELS2`, `LABELS3`, ... that go on where one list of 255 names is full."""


@dataclass
class Parameters:
    """The parameters of a C3D file, by group and name in capitals; each is a list of texts or an array."""

    values: dict[tuple[str, str], Any] = field(default_factory=dict)

    def texts(self, group: str, name: str) -> list[str]:
        """All texts of a parameter, with those of the ones that continue it."""
        names = [name, *(f"{name}{number}" for number in range(2, _LONGEST_LABEL_LIST))]
        values = (self.values.get((group, each), []) for each in names)
        return [text for value in values if isinstance(value, list) for text in value]

    def text(self, group: str, name: str, missing: str = "") -> str:
        """The first text of a parameter."""
        return next(iter(self.texts(group, name)), missing)

    def array(self, group: str, name: str) -> Array:
        """Numbers of a parameter in Fortran's order, as the manual writes them; empty where there is none."""
        value = self.values.get((group, name))
        return value if isinstance(value, np.ndarray) else np.zeros(0)

    def number(self, group: str, name: str, missing: float = 0.0) -> float:
        """The first number of a parameter."""
        values = self.array(group, name)
        return float(values.flat[0]) if values.size else missing
