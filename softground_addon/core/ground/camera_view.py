"""The scene's camera above a ground: how far the picture reaches, and where it comes close."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Mask

Place = tuple[float, float, float]

PIXELS = 0.75
"""Width of a fine cell in the picture from which it is worth its vertices [pixels]."""
FARTHEST = 30.0
"""How far a ground reaches beyond the walk where the camera sees far [m]."""


@dataclass(frozen=True)
class CameraView:
    """A camera as it was when a bake began.

    Attributes
    ----------
    corners : tuple of (place, place)
        Ray through each corner of the picture: where it begins [m], and its direction.
    eyes : tuple of places
        Where the camera is, now and along its path [m].
    pixels_per_radian : float
        Pixels of the picture over the angle that they are seen under, in its middle; 0 without perspective.
    """

    corners: tuple[tuple[Place, Place], ...]
    eyes: tuple[Place, ...]
    pixels_per_radian: float

    def moved(self, matrix: Array) -> CameraView:
        """The same view from elsewhere: in the frame to which a matrix (4, 4) leads [m]."""
        turn, shift = matrix[:3, :3], matrix[:3, 3]

        def place(point: Place) -> Place:
            x, y, z = (turn @ point + shift).tolist()
            return x, y, z

        def ray(direction: Place) -> Place:
            x, y, z = (turn @ direction).tolist()
            return x, y, z

        return replace(
            self,
            corners=tuple((place(origin), ray(direction)) for origin, direction in self.corners),
            eyes=tuple(map(place, self.eyes)),
        )

    def reach(self, height: float) -> Array:
        """Corners of the picture on level ground, (N, 2) [m]; far away for those above the horizon.

        Examples
        --------
        >>> CameraView((((0.0, 0.0, 2.0), (0.5, 0.0, -1.0)),), (), 0.0).reach(1.0)
        array([[0.5, 0. ]])
        """
        origin, ray = np.array(self.corners).transpose(1, 0, 2)
        down = ray[:, 2] < 0
        far = 2 * FARTHEST / np.maximum(np.linalg.norm(ray[:, :2], axis=1), 1e-9)
        along = np.where(down, (height - origin[:, 2]) / np.where(down, ray[:, 2], -1.0), far)
        return np.asarray(origin[:, :2] + np.clip(along, 0.0, far)[:, None] * ray[:, :2])

    def is_near(self, places: Array, spacing: float) -> Mask:
        """Which of some places (N, 2) [m] are seen from so near that cells of a size [m] show."""
        if not self.pixels_per_radian:
            return np.ones(len(places), dtype=bool)
        distance = spacing * self.pixels_per_radian / PIXELS
        near = np.zeros(len(places), dtype=bool)
        for eye in np.unique(self.eyes, axis=0):
            near |= np.hypot(*(places - eye[:2]).T) < np.sqrt(max(distance**2 - eye[2] ** 2, 0.0))
        return near
