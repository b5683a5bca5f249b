"""Arrays that take little memory while nobody looks at them."""

from __future__ import annotations

import zlib
from typing import Any, Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", bound=np.generic)

LEVEL = 1
"""Of zlib: the higher ones take longer than looking at a footprint does, and gain little."""


class Packed(Generic[Number]):
    """A field of a dataclass: an array (N,) that is kept compressed, and unpacked each time that it is looked at.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Print:
    ...     cells: Packed[np.int32] = Packed()
    >>> Print(np.arange(3, dtype=np.int32)).cells
    array([0, 1, 2], dtype=int32)
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_{name}"

    @overload
    def __get__(self, holder: None, owner: type) -> Packed[Number]: ...
    @overload
    def __get__(self, holder: object, owner: type) -> NDArray[Number]: ...
    def __get__(self, holder: object | None, owner: type) -> Any:
        if holder is None:
            raise AttributeError("a field without a default")  # which is what a dataclass looks for here
        kind, packed = getattr(holder, self._name)
        return np.frombuffer(zlib.decompress(packed), kind)

    def __set__(self, holder: object, values: NDArray[Number]) -> None:
        packed = zlib.compress(values.tobytes(), LEVEL)
        object.__setattr__(holder, self._name, (values.dtype, packed))
