"""Force plates of a C3D file: from the raw channels of each make to the force on the foot.

References
----------
The C3D file format, a technical user manual, "Force platform parameters": types 1 to 4, corners, origins and channels.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array
from .c3d_parameters import Parameters
from .captured import LENGTHS, Plate

_CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}
"""Channels of the types of plates that are read; pressure mats and plates with tables of their own are not."""


def plates_of(analog: Array, rate: float, parameters: Parameters, unit: float) -> tuple[Plate, ...]:
    """The plates of a file; those of types that are not read, or whose channels are missing, are left out.

    Parameters
    ----------
    analog : (S, channels) float array
        In the units of the channels.
    rate : float
        Samples per second [Hz].
    parameters : Parameters
        Of the file.
    unit : float
        Of lengths in the file [m].
    """
    used = int(parameters.number("FORCE_PLATFORM", "USED"))
    types = parameters.array("FORCE_PLATFORM", "TYPE").ravel()
    corners = parameters.array("FORCE_PLATFORM", "CORNERS")
    origins = parameters.array("FORCE_PLATFORM", "ORIGIN")
    channels = parameters.array("FORCE_PLATFORM", "CHANNEL")
    calibrations = parameters.array("FORCE_PLATFORM", "CAL_MATRIX")
    units = parameters.texts("ANALOG", "UNITS")
    plates = []
    most = analog.shape[1] // min(_CHANNELS.values())  # each has channels of its own
    for index in range(min(used, len(types), corners.size // 12, origins.size // 3, most) if channels.size else 0):
        kind = int(types[index])
        count = _CHANNELS.get(kind, 0)
        wanted = channels.reshape(-1, used, order="F")[:count, index].astype(int) - 1
        if not count or len(wanted) < count or wanted.min() < 0 or wanted.max() >= analog.shape[1]:
            continue
        surface = corners.reshape(3, 4, -1, order="F")[:, :, index].T * unit
        if not np.linalg.norm(np.cross(surface[0] - surface[1], surface[0] - surface[3])) > 0:
            continue
        signals = analog[:, wanted]
        if kind == 4:
            signals = signals @ calibrations.reshape(6, 6, -1, order="F")[:, :, index].T
        lever = _length_of_moment([units[channel] if channel < len(units) else "" for channel in wanted], unit)
        origin = origins.reshape(3, -1, order="F")[:, index] * unit
        force, moment = _at_surface(kind, signals, origin, lever)
        plates.append(_in_laboratory(surface, force, moment, rate))
    return tuple(plates)


def _length_of_moment(units: list[str], unit: float) -> float:
    """Metres in the length of the channels' moments, which are in Nmm where points are in mm unless they say so."""
    for text in units:
        length = text.strip().lower().lstrip("n").lstrip(".·* ")
        if text.strip().lower().startswith("n") and length in LENGTHS:
            return LENGTHS[length]
    return unit


def _at_surface(kind: int, signals: Array, origin: Array, lever: float) -> tuple[Array, Array]:
    """Force (S, 3) [N] and moment (S, 3) [N·m] in the plate's axes, about the middle of its surface."""
    if kind == 1:  # force, centre of pressure on the surface, free moment
        force = signals[:, :3]
        arm = np.column_stack([signals[:, 3:5] * lever, np.zeros(len(signals))])
        free = np.column_stack([np.zeros((len(signals), 2)), signals[:, 5] * lever])
        return force, np.asarray(np.cross(arm, force) + free)
    if kind == 3:  # eight piezoelectric sensors; the origin's x and y are their distances from the middle
        x12, x34, y14, y23, z1, z2, z3, z4 = signals.T
        a, b = abs(origin[0]), abs(origin[1])
        force = np.column_stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
        moment = np.column_stack([b * (z1 + z2 - z3 - z4), a * (z2 + z3 - z1 - z4), b * (x34 - x12) + a * (y14 - y23)])
        surface = np.array([0.0, 0.0, -abs(float(origin[2]))])
    else:
        force, moment = signals[:, :3], signals[:, 3:] * lever
        surface = origin if origin[2] <= 0 else -origin  # the surface is above the sensor, and a plate's z points down
    return force, moment - np.cross(surface, force)


def _in_laboratory(corners: Array, force: Array, moment: Array, rate: float) -> Plate:
    """A plate with its force and moment in the laboratory's axes."""
    x = corners[0] + corners[3] - corners[1] - corners[2]
    y = corners[0] + corners[1] - corners[2] - corners[3]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    z = np.cross(x, y)
    axes = np.column_stack([x, np.cross(z, x), z])
    return Plate(corners, rate, force @ axes.T, moment @ axes.T)
