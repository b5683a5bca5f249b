"""Markers that only a static trial has, placed by the clusters that a motion shares with it.

References
----------
Cappozzo, Catani, Della Croce, Leardini, "Position and orientation in space of bones during movement: anatomical frame
definition and determination", Clinical Biomechanics 10 (1995), 10.1016/0268-0033(95)91394-T.
"""

from __future__ import annotations

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

    A cluster is three or more markers of both trials that keep their distances. Markers without a cluster stay out.
    """
    paths = {label: bridged(path) for label, path in _seen(capture).items()}
    places = {label: np.nanmedian(path, axis=0) for label, path in _seen(static).items()}
    shared = [label for label in paths if label in places]
    if len(shared) < _FEWEST:
        return capture
    start, moved = np.stack([places[label] for label in shared]), np.stack([paths[label] for label in shared], axis=1)
    keep = _keep_distance(start, moved)
    added = {}
    for label in places.keys() - paths.keys():
        cluster = _cluster(start, keep, places[label])
        if len(cluster):
            motions = rigid_motions(start[cluster], moved[:, cluster])
            added[label] = motions[:, :3, :3] @ places[label] + motions[:, :3, 3]
    if not added:
        return capture
    points = np.concatenate([capture.points, np.stack([*added.values()], axis=1)], axis=1)
    return replace(capture, labels=(*capture.labels, *added), points=points)


def _seen(capture: Capture) -> dict[str, Array]:
    """Paths of the markers that are seen at all, by name without the subject's."""
    names = [label.rsplit(":", 1)[-1].strip() for label in capture.labels]
    paths = dict(zip(names, capture.points.swapaxes(0, 1), strict=False))
    return {label: path for label, path in paths.items() if np.isfinite(path).all(axis=1).any()}


def _keep_distance(start: Array, moved: Array) -> NDArray[np.bool_]:
    """True for pairs of markers (M, 3) that are as far from each other while they move (F, M, 3), (M, M)."""
    still = np.linalg.norm(start[:, None] - start, axis=-1)
    return np.stack(
        [
            np.abs(np.linalg.norm(moved - moved[:, marker, None], axis=-1) - still[marker]).max(axis=0) < _RIGID
            for marker in range(len(start))
        ]
    )


def _cluster(start: Array, keep: NDArray[np.bool_], place: Array) -> NDArray[np.intp]:
    """Numbers of the markers (M, 3) of the cluster nearest to a place (3,); empty if there is none."""
    order = np.argsort(np.linalg.norm(start - place, axis=1))
    for nearest in order:
        cluster: list[int] = []
        for marker in [nearest, *order]:
            if marker not in cluster and keep[marker, cluster].all() and len(cluster) < _MOST:
                cluster.append(int(marker))
        spread = np.linalg.svd(start[cluster] - start[cluster].mean(axis=0), compute_uv=False)
        if len(cluster) >= _FEWEST and spread[1] > _BROAD * np.sqrt(len(cluster)):
            return np.array(cluster)
    return np.zeros(0, dtype=np.intp)
