"""Arrays that take little memory while nobody looks at them."""

from __future__ import annotations

import zlib
from typing import Any, Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from .slices import Slices, result_of

Number = TypeVar("Number", bound=np.generic)

LEVEL = 1
"""Level of zlib: higher ones take longer than a look at a footprint, and gain little."""

SMALL = 8192
"""Fields of which less is packed [bytes] are left as they are."""


class PackedArray(Generic[Number]):
    """An array that grows at its end, in compressed parts.

    Parameters
    ----------
    first : (N, ...) array
        Its first values, which all others are like.
    is_small : bool
        True to leave them as they are: compressing takes longer than what is made of few values.

    Examples
    --------
    >>> steps = PackedArray(np.array([1, 2]))
    >>> steps.extend(PackedArray(np.array([3])))
    >>> steps.unpacked().tolist(), len(list(steps.unpacking()))  # in as many slices as it has grown by
    ([1, 2, 3], 2)
    """

    __slots__ = ("_kind", "_parts", "_row", "_size")

    def __init__(self, first: NDArray[Number], *, is_small: bool = False) -> None:
        self._kind, self._row, self._size = first.dtype, first.shape[1:], len(first)
        whole = np.ascontiguousarray(first)
        self._parts: list[bytes | NDArray[Number]] = []
        if is_small:
            self._parts.append(whole.copy())  # what it is part of may be large
            return
        # Of neighbours, the high bytes are much the same and the low ones noise: each kind for itself packs better.
        by_significance = np.ascontiguousarray(_bytes_of(whole).T)
        self._parts.append(zlib.compress(by_significance.data, LEVEL))

    def __len__(self) -> int:
        return self._size

    @property
    def nbytes(self) -> int:
        """Memory that it takes [bytes]."""
        return sum(len(part) if isinstance(part, bytes) else part.nbytes for part in self._parts)

    def extend(self, more: PackedArray[Number]) -> None:
        """Grow by another array of the same kind."""
        self._parts += more._parts
        self._size += len(more)

    def unpacked(self) -> NDArray[Number]:
        """The array as a new one."""
        return result_of(self.unpacking())

    def unpacking(self) -> Slices[NDArray[Number]]:
        """What `unpacked` does, in slices."""
        whole: NDArray[Number] = np.empty((self._size, *self._row), self._kind)
        values, content, first = whole.reshape(-1), _bytes_of(whole), 0
        for part in self._parts:
            if isinstance(part, bytes):
                planes = np.frombuffer(zlib.decompress(part), np.uint8).reshape(self._kind.itemsize, -1)
                end = first + planes.shape[1]
                for significance, plane in enumerate(planes):  # many times faster than all at once
                    content[first:end, significance] = plane
            else:
                end = first + part.size
                values[first:end] = part.ravel()
            first = end
            yield
        return whole


def _bytes_of(values: NDArray[Any]) -> NDArray[np.uint8]:
    """The bytes of each of an array's values, (values, bytes), as a view."""
    content: NDArray[np.uint8] = values.reshape(-1).view(np.uint8).reshape(-1, values.itemsize)
    return content


class Packed(Generic[Number]):
    """A field of a dataclass: an array that is packed, and unpacked each time that it is looked at.

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
        return getattr(holder, self._name).unpacked()

    def __set__(self, holder: object, values: NDArray[Number]) -> None:
        object.__setattr__(holder, self._name, PackedArray(values, is_small=values.nbytes < SMALL))
