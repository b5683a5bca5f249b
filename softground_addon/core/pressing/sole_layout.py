"""A stance of a foot: patches that keep their underside press evenly, or so that the force acts where it should."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Window
from ..ground.variation import layer_factors
from ..motion.motion import Sole
from .contact_layout import Stance, Steps
from .deformation import Sinking, compression_rate, sink, target_compression, touching_fraction
from .ground_cells import Bed, Imprints
from .pressure import pressure_field
from .rim import in_contact, rim_weights, whole_reach
from .sole_imprint import cell_coverage
from .sole_points import PointContact, SolePoints, centroid, contact_window, places, point_contact

Array = NDArray[np.float64]


class SoleLayout(Stance):
    """A stance of a foot: patches that keep their underside, tilted a little at most.

    Parameters
    ----------
    character : str
    sole : Sole
    steps : Steps
        All of the stance.
    points : SolePoints
        Of that sole.
    """

    def __init__(self, character: str, sole: Sole, steps: Steps, points: SolePoints) -> None:
        self.points = points
        super().__init__(character, sole, steps)

    def _window(self, start: int, end: int, bed: Bed) -> Window:
        window = contact_window(self.points, self._steps.poses[start - self.first : end - self.first], bed.cell_size)
        return window.expanded(whole_reach(bed.rim_reach))

    def _lay_out(self, start: int, end: int, window: Window, bed: Bed, step: float) -> Imprints:
        steps, points, material = slice(start - self.first, end - self.first), self.points, bed.material
        poses = self._steps.poses[steps]
        divisions = points.cell_divisions(bed.cell_size)
        cells = bed.surface(window)
        ground = bed.surface(window, divisions) if divisions > 1 else cells
        over_ground = point_contact(points, poses, ground)
        area = over_ground.area / self._steps.normals[steps, 2, None]
        factors = bed.factors(window)
        landing_speed = self._descent / step
        sinking = sink(
            over_ground.clearance,
            area,
            self._force[steps],
            tolerance=points.tolerance,
            step=step,
            material=material,
            sinkage=self._sinkage,
            landing_speed=landing_speed,
            softness=factors.softness[window.cells_under(*places(points, poses), bed.cell_size)] if factors else None,
        )
        self._sinkage = sinking.reached
        touching = area * touching_fraction(over_ground.clearance, sinking.sinkage[:, None], points.tolerance)
        self._add_up(steps, over_ground, sinking, touching)
        coverage = cell_coverage(
            self.sole,
            poses,
            ground,
            lowest=over_ground.lowest,
            sinkage=sinking.sinkage,
            tolerance=points.tolerance,
            divisions=divisions,
        )
        contact = in_contact(coverage)
        toward = material.rim_bias * self.lean[steps] if material.rim_bias else None
        rim = rim_weights(coverage, contact, bed.rim_reach, cells.bears, toward)
        rate = compression_rate(step, material, sinking.target, landing_speed)
        stress = self._stress(steps, window, bed, sinking, touching)
        if factors and stress.ndim == 1:
            stress = stress[:, None, None]
        target = sinking.target
        if stress.ndim > 1:
            target = target_compression(stress, material, **layer_factors(factors))
        return Imprints(
            start,
            1,
            window,
            coverage,
            contact,
            rim,
            sinking.target > 0,
            target,
            np.broadcast_to(rate, sinking.target.shape),
            stress < material.crust_stress if material.crust_stress else None,
            factors,
            sinking.sinkage,
        )

    def _add_up(self, steps: slice, over_ground: PointContact, sinking: Sinking, touching: Array) -> None:
        """Add what these steps press to the footprint: how large the contact is, and the middle of the load."""
        load = self._load_at(steps, sinking)
        middle = centroid(self.points, self._steps.poses[steps], touching)
        above = (touching * over_ground.clearance).sum(axis=1) / np.maximum(touching.sum(axis=1), 1e-300)
        middle[:, 2] -= over_ground.lowest + above
        self._area = max(self._area, float(sinking.area[load > 0].max(initial=0.0)))
        self._moment += load @ middle
        self._load += float(load.sum())

    def _stress(self, steps: slice, window: Window, bed: Bed, sinking: Sinking, touching: Array) -> Array:
        """Normal stress at each of N steps, (N,) [Pa]; where the pressure rolls, of each cell, (N, rows, columns)."""
        stress = np.divide(
            self._load_at(steps, sinking), sinking.area, out=np.zeros(len(sinking.area)), where=sinking.target > 0
        )
        if bed.ground.pressure != "CENTRE_OF_PRESSURE":
            return stress
        x, y = places(self.points, self._steps.poses[steps])
        field = pressure_field(x, y, touching, self._steps.centres[steps, :2], self.points.tolerance)
        over_cells: Array = stress[:, None, None] * field.over(*window.centres(bed.cell_size))
        return over_cells

    def _load_at(self, steps: slice, sinking: Sinking) -> Array:
        """Force on the ground at these steps, (N,) [N]: none where it gives no way."""
        load: Array = self._force[steps] * (sinking.target > 0)
        return load

    @property
    def _length(self) -> float:
        return self.points.length

    def _middles(self, poses: Array) -> Array:
        area = np.concatenate([patch.area for patch in self.points.patches])
        return centroid(self.points, poses, area[None])
