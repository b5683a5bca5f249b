"""The bones of a rig at rest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass

from ..motion.motion import Array


@dataclass(frozen=True)
class RestBone:
    """A bone at rest, in the space of its armature [Blender units].

    Attributes
    ----------
    parent : str
        Name of the bone that it hangs on; empty for none.
    matrix : (4, 4) float array
        Its frame, whose y axis points from head to tail.
    head, tail : (3,) float arrays
    length : float
    """

    parent: str
    matrix: Array
    head: Array
    tail: Array
    length: float

    def end(self, end: str) -> Array:
        """Its "head" or its "tail"."""
        return self.head if end == "head" else self.tail


RigBones = Mapping[str, RestBone]
"""The bones of a rig by name."""


def above(bones: RigBones, name: str) -> Iterator[str]:
    """Names of the bones on which one hangs, nearest first."""
    while name := bones[name].parent:
        yield name


def family(bones: RigBones, name: str, ends: Set[str] = frozenset()) -> frozenset[str]:
    """Names of a bone and of all that hang on it, up to the `ends`, which are left out.

    Examples
    --------
    >>> import numpy as np
    >>> point, matrix = np.zeros(3), np.eye(4)
    >>> parents = {"leg": "", "foot": "leg", "toe": "foot", "heel": "foot"}
    >>> bones = {name: RestBone(parent, matrix, point, point, 1.0) for name, parent in parents.items()}
    >>> sorted(family(bones, "foot")), sorted(family(bones, "leg", {"toe"}))
    (['foot', 'heel', 'toe'], ['foot', 'heel', 'leg'])
    >>> list(above(bones, "toe"))
    ['foot', 'leg']
    """
    found = set()
    for other in bones:
        chain = [other, *above(bones, other)]
        if name in chain and ends.isdisjoint(chain[: chain.index(name)]):
            found.add(other)
    return frozenset(found)
