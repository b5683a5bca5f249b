"""A soft ground before anything presses it: its shape, what it is made of, and how it takes a load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..numerics.arrays import Array
from .heightfield import HeightField, Terrain
from .material import STANDARD_GRAVITY, GroundMaterial, Pressure
from .regions import Regions
from .sparse_grid import SparseGrid, Window
from .variation import Variation


class Weathering(Protocol):
    """Effect of weather between one contact and the next; frames are those of the scene."""

    @property
    def reach(self) -> float:
        """Distance within which the ground around a cell acts on it [m]."""
        ...

    def levels(self, frame: float, x: Array, y: Array, /) -> Array | float:
        """Height of open ground at a frame above that without weather, where steps press what fell, at places [m]."""
        ...

    def aged(
        self,
        ground: HeightField,
        window: Window,
        *,
        since: Array,
        trodden: SparseGrid,
        pressed: Array,
        frame: float,
        sections: Mapping[str, float],
    ) -> Array:
        """Compression and rim of cells, as weather has left them by a frame.

        Parameters
        ----------
        ground : HeightField
            As it was left by steps.
        since : (rows, columns) float array
            Frame at which each cell changed last.
        trodden : SparseGrid
            1 in cells that were ever in contact, else 0.
        pressed : (rows, columns) float array
            How far steps compressed each cell, all together [m].
        sections : mapping of str to float
            Volume of a print over its width, by the surface that bears most of it, empty of a ground without regions
            [m²]; as far as known.

        Returns
        -------
        (2, rows, columns) float array
        """
        ...


@dataclass(frozen=True)
class SoftGround:
    """Ground that a simulation presses.

    Attributes
    ----------
    terrain : Terrain
        The undisturbed ground.
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'
        How the force on a sole spreads over its contact.
    variation : Variation or None
        How the ground varies from place to place.
    weathering : Weathering or None
        What steps find of earlier ones; None where these stay as they are.
    gravity : float
        [m/s²].
    regions : Regions or None
        Where it is made of something else than `material`; None where it is all the same.
    """

    terrain: Terrain
    material: GroundMaterial
    pressure: Pressure = "UNIFORM"
    variation: Variation | None = None
    weathering: Weathering | None = None
    gravity: float = STANDARD_GRAVITY
    regions: Regions | None = None

    @property
    def slides(self) -> bool:
        """True if it has an angle of repose somewhere."""
        kinds = self.regions.kinds if self.regions else ()
        return any(material.repose_angle for material in (self.material, *(kind.material for kind in kinds)))

    def materials_under(self, window: Window, cell_size: float) -> list[GroundMaterial]:
        """Materials under a window of cells of that side [m]."""
        if self.regions is None:
            return [self.material]
        return [self.regions.kinds[number].material for number in self.regions.under(window, window, cell_size)[0]]

    def layer_depths(self, window: Window, cell_size: float) -> Array | float:
        """Depth of the loose layer in the cells of a window, (rows, columns) or of all of them [m]."""
        if self.regions is None:
            return self.material.layer_depth
        numbers, shares = self.regions.under(window, window, cell_size)
        depths = np.array([self.regions.kinds[number].material.layer_depth for number in numbers])
        return float(depths[0]) if shares is None else np.asarray(np.tensordot(depths, shares, 1))
