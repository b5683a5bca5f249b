"""The bones of a rig at rest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array


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


def extent(heads: Array, to_world: Array) -> float:
    """Largest extent of joints (N, 3) under a matrix (4, 4), however that turns them: a rig's height, or its length."""
    lengths = np.ptp(heads, axis=0) * np.linalg.norm(to_world[:3, :3], axis=0) if len(heads) else np.zeros(1)
    return float(lengths.max())


def stature(heads: Array, to_world: Array) -> float:
    """Height of a body by its joints (N, 3) under a matrix (4, 4), or a third of their extent if they are low; the unit
    of its file is judged by it."""
    height = float(np.ptp(heads @ to_world[2, :3])) if len(heads) else 0.0
    return max(height, extent(heads, to_world) / 3)


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
    members = set()
    for other in bones:
        chain = [other, *above(bones, other)]
        if name in chain and ends.isdisjoint(chain[: chain.index(name)]):
            members.add(other)
    return frozenset(members)


def envelope(points: Array, ends: Array, radii: tuple[float, float], distance: float) -> Array:
    """Weights (N,) that the envelope of a bone has on points (N, 3): 1 within its radii, and down to 0 at a distance
    beyond them, as Blender's armature deformation has them.

    Parameters
    ----------
    ends : (2, 3) float array
        Head and tail.
    radii : (float, float)
        Of the envelope there.

    Examples
    --------
    >>> import numpy as np
    >>> points = np.array([(0.1, 0.0, 0.5), (0.2, 0.0, 0.5), (0.0, 0.0, -0.3)])
    >>> envelope(points, np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]), (0.1, 0.1), 0.2).round(6).tolist()
    [1.0, 0.75, 0.0]
    """
    along = ends[1] - ends[0]
    share = np.clip((points - ends[0]) @ along / max(along @ along, np.finfo(float).tiny), 0.0, 1.0)
    gap = np.linalg.norm(points - ends[0] - share[:, None] * along, axis=1)
    gap -= radii[0] + share * (radii[1] - radii[0])
    return np.clip(1.0 - np.square(np.maximum(gap, 0.0) / max(distance, np.finfo(float).tiny)), 0.0, 1.0)
