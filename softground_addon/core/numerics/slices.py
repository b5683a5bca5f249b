"""Long computations in slices: generators that yield wherever they can pause, and return their result.

Whoever has nothing else to do calls them like any other function.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import wraps
from typing import ParamSpec, Protocol, TypeVar, cast

import numpy as np

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")
Result_co = TypeVar("Result_co", covariant=True)

Slices = Generator[None, None, Result]
"""The rest of a computation: yields nothing between two slices and returns the result."""


class Sliced(Protocol[Parameters, Result_co]):
    """A function that gives its result at once, and whose `slices` gives it slice by slice."""

    def __call__(self, *args: Parameters.args, **kwargs: Parameters.kwargs) -> Result_co: ...

    def slices(self, *args: Parameters.args, **kwargs: Parameters.kwargs) -> Generator[None, None, Result_co]:
        """The computation, to be gone through slice by slice."""


def result_of(work: Generator[object, None, Result]) -> Result:
    """What a computation returns at its end, whatever it yields before."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            result: Result = end.value
            return result


def sliced(slices: Callable[Parameters, Slices[Result]]) -> Sliced[Parameters, Result]:
    """Make a function of a computation in slices.

    Examples
    --------
    >>> @sliced
    ... def total(values):
    ...     so_far = 0
    ...     for value in values:
    ...         so_far += value
    ...         yield
    ...     return so_far
    >>> total([1, 2, 3]), len(list(total.slices([1, 2, 3])))
    (6, 3)
    """

    @wraps(slices)
    def whole(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        return result_of(slices(*args, **kwargs))

    function = cast("Sliced[Parameters, Result]", whole)
    function.slices = slices  # type: ignore[method-assign]
    return function


def without_warnings(work: Slices[Result]) -> Slices[Result]:
    """The same slices, in which NumPy does not warn of numbers that are none; between them it does."""
    while True:
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            try:
                next(work)
            except StopIteration as end:
                return cast("Result", end.value)
        yield
