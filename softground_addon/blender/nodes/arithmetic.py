"""Arithmetic with outputs of nodes, of groups and materials alike: a law for arrays is one for these as well."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Self

import numpy as np


class Arithmetic:
    """An output of a node, with arithmetic and Numpy's functions as nodes."""

    def calculated(self, operation: str, first: Any, second: Any) -> Self:
        """The output of a math node of two outputs or numbers."""
        raise NotImplementedError

    def __add__(self, other: Self | float) -> Self:
        return self.calculated("ADD", self, other)

    def __sub__(self, other: Self | float) -> Self:
        return self.calculated("SUBTRACT", self, other)

    def __mul__(self, other: Self | float) -> Self:
        return self.calculated("MULTIPLY", self, other)

    def __truediv__(self, other: Self | float) -> Self:
        return self.calculated("DIVIDE", self, other)

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: float) -> Self:
        return self.calculated("SUBTRACT", other, self)

    def __array_ufunc__(self, function: np.ufunc, _method: str, *operands: Any) -> Self:
        return _FUNCTIONS[function](self, *operands)

    def above(self, other: Self | float) -> Self:
        """1 where it is more than another, else 0."""
        return self.calculated("GREATER_THAN", self, other)

    def at_least(self, other: Self | float) -> Self:
        """The larger of two."""
        return self.calculated("MAXIMUM", self, other)

    def at_most(self, other: Self | float) -> Self:
        """The smaller of two."""
        return self.calculated("MINIMUM", self, other)

    def exp(self) -> Self:
        return self.calculated("EXPONENT", self, 0.0)

    def log(self) -> Self:
        return self.calculated("LOGARITHM", self, math.e)

    def root(self) -> Self:
        return self.calculated("SQRT", self, 0.0)

    def arccos(self) -> Self:
        return self.calculated("ARCCOSINE", self, 0.0)

    def sine(self) -> Self:
        return self.calculated("SINE", self, 0.0)

    def floor(self) -> Self:
        return self.calculated("FLOOR", self, 0.0)

    def fraction(self) -> Self:
        return self.calculated("FRACT", self, 0.0)


def _of_two(operation: str) -> Callable[..., Any]:
    return lambda by, first, second: by.calculated(operation, first, second)


_FUNCTIONS: Mapping[np.ufunc, Callable[..., Any]] = {
    np.add: _of_two("ADD"),
    np.subtract: _of_two("SUBTRACT"),
    np.multiply: _of_two("MULTIPLY"),
    np.divide: _of_two("DIVIDE"),
    np.minimum: _of_two("MINIMUM"),
    np.maximum: _of_two("MAXIMUM"),
    np.greater: _of_two("GREATER_THAN"),
    np.exp: lambda _, value: value.exp(),
    np.expm1: lambda _, value: value.exp() - 1.0,
    np.log1p: lambda _, value: (value + 1.0).log(),
    np.sqrt: lambda _, value: value.root(),
    np.sin: lambda _, value: value.sine(),
    np.arccos: lambda _, value: value.arccos(),
}
