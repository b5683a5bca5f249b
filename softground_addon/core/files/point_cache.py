"""PC2 point caches: the positions of a mesh's vertices at every frame, as many programs read them."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .files import replacing

_HEADER = struct.Struct("<12siiffi")
_MAGIC = b"POINTCACHE2\0"
_VERSION = 1


def write(path: Path, samples: Iterable[NDArray[np.float32]], *, start_frame: float, points: int, count: int) -> None:
    """Write a cache with one sample per frame, whole or not at all.

    Parameters
    ----------
    samples : iterable of (points, 3) float32 arrays
        Positions, frame by frame; they are written as they come.
    start_frame : float
        Frame of the first sample.
    points, count : int
        Number of vertices and of samples.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with replacing(path) as partial, partial.open("wb") as cache:
        cache.write(_HEADER.pack(_MAGIC, _VERSION, points, start_frame, 1.0, count))
        for sample in samples:
            cache.write(np.ascontiguousarray(sample, dtype="<f4").tobytes())
