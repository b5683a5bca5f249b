"""World position of each pixel of a UV map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Indices
from ..numerics.triangles import barycentric, enumerated

PAIRS_AT_ONCE = 4_000_000
"""Pairs of a triangle and a pixel that are tested together: about 300 MB."""


@dataclass(frozen=True)
class Pixels:
    """Pixels that lie in the triangles of a UV map.

    Attributes
    ----------
    index : (N,) int array
        row·width + column, rows from v = 0 up.
    position : (N, D) float array
        World positions of the pixels' centres [m].
    """

    index: Indices
    position: Array


def rasterise(uv: Array, place: Array, width: int, height: int) -> Pixels:
    """The pixels whose centres lie in triangles; where triangles overlap, the last one counts.

    Parameters
    ----------
    uv : (T, 3, 2) float array
        UV coordinates of the triangles' corners; the image spans 0 to 1.
    place : (T, 3, D) float array
        World positions of the same corners [m].
    width, height : int
        Size of the image.
    """
    corner = uv * (width, height) - 0.5  # pixel centres at whole numbers
    size = np.array([width, height])
    low = np.clip(np.ceil(corner.min(axis=1) - 1e-9), 0, size).astype(np.intp)
    high = np.clip(np.floor(corner.max(axis=1) + 1e-9) + 1, 0, size).astype(np.intp)
    span = np.maximum(high - low, 0)
    counts = span.prod(axis=1)
    covering = np.flatnonzero(counts)
    index, position = [np.zeros(0, dtype=np.intp)], [np.zeros((0, place.shape[-1]))]
    batch = np.cumsum(counts[covering]) // PAIRS_AT_ONCE
    for number in np.unique(batch):
        chosen = covering[batch == number]
        owner, within = enumerated(counts[chosen])
        triangle = chosen[owner]
        row, column = np.divmod(within, span[triangle, 0])
        pixel = np.stack([column, row], axis=-1) + low[triangle]
        u, v, inside = barycentric(corner[triangle], pixel)
        weights = np.stack([1 - u - v, u, v], axis=-1)[inside]
        index.append((pixel[:, 1] * width + pixel[:, 0])[inside])
        position.append(np.einsum("nk,nki->ni", weights, place[triangle[inside]]))
    all_index, all_position = np.concatenate(index), np.concatenate(position)
    last = len(all_index) - 1 - np.unique(all_index[::-1], return_index=True)[1]
    return Pixels(all_index[last], all_position[last])
