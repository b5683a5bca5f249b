"""A contact of a foot: patches that keep their underside press evenly, or so that the force acts where it should."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.sparse_grid import Window
from ..ground.variation import Factors, layer_factors
from ..imprints.sole_imprint import PatchOverCells, cell_coverage, patches_over_cells
from ..imprints.sole_points import (
    PointContact,
    SolePoints,
    centroid,
    contact_window,
    places,
    point_contact,
    touching_fraction,
)
from ..motion.sole_motion import Sole
from ..numerics.arrays import Array
from ..record.contact_steps import Steps
from .contact_layout import ContactLayout
from .deformation import Sinking, compression_rate, sink, target_compression
from .ground_cells import GroundCells, Imprints, Loads, UndisturbedCells
from .plate import Plate, plate_of
from .pressure import pressure_field, spread_out
from .rim import in_contact, rim_weights, whole_reach


class SoleLayout(ContactLayout):
    """A contact of a foot: patches that keep their underside, tilted a little at most.

    Parameters
    ----------
    steps : Steps
        All of the contact.
    points : SolePoints
        Of that sole.
    """

    def __init__(self, character: str, sole: Sole, steps: Steps, points: SolePoints, *, strength: float = 1.0) -> None:
        self.points = points
        self._width = points.width
        self._remembered, self._under = cache(self._posed), cache(self._cells_under)
        super().__init__(character, sole, steps, strength=strength)

    def _window(self, start: int, end: int, cells: GroundCells) -> Window:
        return self._under(start, end, cells.cell_size).expanded(whole_reach(cells.rim_reach))

    def _cells_under(self, start: int, end: int, cell_size: float) -> Window:
        """The cells that it may touch in these steps."""
        return contact_window(self.points, self.steps.poses[start - self.first : end - self.first], cell_size)

    def _lay_out(
        self, start: int, end: int, window: Window, cells: GroundCells, step: float, sinkage: float
    ) -> Imprints:
        steps, points, material = slice(start - self.first, end - self.first), self.points, cells.material
        poses = self.steps.poses[steps]
        posed = self._remembered if self.remembers else self._posed
        over_ground, patches = posed(start, end, window, cells.undisturbed)
        divisions = points.cell_divisions(cells.cell_size)
        upright = self.steps.normals[steps, 2, None]
        area = (over_ground.area + over_ground.beyond) / upright
        factors = cells.factors(window)
        landing_speed, firmness = self._landing_drop / step, material.firmness(self._width)
        softness = None
        if factors:
            softness = self._softness(factors, window, poses, cells)
        plate = self._plate(cells, step, landing_speed)
        sinking = sink(
            over_ground.clearance,
            area,
            self.force[steps],
            tolerance=points.tolerance,
            step=step,
            material=material,
            sinkage=sinkage,
            landing_speed=landing_speed,
            firmness=firmness,
            softness=softness,
            plate=plate,
        )
        fraction = touching_fraction(over_ground.clearance, sinking.sinkage[:, None], points.tolerance)
        printing = over_ground.area / upright * fraction
        pressing = (sinking.target > 0) & printing.any(axis=1)
        coverage = cell_coverage(
            patches,
            window.refined(divisions),
            sinkage=sinking.sinkage,
            tolerance=points.tolerance,
            divisions=divisions,
        )
        contact = in_contact(coverage)
        toward = material.rim_bias * self.lean[steps] if material.rim_bias else None
        rim = np.zeros(coverage.shape)
        if material.poisson_ratio:
            rim = rim_weights(coverage, contact, cells.rim_reach, cells.surface(window).bears, toward)
        rate = compression_rate(step, material, sinking.target, landing_speed, plate)
        # Of the pressure on a plate, the highest counts wherever it is.
        under = window if plate else self._under(start, end, cells.cell_size)
        stress = self._stress(steps, under, cells, sinking, area * fraction, plate)
        if factors and stress.ndim == 1:
            stress = stress[:, None, None]
        target = sinking.target
        holds = stress < material.crust_stress if material.crust_stress else None
        if stress.ndim > 1:
            inside = window.slices(under)
            of_cells = {name: of[inside] for name, of in layer_factors(factors).items()}
            target = target_compression(stress, material, firmness=firmness, **of_cells)
            target = _over_all(plate.depth(target) if plate else target, inside, coverage.shape)
            holds = None if holds is None else _over_all(holds, inside, coverage.shape)
        return Imprints(
            start,
            1,
            window,
            coverage,
            contact,
            rim,
            pressing,
            target,
            np.broadcast_to(rate, sinking.target.shape),
            holds,
            factors,
            sinking.reached,
            Loads(
                np.where(pressing, self.force[steps], 0.0),
                printing.sum(axis=1),
                self._middle(poses, over_ground, printing),
            ),
            material,
            cells.made_of,
        )

    def _plate(self, cells: GroundCells, step: float, landing_speed: float) -> Plate | None:
        """The plate that the sole is throughout the contact, if even pressure would press it so deep."""
        material, heaviest = cells.material, int(self.force.argmax())
        firmness = material.firmness(self._width)
        target = target_compression(self.force / self.points.area, material, firmness=firmness)
        rate = compression_rate(step, material, target, landing_speed)
        softness = 1.0
        window = self._window(self.first + heaviest, self.first + heaviest + 1, cells)
        if factors := cells.factors(window):
            softness = float(self._softness(factors, window, self.steps.poses[heaviest, None], cells).mean())
        return plate_of(self.points, target, rate, softness)

    def _softness(self, factors: Factors, window: Window, poses: Array, cells: GroundCells) -> Array:
        """Compression of the ground under each point of the posed sole per that of the material, (N, Q)."""
        return factors.softness(cells.material.exponent)[
            window.cells_under(*places(self.points, poses), cells.cell_size)
        ]

    def _posed(
        self, start: int, end: int, window: Window, cells: UndisturbedCells
    ) -> tuple[PointContact, list[PatchOverCells]]:
        """The sole over the undisturbed ground at these steps: its points, and its patches over the cells."""
        points, poses = self.points, self.steps.poses[start - self.first : end - self.first]
        ground = cells.surface(window, points.cell_divisions(cells.cell_size))
        contact = point_contact(points, poses, ground)
        lowest, tolerance = contact.lowest, points.tolerance
        return contact, list(patches_over_cells(self.sole, poses, ground, lowest=lowest, tolerance=tolerance))

    def _middle(self, poses: Array, over_ground: PointContact, touching: Array) -> Array:
        """Middle of the pressure at each step, on the undisturbed ground, (N, 3) [m]."""
        middle = centroid(self.points, poses, touching)
        above = (touching * over_ground.clearance).sum(axis=1) / np.maximum(touching.sum(axis=1), 1e-300)
        middle[:, 2] -= over_ground.lowest + above
        return middle

    def _stress(
        self,
        steps: slice,
        window: Window,
        cells: GroundCells,
        sinking: Sinking,
        touching: Array,
        plate: Plate | None,
    ) -> Array:
        """Normal stress at each of N steps, (N,) [Pa]; where the pressure rolls, of each cell, (N, rows, columns)."""
        stress = np.divide(self.force[steps], sinking.area, out=np.zeros(len(sinking.area)), where=sinking.target > 0)
        if cells.ground.pressure != "CENTRE_OF_PRESSURE":
            return stress
        x, y = places(self.points, self.steps.poses[steps])
        field = pressure_field(x, y, touching, self.steps.centres[steps, :2], self.points.tolerance)
        relative = field.over(*window.centres(cells.cell_size))
        if plate:
            plate.level(relative)
        if cells.material.spread:
            spread_out(relative, cells.material.spread * sinking.sinkage / self._length)
        over_cells: Array = stress[:, None, None] * relative
        return over_cells

    @property
    def _length(self) -> float:
        return self.points.length

    def _middles(self, poses: Array) -> Array:
        area = np.concatenate([patch.area for patch in self.points.patches])
        return centroid(self.points, poses, area[None])


def _over_all(values: NDArray[Any], part: tuple[slice, slice], shape: tuple[int, ...]) -> NDArray[Any]:
    """Values of a part of the cells at each of N steps, over all cells (N, rows, columns): 0 beyond it."""
    whole = np.zeros(shape, values.dtype)
    whole[:, *part] = values
    return whole
