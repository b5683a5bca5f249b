"""Cells of the ground that contacts are laid out on, the steps of time, and the cells that are pressed at each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..ground.hard_ground import bare
from ..ground.heightfield import Surface, TerrainTiles
from ..ground.material import GroundMaterial
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import Window
from ..ground.variation import Factors, VariationTiles
from ..numerics.arrays import Array


@dataclass(frozen=True)
class Timing:
    """Relation between simulation steps and scene frames.

    Attributes
    ----------
    step : float
        Duration of a step [s].
    steps_per_frame : int
        Steps between the frames that are recorded.
    frame_step : float
        Scene frames between the frames that are recorded.
    """

    step: float
    steps_per_frame: int
    frame_step: float


class UndisturbedCells:
    """The undisturbed ground in cells: its surface, and how it varies; looked up once per tile.

    Parameters
    ----------
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, ground: SoftGround, cell_size: float) -> None:
        self.cell_size = cell_size
        self._terrain = bare(ground.terrain)
        self._tiles: dict[int, TerrainTiles] = {}
        self._variation = VariationTiles(ground.variation, cell_size) if ground.variation else None

    def surface(self, window: Window, divisions: int = 1) -> Surface:
        """The ground under a window, its cells divided in so many parts along each side."""
        if divisions not in self._tiles:
            self._tiles[divisions] = TerrainTiles(self._terrain, self.cell_size / divisions)
        return self._tiles[divisions].surface(window.refined(divisions))

    def factors(self, window: Window) -> Factors | None:
        """Variation of the ground over a window; None where it does not vary."""
        return self._variation.factors(window) if self._variation else None


class GroundCells:
    """The ground that soles are laid on, in cells, and how they press on it.

    Parameters
    ----------
    undisturbed : UndisturbedCells
        Its cells as they are before anything presses them.

    Attributes
    ----------
    cell_size : float
        Side of a cell [m].
    surface, factors
        See `UndisturbedCells`.
    material : GroundMaterial
        What the ground is made of, under its gravity.
    made_of : str
        Name of its surface, where a ground has regions.
    """

    def __init__(self, ground: SoftGround, undisturbed: UndisturbedCells, made_of: str = "") -> None:
        self.ground, self.undisturbed, self.cell_size = ground, undisturbed, undisturbed.cell_size
        self.surface, self.factors = undisturbed.surface, undisturbed.factors
        self.material, self.made_of = ground.material.under(ground.gravity), made_of

    @cached_property
    def kinds(self) -> tuple[GroundCells, ...]:
        """The same cells as if the ground were all of each of its kinds."""
        if not self.ground.regions:
            return (self,)
        return tuple(
            GroundCells(replace(self.ground, material=kind.material, regions=None), self.undisturbed, kind.surface)
            for kind in self.ground.regions.kinds
        )

    @cached_property
    def widest(self) -> GroundCells:
        """Those of the kind whose rims reach furthest."""
        return max(self.kinds, key=lambda kind: kind.rim_reach)

    @property
    def rim_reach(self) -> float:
        """Reach of the rim in cells."""
        return self.material.rim_reach / self.cell_size


@dataclass(frozen=True)
class Loads:
    """Load of a sole on the ground, at each of N steps or parts of them.

    Attributes
    ----------
    force : (N,) float array
        Normal force [N], 0 where the ground gives no way.
    area : (N,) float array
        Area of contact [m²].
    middle : (N, 3) float array
        Middle of the pressure, on the undisturbed ground [m].
    """

    force: Array
    area: Array
    middle: Array


@dataclass(frozen=True)
class Imprints:
    """A contact over the cells, at each of N steps from `first` on, or at each of N parts of them.

    Attributes
    ----------
    first : int
        Step of the simulation.
    parts : int
        Number of parts that each step is laid out in: more than one where the sole moves far in a step.
    coverage : (N, rows, columns) float array
        Fraction of each cell that is in contact.
    contact : (N, rows, columns) bool array
        Cells that count as in contact.
    rim : (N, rows, columns) float array
        Shares of the displaced volume.
    pressing : (N,) bool array
        Steps at which there is any pressure on the ground.
    target : (N,) or (N, rows, columns) float array
        Compression that the stress leads to [m]; of each cell where the pressure or the ground varies.
    rate : (N,) or (N, rows, columns) float array
        From `deformation.compression_rate`.
    holds : (N,) or (N, rows, columns) bool array, or None
        Where an unbroken crust carries the stress.
    factors : Factors or None
        How the ground varies over the window.
    reached : float
        How far the ground has given way under the sole's lowest point after the last step [m].
    material : GroundMaterial
        That bears.
    made_of : str
        See `GroundCells`.
    """

    first: int
    parts: int
    window: Window
    coverage: NDArray[np.float32]
    contact: NDArray[np.bool_]
    rim: Array
    pressing: NDArray[np.bool_]
    target: Array
    rate: Array
    holds: NDArray[np.bool_] | None
    factors: Factors | None
    reached: float
    loads: Loads
    material: GroundMaterial
    made_of: str = ""

    @property
    def end(self) -> int:
        """The step after the last."""
        return self.first + len(self.pressing) // self.parts

    @cached_property
    def placed(self) -> NDArray[np.bool_]:
        """Steps at which there is room for the displaced volume, (N,)."""
        room: NDArray[np.bool_] = self.rim.any(axis=(1, 2))
        return room
