"""Connected components of a graph."""

from __future__ import annotations

import numpy as np

from .arrays import Indices


def components(count: int, node: Indices, other: Indices) -> Indices:
    """Number of the component that each of `count` nodes is in, from 0 on, where `node` and `other` (L,) are linked.

    Examples
    --------
    >>> components(5, np.array([0, 3]), np.array([1, 4]))
    array([0, 0, 1, 2, 2])
    """
    label = np.arange(count)
    while True:
        lower = np.minimum(label[node], label[other])
        known = label.copy()
        for end in (node, other):
            np.minimum.at(label, label[end], lower)
        label = label[label]  # a node of a label is in that label's own component
        if (label == known).all():
            return np.asarray((np.cumsum(label == np.arange(count)) - 1)[label])
