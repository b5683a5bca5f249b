"""Content of a capture file, whatever its format: the paths of markers, and the force on each plate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..numerics.arrays import Array

LENGTHS = {"mm": 1e-3, "cm": 1e-2, "dm": 1e-1, "m": 1.0}
"""Units that markers come in [m]."""

RATES = (1.0, 1e4)
"""Lowest and highest frame rate of a camera [Hz]; others are damage."""

MOST_FRAMES = 100_000
"""Frames of a file at most: the rig takes 2 GB of memory then, a bake 6 GB."""


@dataclass(frozen=True)
class Plate:
    """Measurements of a force plate, in the laboratory's axes.

    Attributes
    ----------
    corners : (4, 3) float array
        Of its surface [m].
    rate : float
        Samples per second [Hz].
    force : (S, 3) float array
        Of the plate on the foot, once `joint_centres.captured_body` has read it [N].
    moment : (S, 3) float array
        About the middle of the surface [N·m].
    """

    corners: Array
    rate: float
    force: Array
    moment: Array

    @property
    def normal(self) -> Array:
        """Unit vector perpendicular to the surface, (3,)."""
        across = np.cross(self.corners[0] - self.corners[1], self.corners[0] - self.corners[3])
        return np.asarray(across / np.linalg.norm(across))

    def centre_of_pressure(self) -> Array:
        """Point of the surface at which the force acts, (S, 3) [m]; NaN where nothing presses."""
        pressing = self.force @ self.normal
        with np.errstate(divide="ignore", invalid="ignore"):
            arm = np.cross(self.normal, self.moment) / pressing[:, None]
        return np.asarray(self.corners.mean(axis=0) + np.where(np.isfinite(arm), arm, np.nan))


@dataclass(frozen=True)
class Capture:
    """Markers over time, and the plates that were stepped on.

    Attributes
    ----------
    labels : tuple of str
        Names of the markers.
    points : (F, M, 3) float array
        Their positions in the laboratory's axes [m]; NaN where a marker was not seen.
    rate : float
        Frames per second [Hz].
    first_frame : int
        Number of the first frame.
    """

    labels: tuple[str, ...]
    points: Array
    rate: float
    first_frame: int = 1
    plates: tuple[Plate, ...] = ()

    def __post_init__(self) -> None:
        if not self.labels or not len(self.points):
            raise InputError("the file holds no markers: record or export it with its trajectories", "no_markers")


def check_length(frames: int, rate: float) -> None:
    """Raise InputError for more frames than `MOST_FRAMES`, or a rate [Hz] beyond `RATES`; before arrays are made."""
    low, high = RATES
    if not low <= rate <= high:
        raise InputError(f"a frame rate of {rate:g} Hz is not {low:g} to {high:,.0f} Hz", "frame_rate", rate=rate)
    if frames > MOST_FRAMES:
        message = f"the file has {frames:,} frames, over {MOST_FRAMES:,}: export fewer"
        raise InputError(message, "too_many_frames", frames=frames)


def bridged(path: Array) -> Array:
    """A path (F, 3) with straight lines where the marker was lost; one that was never seen stays as it is."""
    seen = np.isfinite(path).all(axis=1)
    if seen.all() or not seen.any():
        return path
    frames = np.arange(len(path))
    return np.stack([np.interp(frames, frames[seen], column[seen]) for column in path.T], axis=1)


def metres(unit: str) -> float:
    """Length of a unit [m].

    Raises
    ------
    InputError
        For a unit that is not one of `LENGTHS`.

    Examples
    --------
    >>> metres(" mm ")
    0.001
    """
    try:
        return LENGTHS[unit.strip().lower()]
    except KeyError:
        raise InputError(
            f"the unit of length is {unit!r}, not {', '.join(LENGTHS)}", "unknown_unit", unit=unit
        ) from None
