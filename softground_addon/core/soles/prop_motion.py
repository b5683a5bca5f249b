"""A rigid object that prints with the surface that faces down, over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..motion.props import mass_properties
from ..motion.sole_motion import SoleMotion
from ..numerics.arrays import Array
from ..numerics.rigid import displacement, nearest_rotation
from .soles import prop_sole

_SAME_SIZE = 0.01
"""Relative change of an object's size over a shot that is still none."""

_FLAT = 1e-9
"""An object whose scale along one axis is smaller than this part of the largest is squashed flat."""


def prop_motion(
    vertices: Array, triangles: NDArray[np.intp], matrices: Array, *, owner: str, name: str, side: str = ""
) -> tuple[SoleMotion, float]:
    """The motion of a surface that prints, and the volume within it [m³].

    Its scale may differ along its axes, mirror or shear it, as long as it stays as it is.

    Parameters
    ----------
    vertices : (V, 3) float array
        In the object's own frame.
    triangles : (T, 3) int array
    matrices : (F, 4, 4) float array
        That frame to the world over time [m].
    owner : str
        The user's name of the object.
    name, side : str
        As in `Sole`.

    Raises
    ------
    InputError
        If its scale is 0 or changes.
    """
    turn = nearest_rotation(matrices[:1, :3, :3])[0]
    stretch = turn.T @ matrices[0, :3, :3]
    sizes = np.linalg.svd(stretch, compute_uv=False)
    if not sizes.min() > _FLAT * max(sizes.max(), 1e-300):
        raise InputError(f"'{owner}' has a scale of zero: set its scale, or that of its parents.", "scale_of_zero")
    rotation = nearest_rotation(matrices[:, :3, :3] @ np.linalg.inv(stretch))
    change = np.abs(matrices[:, :3, :3] - rotation @ stretch).max(axis=(1, 2)) / sizes.max()
    if change.max() > _SAME_SIZE:
        raise InputError(
            f"'{owner}' changes its size or shape, but prints as a rigid body: take the keys off its scale, or let a "
            "child that keeps its size print.",
            "changing_shape",
        )
    vertices = vertices @ stretch.T
    mass = mass_properties(vertices, triangles)
    transforms = displacement(rotation, -mass.centre, matrices[:, :3, 3])
    return SoleMotion(
        prop_sole(vertices - mass.centre, triangles, name=name, side=side), transforms[:, None]
    ), mass.volume
