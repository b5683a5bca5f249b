"""Files of motion capture as bodies."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from . import bvh
from ._core.capture import amass, c3d, trc
from ._core.capture.captured import Capture
from ._core.capture.joint_centres import UPWARD, CapturedBody, captured_body
from ._core.errors import InputError
from ._core.files import files
from .body import Body
from .static_trial import with_static

LARGEST = 2**29
"""Size of a file that is read [bytes]."""

_MASSES = ("BODYMASS", "MASS", "WEIGHT")
"""Parameters of a C3D file that hold the subject's mass [kg]."""

PathLike = str | os.PathLike[str]


def read_c3d(
    path: PathLike, *, mass: float | None = None, up: str | None = None, static: PathLike | None = None
) -> Body:
    """The body in a C3D file of markers, with its force plates.

    Parameters
    ----------
    path : path
    mass : float, optional
        [kg]; as the file says, or else that of a person of this size, if not given.
    up : str, optional
        The laboratory's upward axis: X, Y, Z, -X, -Y or -Z; the one along which the pelvis is above the feet if not
        given.
    static : path, optional
        C3D or TRC file of the same subject standing, with the markers that this one lacks: they follow the nearest
        cluster of markers that both have.

    Raises
    ------
    InputError
        If a file cannot be read, or holds no markers of two legs.

    References
    ----------
    The C3D file format, a technical user manual (c3d.org). Joint centres: Harrington et al. 2007,
    10.1016/j.jbiomech.2006.02.003; de Leva 1996, 10.1016/0021-9290(96)00021-8. Static trials: Cappozzo et al. 1995,
    10.1016/0268-0033(95)91394-T.
    """
    content = content_of(path)
    known = c3d_mass(content) if mass is None else mass
    return _marked(path, c3d.read(content), known, up, static)


def read_trc(
    path: PathLike, *, mass: float | None = None, up: str | None = None, static: PathLike | None = None
) -> Body:
    """The body in a TRC file of markers.

    Parameters
    ----------
    path : path
    mass : float, optional
        [kg]; that of a person of this size if not given.
    up, static
        As for `read_c3d`.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no markers of two legs.

    References
    ----------
    OpenSim documentation, "Marker (.trc) Files".
    """
    return _marked(path, trc.read(content_of(path)), mass, up, static)


def read_amass(path: PathLike, *, mass: float | None = None) -> Body:
    """The body in an AMASS archive of SMPL poses, of average proportions.

    Parameters
    ----------
    path : path
    mass : float, optional
        [kg]; that of a person of this size if not given.

    Raises
    ------
    InputError
        If the file cannot be read, or is no such archive.

    References
    ----------
    Mahmood et al. 2019, "AMASS: archive of motion capture as surface shapes", 10.1109/ICCV.2019.00554.
    """
    return _captured(path, amass.read(content_of(path)), mass)


def read_bvh(path: PathLike, *, mass: float | None = None, up: str | None = None, scale: float | None = None) -> Body:
    """The body in a BVH file, by the names of its bones.

    Parameters
    ----------
    path : path
    mass : float, optional
        [kg]; that of a person of this size if not given.
    up : str, optional
        The file's upward axis: X, Y, Z, -X, -Y or -Z; the one along which the hips are above the feet if not given.
    scale : float, optional
        Metres per unit of the file; told by the size of the body if not given.

    Raises
    ------
    InputError
        If the file cannot be read, or no feet are found among its bones.
    """
    skeleton = bvh.read(content_of(path), up=up, scale=scale)
    return Body.from_skeleton(skeleton, up="Z", mass=mass, name=Path(path).stem)


def content_of(path: PathLike) -> bytes:
    """The bytes of a file; raises InputError if it cannot be read."""
    try:
        return files.read_regular(Path(path), LARGEST)
    except OSError as error:
        raise InputError(
            f"'{path}' cannot be read ({error.strerror}): choose another file", "unreadable_file", path=Path(path)
        ) from error


def c3d_mass(content: bytes) -> float | None:
    """Mass of the subject by the parameters of a C3D file [kg]; None where they do not say."""
    values = c3d.parameters(content).values
    masses = [value for (_, name), value in values.items() if name in _MASSES and isinstance(value, np.ndarray)]
    return float(masses[0].flat[0]) if masses and masses[0].size and masses[0].flat[0] > 0 else None


def _marked(path: PathLike, capture: Capture, mass: float | None, up: str | None, static: PathLike | None) -> Body:
    if up is not None and up not in UPWARD:
        raise InputError(f"up is {up!r}: it must be one of {', '.join(UPWARD)}", "unknown_axis", up=up)
    return _captured(path, body_of_markers(capture, up, static), mass)


def body_of_markers(capture: Capture, up: str | None, static: PathLike | None) -> CapturedBody:
    """The joint centres of a capture, with the markers of a static trial if one is given; parameters and errors are
    those of `read_c3d`."""
    if static is not None:
        is_trc = Path(static).suffix.lower() == ".trc"
        capture = with_static(capture, (trc if is_trc else c3d).read(content_of(static)))
    try:
        return captured_body(capture, up)
    except InputError as error:
        if error.code != "missing_markers" or static is not None:
            raise
        message = f"{error}; or give the static trial that has them, and shares clusters of markers with this one"
        missing, labels = error.facts["missing"], error.facts["labels"]
        raise InputError(message, "missing_markers", missing=missing, labels=labels) from error


def _captured(path: PathLike, body: CapturedBody, mass: float | None) -> Body:
    return Body.from_joints(body.joints, body.rate, up="Z", mass=mass, name=Path(path).stem, plates=body.plates)
