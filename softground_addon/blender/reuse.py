"""Results of a bake that the next bake takes over where their inputs are equal.

All inputs are read anew each time and compared by value: who has changed keys, rigs, meshes or settings makes no
difference. No count of Blender's updates can tell that a shot is the same: what changes before `frame_set` does not
reach `depsgraph_update_post`, an update of hidden objects names none, and functions of drivers cause none.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import Any, TypeVar

import numpy as np

from ..core.files.report import hash_inputs
from ..core.numerics.packed import PackedArray
from .jobs import meanwhile
from .state import state

Result = TypeVar("Result")
State = TypeVar("State")

LARGEST = 2**26
"""Largest memory for the results of each kind [bytes]; the prints of a minute of walking take half of it."""


def forget() -> None:
    """Give back the memory: the next bake works out everything."""
    state.results.clear()


def reused(
    progress: State, kind: str, inputs: object, work: Generator[State, None, Result], *, of: str | None = ""
) -> Generator[State, None, Result]:
    """The last result of a kind if its inputs were equal, otherwise that of the work.

    Parameters
    ----------
    progress : State
        Yielded while the inputs are compared.
    inputs : object
        All that the result depends on; `hash_inputs` compares it.
    work : generator
        Not begun where a result is taken over.
    of : str or None
        Name of one of several of a kind, of which each has its last result; None where all that have equal inputs share
        one, which is small.
    """
    compared = yield from meanwhile(progress, hash_inputs.slices(inputs))
    of = compared if of is None else of
    if last := state.results.get((kind, of)):
        if last[0] == compared:
            result: Result = last[1]
            return result
        del last, state.results[kind, of]  # memory for the next
    result = yield from work
    size = _size(result)
    if size + sum(each[2] for key, each in state.results.items() if key[0] == kind) <= LARGEST:
        state.results[kind, of] = compared, result, size
    return result


def _size(*values: Any) -> int:
    """Approximate memory of values [bytes], of those that are too large at least; what they share counts once."""
    waiting, seen, size = list(values), set[int](), 0
    while waiting and size <= LARGEST:
        value = waiting.pop()
        if id(value) in seen or isinstance(value, type):
            continue
        seen.add(id(value))
        size += value.nbytes if isinstance(value, np.ndarray | PackedArray) else 50
        waiting += value.values() if isinstance(value, Mapping) else getattr(value, "__dict__", {}).values()
        waiting += value if isinstance(value, list | tuple) else ()
    return size
