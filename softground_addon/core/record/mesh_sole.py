"""Soles cut from any mesh, as edits of steps store them: the mesh is not needed any more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import damaged
from ..motion.sole_motion import Sole
from ..numerics.arrays import Array
from .contact_arrays import sole_from_arrays, sole_to_arrays
from .contact_steps import PressingSole, kept_sole

SHORTEST, LONGEST = 0.005, 10.0
"""Range of a mesh sole's length [m]: others are mostly of a file in other units."""
_MOST = 2**20
"""Most numbers that are read of one: a sole of a mesh has some thousands."""


@dataclass(frozen=True)
class MeshSole:
    """A sole in one piece, to be compared and hashed by its numbers.

    Attributes
    ----------
    name : str
        Of the object that it was cut from.
    numbers : bytes
        Float64 values, as `contact_arrays.sole_to_arrays` has them [m].
    coded : bytes
        Int32 values, likewise.
    """

    name: str
    numbers: bytes
    coded: bytes

    @cached_property
    def pressing(self) -> PressingSole:
        """The sole; ValueError where the numbers are none of a sole."""
        return sole_from_arrays(self.name, np.frombuffer(self.numbers), np.frombuffer(self.coded, np.int32))

    @classmethod
    def of(cls, sole: Sole, flat: Array) -> MeshSole:
        """A sole whose patches lie so, (P, 4, 4), rounded as it is stored."""
        numbers, coded = sole_to_arrays(kept_sole(sole, flat))
        return cls(sole.name, numbers.tobytes(), coded.tobytes())

    def to_json(self) -> dict[str, list[float]]:
        """The sole for JSON."""
        return {
            "numbers": np.frombuffer(self.numbers).tolist(),
            "coded": np.frombuffer(self.coded, np.int32).tolist(),
        }


def from_json(name: str, content: object, where: str) -> MeshSole:
    """A sole from the result of `MeshSole.to_json`.

    Raises
    ------
    InputError
        Where it is none; calls it `where`.
    """
    try:
        if not isinstance(content, Mapping) or set(content) != {"numbers", "coded"}:
            raise ValueError("it must have 'numbers' and 'coded'")
        numbers, coded = (_array(content[key], kind) for key, kind in (("numbers", np.float64), ("coded", np.int32)))
        sole = MeshSole(name, numbers.tobytes(), coded.tobytes())
        _check(sole.pressing)
    except (ValueError, TypeError, OverflowError, np.linalg.LinAlgError) as error:
        raise damaged(
            where, f"this is no sole of a mesh ({error}). Leave it out: a bake cuts it from the object."
        ) from None
    return sole


def _array(values: object, kind: type) -> np.ndarray[Any, Any]:
    if not isinstance(values, list) or len(values) > _MOST:
        raise ValueError("it must be lists of numbers")
    if any(isinstance(value, bool) or not isinstance(value, int | float) for value in values):
        raise ValueError("it has what is no number")
    array = np.array(values, np.float64)
    if not np.isfinite(array).all() or np.abs(array).max(initial=0.0) > 2**31 - 1:
        raise ValueError("it has what is no number of its kind")
    if (array.astype(kind) != array).any():
        raise ValueError("it has what is no whole number")
    return array.astype(kind)


def _check(pressing: PressingSole) -> None:
    sole = pressing.sole
    if sole.prop is not None or len(sole.patches) != 1:
        raise ValueError("it is not of one piece")
    patch = sole.patches[0]
    extent = np.array(patch.heights.shape) * patch.spacing
    if not SHORTEST <= np.ptp(sole.outline, axis=0).max() <= LONGEST or extent.max() > 2 * LONGEST:
        raise ValueError(f"its length is not between {SHORTEST * 1e3:g} mm and {LONGEST:g} m")
    if max(np.abs(sole.outline).max(), np.abs(sole.landmarks).max(), np.abs(patch.heights).max()) > 4 * LONGEST:
        raise ValueError("it is far away from itself")
    if not np.allclose(pressing.flat[:, :3, :3], np.eye(3)) or np.abs(pressing.flat).max() > 4 * LONGEST:
        raise ValueError("it does not lie flat")
