"""What follows from values alone, as it was worked out last: no bake works out twice what has not changed.

All is read anew each time, and compared by value: keys, rigs, meshes and settings that have changed give something
else, whoever has changed them.
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
"""Most that is held of each kind for the next bake [bytes]: prints of a minute of walking take half of it."""


def forget() -> None:
    """Work out all anew, and give back what is held."""
    state.kept.clear()


def kept(
    told: State, kind: str, source: object, work: Generator[State, None, Result], *, of: str = ""
) -> Generator[State, None, Result]:
    """The result of work that follows from a source, which `hash_inputs` can compare; the last of each kind is held.

    Of a kind of which there are several, that is the last `of` each name. While the source is compared, the driver is
    told the same state.
    """
    compared = yield from meanwhile(told, hash_inputs.slices(source))
    if last := state.kept.get((kind, of)):
        if last[0] == compared:
            result: Result = last[1]
            return result
        del last, state.kept[kind, of]  # room for what comes
    result = yield from work
    size = _size(result)
    if size + sum(each[2] for key, each in state.kept.items() if key[0] == kind) <= LARGEST:
        state.kept[kind, of] = compared, result, size
    return result


def _size(*values: Any) -> int:
    """About the memory that values take [bytes], those that they share once."""
    waiting, seen, size = list(values), set[int](), 0
    while waiting:
        value = waiting.pop()
        if id(value) in seen or isinstance(value, type):
            continue
        seen.add(id(value))
        size += value.nbytes if isinstance(value, np.ndarray | PackedArray) else 50
        waiting += value.values() if isinstance(value, Mapping) else getattr(value, "__dict__", {}).values()
        waiting += value if isinstance(value, list | tuple) else ()
    return size
