"""A rectangular grid that is fine where it is wanted and coarse elsewhere: the leaves of a balanced quadtree.

Faces are squares of 1, 2, 4, ... cells. Those that share a side or a corner differ by at most a factor of two, and a
square with smaller ones beside it has their corners on its sides too, so that no crack opens when they move.

References
----------
de Berg et al., "Computational Geometry", 3rd ed. (2008), chapter 14: quadtrees and non-uniform mesh generation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Indices
from ..numerics.cell_keys import AROUND, Keys, among, cells_of, keys_of, merged, parents_of
from ..numerics.slices import Slices, sliced

_CORNERS = keys_of(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))


@dataclass(frozen=True)
class GradedGrid:
    """Squares of different sizes that fill a rectangle, as polygons without cracks.

    Attributes
    ----------
    vertices : (V, 2) int array
        Column and row of each vertex [cells], row by row.
    corner_vertex : (L,) int array
        Vertex of each corner, face by face, counter-clockwise.
    face_size : (P,) int array
        Number of corners of each face, 4 to 8.
    """

    vertices: Indices
    corner_vertex: Indices
    face_size: Indices


@dataclass(frozen=True)
class Blocks:
    """Blocks that are to be made of squares of one size.

    Attributes
    ----------
    place : (N, 2) int array
        Column and row of each block.
    level, size : int
        Sides of a block and of its squares, as powers of two [cells].
    """

    place: Indices
    level: int
    size: int

    def parents(self, count: Indices, coarsest: int) -> Keys:
        """Keys of the blocks of twice the size of the squares, those inside of a rectangle."""
        inside = ((self.place >= 0) & (self.place < count << coarsest - self.level)).all(axis=1)
        blocks = np.unique(keys_of(self.place[inside]))
        for _ in range(self.size + 1, self.level):
            blocks = _quarters(blocks)
        return parents_of(blocks) if self.level == self.size else blocks


@sliced
def graded_grid(
    fine: Indices, level: int, lower: Indices, upper: Indices, coarsest: int, coarser: Blocks | None = None
) -> Slices[GradedGrid]:
    """Fill a rectangle with squares that are one cell large in given blocks and grow with the distance from them.

    Parameters
    ----------
    fine : (N, 2) int array
        Column and row of the blocks that are to be made of single cells; those outside the rectangle do not count.
    level : int
        Side of those blocks, as a power of two [cells].
    lower, upper : (2,) int arrays
        Corners that the rectangle reaches at least [cells]; it consists of whole squares of the largest size.
    coarsest : int
        Side of the largest squares, as a power of two [cells]; not below `level`.
    coarser : Blocks, optional
        Further blocks, whose squares are larger; not larger than the largest.

    Examples
    --------
    >>> grid = graded_grid(np.array([[0, 0]]), 0, np.array([0, 0]), np.array([8, 8]), 3)
    >>> grid.face_size.tolist()  # three squares of 4 cells, three of 2, four of 1
    [5, 5, 4, 5, 5, 4, 4, 4, 4, 4]
    """
    side = 1 << coarsest
    origin = lower // side * side
    count = np.maximum(-(-upper // side) - lower // side, 1)
    kinds = [Blocks(np.asarray(fine), level, 0), *([coarser] if coarser else [])]
    inside = [replace(kind, place=kind.place - origin // (1 << kind.level)) for kind in kinds]
    cut = yield from _cut_blocks(inside, count, coarsest)
    blocks = keys_of(np.stack(np.meshgrid(*map(np.arange, count)), axis=-1)).ravel()
    place, size = [], []
    for number in range(coarsest, -1, -1):
        yield
        whole = ~among(cut.get(number, blocks[:0]), blocks)
        place.append(blocks[whole] << number)
        size.append(np.full(len(place[-1]), 1 << number))
        blocks = _quarters(blocks[~whole])
    return (yield from _polygons(np.concatenate(place), np.concatenate(size), origin))


def _cut_blocks(kinds: Sequence[Blocks], count: Indices, coarsest: int) -> Slices[dict[int, Keys]]:
    """Keys of the blocks that are cut in four, by level: those above a fine one, and what keeps the sizes balanced."""
    blocks = np.zeros(0, dtype=np.int64)
    cut = {}
    for number in range(1, coarsest + 1):
        for kind in kinds:
            if kind.size + 1 == number:
                yield
                blocks = merged(blocks, kind.parents(count, coarsest))
        yield
        cut[number] = blocks
        around = cells_of(merged(*(blocks + step for step in AROUND)))
        inside = ((around >= 0) & (around < count << coarsest - number)).all(axis=1)
        blocks = parents_of(keys_of(around[inside]))
    return cut


def _quarters(blocks: Keys) -> Keys:
    return merged(*(2 * blocks + corner for corner in _CORNERS))


def _polygons(place: Keys, size: Keys, origin: Indices) -> Slices[GradedGrid]:
    """Squares with given first corners (P,) and sides as polygons with all vertices that lie on their sides."""
    corners, vertices = [place + size * corner for corner in _CORNERS], place[:0]
    for corner in corners:
        yield
        vertices = merged(vertices, corner)
    large, face_size = np.flatnonzero(size > 1), np.full(len(place), 4)
    outline = np.full((len(place), 8), -1, dtype=np.intp)
    for number, corner in enumerate(corners):
        yield
        outline[:, 2 * number] = np.searchsorted(vertices, corner)
        middles = (corner[large] + corners[number - 3][large]) // 2
        divided = among(vertices, middles)
        outline[large[divided], 2 * number + 1] = np.searchsorted(vertices, middles[divided])
        face_size[large] += divided
    yield
    corner_vertex = outline[outline >= 0]
    yield
    return GradedGrid((cells_of(vertices) + origin).astype(np.intp), corner_vertex, face_size)
