"""A stance of a foot: patches that keep their underside press evenly, or so that the force acts where it should."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bed import Bed, Imprints
from .deformation import compression_rate, sink, target_compression, touching_fraction
from .heightfield import Window
from .imprint import cell_coverage
from .motion import Sole
from .pressure import pressure_field
from .rim import in_contact, rim_weights, whole_reach
from .sole_points import SolePoints, centroid, contact_window, places, point_contact
from .stance import Stance, Steps

Array = NDArray[np.float64]


class SoleStance(Stance):
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
        poses, force = self._steps.poses[steps], self._force[steps]
        divisions = points.cell_divisions(bed.cell_size)
        cells = bed.surface(window)
        ground = bed.surface(window, divisions) if divisions > 1 else cells
        over_ground = point_contact(points, poses, ground)
        area = over_ground.area / self._steps.normals[steps, 2, None]
        factors = bed.factors(window)
        sinking = sink(
            over_ground.clearance,
            area,
            force,
            tolerance=points.tolerance,
            step=step,
            material=material,
            sinkage=self._sinkage,
            landing_speed=self._descent / step,
            softness=factors.softness[window.cells_under(*places(points, poses), bed.cell_size)] if factors else None,
        )
        self._sinkage = sinking.reached
        pressing = sinking.target > 0
        load = force * pressing
        self._area = max(self._area, float(sinking.area[load > 0].max(initial=0.0)))
        touching = area * touching_fraction(over_ground.clearance, sinking.sinkage[:, None], points.tolerance)
        middle = centroid(points, poses, touching)
        above = (touching * over_ground.clearance).sum(axis=1) / np.maximum(touching.sum(axis=1), 1e-300)
        middle[:, 2] -= over_ground.lowest + above
        self._moment += load @ middle
        self._load += float(load.sum())
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
        rate = np.broadcast_to(
            compression_rate(step, material, sinking.target, self._descent / step), sinking.target.shape
        )
        stress = np.divide(load, sinking.area, out=np.zeros_like(load), where=pressing)
        target = sinking.target
        if bed.ground.pressure == "CENTRE_OF_PRESSURE" or factors:
            stress = stress[:, None, None]
            if bed.ground.pressure == "CENTRE_OF_PRESSURE":
                x, y = places(points, poses)
                centre = self._steps.centres[steps, :2]
                field = pressure_field(x, y, touching, centre, points.tolerance)
                stress = stress * field.over(*window.centres(bed.cell_size))
            varying = {"stiffness": factors.stiffness, "depth": factors.depth} if factors else {}
            target = target_compression(stress, material, **varying)
        holds = stress < material.crust_stress if material.crust_stress else None
        return Imprints(
            start, 1, window, coverage, contact, rim, pressing, target, rate, holds, factors, sinking.sinkage
        )

    @property
    def _length(self) -> float:
        return self.points.length

    def _middles(self, poses: Array) -> Array:
        area = np.concatenate([patch.area for patch in self.points.patches])
        return centroid(self.points, poses, np.broadcast_to(area, (len(poses), len(area))))
