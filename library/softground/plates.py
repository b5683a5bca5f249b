"""What force plates show of each foot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._core.capture.captured import Plate
from ._core.numerics.intervals import runs
from .body import Body

Array = NDArray[np.float64]

LOADED = 20.0
"""A plate is loaded above this vertical force [N]."""


@dataclass(frozen=True)
class PlateLoads:
    """What plates show of the left and the right foot at the frames of a body.

    Attributes
    ----------
    force : (F, 2, 3) float array
        [N]
    centre_of_pressure : (F, 2, 3) float array
        [m], NaN but where one plate bears the foot.
    free_moment : (F, 2) float array
        [N·m], likewise.
    """

    force: Array
    centre_of_pressure: Array
    free_moment: Array


def plates_on_feet(body: Body) -> PlateLoads:
    """What the plates of a body show of its feet.

    A plate that is stepped on is taken to bear the foot that is nearest to its centre of pressure during that step.

    Parameters
    ----------
    body : Body
        Of joint centres, with a left and a right foot.
    """
    feet = [sole.landmark_positions()[:, :2].mean(axis=1) for sole in body.motion.soles[:2]]  # from heel to ball
    count = len(feet[0])
    forces, plates = np.zeros((count, 2, 3)), np.zeros((count, 2))
    centres, moments = np.full((count, 2, 3), np.nan), np.full((count, 2), np.nan)
    for plate in body.plates:
        averaged = _at_frames(plate, body.rate, count)
        force, centre, moment = averaged.force, averaged.centre_of_pressure(), free_moment(averaged)
        for first, last in zip(*runs(force[:, 2] > LOADED), strict=True):
            step = slice(first, last)
            away = [np.linalg.norm((centre - foot)[step, :2], axis=1) for foot in feet]
            nearest = int(np.argmin([np.nanmean(distance) for distance in away]))
            forces[step, nearest] += force[step]
            plates[step, nearest] += 1
            centres[step, nearest], moments[step, nearest] = centre[step], moment[step]
    centres[plates != 1], moments[plates != 1] = np.nan, np.nan
    return PlateLoads(forces, centres, moments)


def free_moment(plate: Plate) -> Array:
    """Moment of a plate about its normal at the centre of pressure, (S,) [N·m]; NaN where nothing presses."""
    arm = plate.centre_of_pressure() - plate.corners.mean(axis=0)
    return np.asarray((plate.moment - np.cross(arm, plate.force)) @ plate.normal)


def _at_frames(plate: Plate, rate: float, count: int) -> Plate:
    """A plate whose samples are averaged over each frame; what it did not record is no force."""
    samples = max(round(plate.rate / rate), 1)
    values = []
    for recorded in (plate.force, plate.moment):
        kept = np.zeros((count * samples, 3))
        kept[: len(recorded)] = recorded[: len(kept)]
        values.append(kept.reshape(count, samples, 3).mean(axis=1))
    return Plate(plate.corners, rate, *values)
