"""Soles as rigid patches, and how they move."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from ..numerics.interpolation import Between, cubic, in_stretches, turning
from .props import Prop

COARSER = 4.0
"""How much coarser the cells are at most, along the longest sole, than the preset says, for those along the shortest to
be as it says."""


def shortest_length(lengths: Iterable[float]) -> float:
    """Length of the shortest of some soles by which cells are sized [m]: a fingertip beside a trunk sizes none.

    Examples
    --------
    >>> shortest_length([0.27, 0.19]), shortest_length([0.4, 0.003])
    (0.19, 0.1)
    """
    known = list(lengths)
    return max(min(known), max(known) / COARSER)


@dataclass(frozen=True)
class SolePatch:
    """The underside of one rigid piece of a sole, as two maps over a regular grid.

    The patch frame has x toward the toes, y left and z up when the foot is planted, with z = 0 at the underside's
    lowest point. Node (row, column) of a map is at x = origin[0] + column·spacing, y = origin[1] + row·spacing.

    Attributes
    ----------
    heights : (rows, columns) float array
        Height of the underside in the patch frame [m], continued smoothly outside the outline.
    signed_distance : (rows, columns) float array
        Distance to the patch's outline [m], negative inside.
    origin : (2,) float array
        Position of node (0, 0) [m].
    spacing : float
        Distance between nodes [m].
    """

    heights: Array
    signed_distance: Array
    origin: Array
    spacing: float

    @property
    def area(self) -> float:
        """Area inside the outline [m²], with edge nodes counted by their covered fraction."""
        return float(np.clip(0.5 - self.signed_distance / self.spacing, 0.0, 1.0).sum() * self.spacing**2)

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Lower and upper corner (x, y, height) of the underside within the outline, and a node around it [m]."""
        row, column = np.nonzero(self.signed_distance <= self.spacing)
        x, y = self.origin[0] + column * self.spacing, self.origin[1] + row * self.spacing
        points = np.stack([x, y, self.heights[row, column]])
        return points.min(axis=1), points.max(axis=1)


@dataclass(frozen=True)
class Sole:
    """One contact shape: a foot, a hand, a snowshoe.

    Attributes
    ----------
    name : str
        What the user sees, e.g. "foot.L".
    side : str
        "L", "R" or "" for neither.
    patches : tuple of SolePatch
        Rigid pieces from back to front, e.g. (foot, toes); their seams overlap a little, so that a bend leaves no gap.
    landmarks : (L, 3) float array
        Points of the underside that contact detection follows, from back to front (heel, ball, toe tip) [m], each in
        the frame of its patch.
    landmark_patch : (L,) int array
        Index of the patch that each landmark belongs to.
    outline : (N, 2) float array
        The flat sole's outline in the frame of the first patch [m], counter-clockwise, for drawing.
    prop : Prop or None
        The whole surface, in place of patches, of what prints by whatever faces down; its frame is that of the one
        pose that it has.
    underside : (N, M) float array or None
        Heights of the flat sole's mesh from heel to toes and from left to right [m], infinite where there is none;
        None where it is of no mesh.
    bend : float
        How far behind and before the seam of two pieces the skin moves with both [m].
    """

    name: str
    side: str
    patches: tuple[SolePatch, ...]
    landmarks: Array
    landmark_patch: NDArray[np.intp]
    outline: Array
    prop: Prop | None = None
    underside: Array | None = None
    bend: float = 0.0

    @property
    def area(self) -> float:
        """Area of the flat sole [m²], from its outline (shoelace formula)."""
        x, y = self.outline.T
        return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)

    @property
    def length(self) -> float:
        """Length of the flat sole from heel to toe tip [m]."""
        return float(np.ptp(self.outline[:, 0]))

    @property
    def breadth(self) -> float:
        """Breadth of the flat sole from side to side [m]."""
        return float(np.ptp(self.outline[:, 1]))


@dataclass(frozen=True)
class SoleMotion:
    """A sole and the rigid pose of each of its patches over time.

    Attributes
    ----------
    transforms : (F, P, 4, 4) float array
        Patch frame to world, rotation and translation only [m]; of the one frame of a prop.
    bears : (F,) bool array or None
        When the skin under it bears on level ground, where that was seen.
    """

    sole: Sole
    transforms: Array
    bears: NDArray[np.bool_] | None = None

    def landmark_positions(self) -> Array:
        """World positions of the sole's landmarks, (F, L, 3) [m]; computed once, not to be written to."""
        return self._landmark_positions

    @cached_property
    def _landmark_positions(self) -> Array:
        patch, (x, y, z) = self.sole.landmark_patch, self.sole.landmarks.T[..., None]

        def during(steps: slice) -> Array:
            pose = self.transforms[steps][:, patch, :3]
            return np.asarray(pose[..., 0] * x + pose[..., 1] * y + pose[..., 2] * z + pose[..., 3])

        positions = in_stretches(during, len(self.transforms))
        positions.flags.writeable = False
        return positions

    def lowest(self) -> Array:
        """Height of the sole's lowest point, (F,) [m]; of a foot, of its lowest landmark."""
        if self.sole.prop is None:
            return np.asarray(self.landmark_positions()[..., 2].min(axis=1))
        pose = self.transforms[:, 0]
        return np.asarray((pose[:, 2, :3] @ self.sole.prop.probes.T).min(axis=1) + pose[:, 2, 3])

    def at(self, position: Array) -> SoleMotion:
        """The motion at fractional sample indices (K,), those of its samples exactly.

        Between samples a foot moves along a C1 cubic; a prop turns evenly about the shortest way and moves straight,
        so that what rolls keeps its shape and what stops at once does not swing past.
        """
        method = turning if self.sole.prop else _rigid_cubic
        bears = None if self.bears is None else self.bears[np.rint(position).astype(np.intp)]
        return dataclasses.replace(self, transforms=_between(self.transforms, position, method), bears=bears)

    def of(self, samples: slice | NDArray[np.bool_] | NDArray[np.intp]) -> SoleMotion:
        """Some of the samples."""
        bears = None if self.bears is None else self.bears[samples]
        return dataclasses.replace(self, transforms=self.transforms[samples], bears=bears)


def _between(samples: Array, position: Array, method: Callable[[Array, Array], Array]) -> Array:
    """Samples at positions between them, for all who look at them an array."""
    return cast(Array, Between(samples, position, method))


def _rigid_cubic(poses: Array, position: Array) -> Array:
    """Rigid poses along cubics."""
    return orthonormal(cubic(poses, position))


def orthonormal(transforms: Array) -> Array:
    """Nearly rigid transforms made rigid: one Newton step of the polar decomposition."""
    rotation = transforms[..., :3, :3]
    gram = np.swapaxes(rotation, -1, -2) @ rotation
    rigid = transforms.copy()
    rigid[..., :3, :3] = rotation @ (1.5 * np.eye(3) - 0.5 * gram)
    rigid[..., 3, :] = (0.0, 0.0, 0.0, 1.0)
    return rigid
