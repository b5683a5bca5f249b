"""Values between samples: straight lines, C1 cubics, and rigid poses that turn evenly.

Positions are given in samples: 2.25 is a quarter of the way from sample 2 to sample 3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .arrays import Array
from .orientation import quaternions
from .rigid import rotation
from .slices import Slices, sliced

STRETCH = 512
"""Samples computed at once: few enough that the intermediate arrays of a formula take little memory."""


class Between(np.lib.mixins.NDArrayOperatorsMixin):
    """Samples (F, ...) seen at positions between them: an array (K, ...) that is computed on access.

    A shot at the simulation's time grid takes many times the memory of its frames, and most of it is looked at for a
    few steps at a time.

    Parameters
    ----------
    samples : (F, ...) float array
        At least 2.
    position : (K,) float array
    method : callable
        Interpolates: takes samples and positions. It looks at the two samples beside a position and at the neighbours
        of these, no further.
    """

    def __init__(self, samples: Array, position: Array, method: Callable[[Array, Array], Array]) -> None:
        self._samples, self._position, self._method = samples, position, method

    @property
    def shape(self) -> tuple[int, ...]:
        """(K, ...)."""
        return (len(self._position), *self._samples.shape[1:])

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self._samples.ndim

    def __len__(self) -> int:
        return len(self._position)

    def __getitem__(self, index: Any) -> Any:
        """Basic indices, or an array of steps and basic indices for the other axes."""
        steps, *others = index if isinstance(index, tuple) else (index,)
        if steps is Ellipsis:
            steps, others = slice(None), [Ellipsis, *others]
        position = self._position[steps]
        if position.ndim == 0:
            return self._at(position[None])[0][tuple(others)]
        return in_stretches(lambda stretch: self._at(position[stretch])[(slice(None), *others)], len(position))

    def __array__(self, dtype: DTypeLike = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        arrays = [np.asarray(each) if isinstance(each, Between) else each for each in inputs]
        return getattr(ufunc, method)(*arrays, **options)

    def _at(self, position: Array) -> Array:
        """All of the samples at some of the positions, from those around them."""
        if not len(position):
            return np.empty((0, *self._samples.shape[1:]))
        before = min(int(position.min()), len(self._samples) - 2)  # the last sample ends the span before it
        first = max(before - 1, 0)
        return self._method(self._samples[first : int(position.max()) + 3], position - first)


@sliced
def in_stretches(work: Callable[[slice], Array], count: int) -> Slices[Array]:
    """Results of `work` for `count` samples, (count, ...), computed stretch by stretch, which bounds its memory."""
    first = work(slice(0, STRETCH))
    if count <= STRETCH:
        return first
    whole = np.empty_like(first, shape=(count, *first.shape[1:]))
    whole[:STRETCH] = first
    for start in range(STRETCH, count, STRETCH):
        yield
        whole[start : start + STRETCH] = work(slice(start, start + STRETCH))
    return whole


def smooth_step(share: Array) -> Array:
    """Cubic from 0 at 0 to 1 at 1, level at both ends and outside."""
    part = np.clip(share, 0.0, 1.0)
    return np.asarray(part * part * (3.0 - 2.0 * part))


def linear(samples: Array, position: Array) -> Array:
    """Samples (F, ...) along straight lines, at positions (K,), (K, ...)."""
    index, u = _span(len(samples), position)
    a, b = samples[index], samples[np.minimum(index + 1, len(samples) - 1)]
    return np.asarray(a + _over(u, samples) * (b - a))


def cubic(samples: Array, position: Array, places: Array | None = None) -> Array:
    """Samples (F, ...) along cubics that pass them with the slopes of their neighbours, at positions (K,), (K, ...).

    Parameters
    ----------
    samples : (F, ...) float array
    position : (K,) float array
        Between the first place and the last.
    places : (F,) float array, optional
        Positions of the samples, ascending; by default at 0, 1, 2 and so on (Catmull-Rom).
    """
    if len(samples) < 2:
        return np.repeat(samples, len(position), axis=0)
    places = np.arange(len(samples), dtype=float) if places is None else places
    index = np.maximum(np.searchsorted(places, position, side="right") - 1, 0)
    if (places[index] == position).all():
        return np.asarray(samples[index])
    after = np.minimum(index + 1, len(places) - 1)
    width = _over(np.where(after > index, places[after] - places[index], 1.0), samples)
    u = _over(position - places[index], samples) / width
    slope = np.gradient(samples, places, axis=0)
    a, b, da, db = samples[index], samples[after], slope[index] * width, slope[after] * width
    return np.asarray(a + u * (da + u * (3 * (b - a) - 2 * da - db + u * (2 * (a - b) + da + db))))


def turning(poses: Array, position: Array) -> Array:
    """Rigid poses (F, ..., 4, 4) that turn evenly and move along straight lines, at positions (K,), (K, ..., 4, 4)."""
    index, u = _span(len(poses), position)
    a, b = poses[index], poses[np.minimum(index + 1, len(poses) - 1)]
    turn = np.swapaxes(a[..., :3, :3], -1, -2) @ b[..., :3, :3]
    w, *axis = quaternions(turn.reshape(-1, 3, 3)).T
    sine = np.linalg.norm(axis, axis=0)
    angle = 2 * np.arctan2(sine, w) / np.maximum(sine, 1e-300)
    vector = (angle * np.array(axis)).T.reshape(*turn.shape[:-2], 3)
    part = _over(u, vector)
    result = a.copy()
    result[..., :3, :3] = a[..., :3, :3] @ rotation(part * vector)
    result[..., :3, 3] += part * (b[..., :3, 3] - a[..., :3, 3])
    return result


def _span(count: int, position: Array) -> tuple[NDArray[np.intp], Array]:
    """The sample before each position, and the fraction of the way from it to the next."""
    index = np.clip(np.floor(position).astype(int), 0, max(count - 2, 0))
    return index, position - index


def _over(values: Array, samples: Array) -> Array:
    """Values (K,) that go with the first axis of (K, ...)."""
    return values.reshape(-1, *[1] * (samples.ndim - 1))
