"""Markers that only a static trial has, placed by the clusters that a motion shares with it.

References
----------
Cappozzo, Catani, Della Croce, Leardini, "Position and orientation in space of bones during movement: anatomical frame
definition and determination", Clinical Biomechanics 10 (1995), 10.1016/0268-0033(95)91394-T.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ._core.capture.captured import Capture, bridged
from ._core.skin.rigid_parts import rigid_motions

Array = NDArray[np.float64]

_RIGID = 0.01
"""Most that the distance of two markers of a cluster may change [m]."""
_FEWEST, _MOST = 3, 6
"""Markers of a cluster; of more, those nearest to what they place."""
_BROAD = 0.01
"""Least width of a cluster across its longest direction, as a standard deviation [m]: markers in a row turn freely."""


def with_static(capture: Capture, static: Capture) -> Capture:
    """A capture with the markers that it lacks and a static trial has, each moved along by the nearest cluster.

    A cluster is three or more markers of both trials that keep their distances, and are seen together with what they
    place in some frame of the static trial; the subject may move there. Markers without a cluster stay out.
    """
    paths, places = {label: bridged(path) for label, path in _seen(capture).items()}, _seen(static)
    shared = [label for label in paths if label in places]
    if len(shared) < _FEWEST:
        return capture
    start, moved = (np.stack([of[label] for label in shared], axis=1) for of in (places, paths))
    keep = _keep_distance(start, moved)
    added = {}
    for label in places.keys() - paths.keys():
        order = _nearest(start, places[label])
        seen = np.isfinite(start).all(axis=-1) & np.isfinite(places[label]).all(axis=-1)[:, None]
        for nearest in order:
            cluster = _cluster(nearest, order, keep, seen)
            still = _still(start[:, cluster], places[label])
            if _is_broad(still[:-1]):
                motions = rigid_motions(still[:-1], moved[:, cluster])
                added[label] = motions[:, :3, :3] @ still[-1] + motions[:, :3, 3]
                break
    if not added:
        return capture
    points = np.concatenate([capture.points, np.stack([*added.values()], axis=1)], axis=1)
    return replace(capture, labels=(*capture.labels, *added), points=points)


def _seen(capture: Capture) -> dict[str, Array]:
    """Paths of the markers that are seen at all, by name without the subject's."""
    names = [label.rsplit(":", 1)[-1].strip() for label in capture.labels]
    paths = dict(zip(names, capture.points.swapaxes(0, 1), strict=False))
    return {label: path for label, path in paths.items() if np.isfinite(path).all(axis=1).any()}


def _median(values: Array) -> Array:
    """Median over frames (F, ...) of those that are numbers; NaN where none is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # none is
        return np.asarray(np.nanmedian(values, axis=0))


def _keep_distance(start: Array, moved: Array) -> NDArray[np.bool_]:
    """True for pairs of markers that are as far from each other in the static trial (S, M, 3) and in the other (F, M,
    3), (M, M)."""
    rows = []
    for marker in range(start.shape[1]):
        still = _median(np.linalg.norm(start - start[:, marker, None], axis=-1))
        rows.append(np.abs(np.linalg.norm(moved - moved[:, marker, None], axis=-1) - still).max(axis=0) < _RIGID)
    return np.stack(rows)


def _nearest(start: Array, path: Array) -> list[int]:
    """Numbers of the markers (S, M, 3) that are seen together with another one (S, 3), the nearest first."""
    distance = _median(np.linalg.norm(start - path[:, None], axis=-1))
    return [int(marker) for marker in np.argsort(distance) if np.isfinite(distance[marker])]


def _cluster(nearest: int, order: Sequence[int], keep: NDArray[np.bool_], seen: NDArray[np.bool_]) -> list[int]:
    """Markers about one of them that keep their distances, and are `seen` (S, M) in one frame; at most `_MOST`."""
    cluster, together = [nearest], seen[:, nearest]
    for marker in order:
        fits = marker not in cluster and keep[marker, cluster].all() and (together & seen[:, marker]).any()
        if fits and len(cluster) < _MOST:
            cluster.append(marker)
            together = together & seen[:, marker]
    return cluster


def _still(start: Array, path: Array) -> Array:
    """Places of a cluster (S, C, 3) and of what it carries along (S, 3), however it moves, (C + 1, 3)."""
    together = np.concatenate([start, path[:, None]], axis=1)
    together = together[np.isfinite(together).all(axis=(1, 2))]
    motions = rigid_motions(together[0, :-1], together[:, :-1])
    back = (together - motions[:, None, :3, 3]) @ motions[:, :3, :3]
    return np.asarray(np.median(back, axis=0))


def _is_broad(cluster: Array) -> bool:
    """True if markers (C, 3) tell how they are turned."""
    if len(cluster) < _FEWEST:
        return False
    spread = np.linalg.svd(cluster - cluster.mean(axis=0), compute_uv=False)
    return bool(spread[1] > _BROAD * np.sqrt(len(cluster)))
