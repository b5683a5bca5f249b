"""A stance of a rigid body: it presses by whatever faces down, as it rolls, slides, tips or rests."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import Surface, Window
from ..ground.material import GroundMaterial
from ..ground.variation import Factors, layer_factors
from ..motion.motion import Sole
from ..motion.props import Prop
from ..numerics.interpolation import turning
from .contact_layout import Stance, Steps
from .deformation import compression_rate
from .ground_cells import Bed, Imprints
from .indentation import stress
from .prop_imprint import ground_under
from .rim import in_contact, rim_weights, whole_reach

Array = NDArray[np.float64]

STRIDE = 1 / 32
"""A body that moves further than this in a step is laid out in parts of the step, in its sizes."""
MOST_PARTS = 32
"""Parts of a step at most."""
FIRST_REACH = 0.05
"""Part of a body that is looked at before it is known how deep it sinks, in its sizes above its lowest point."""
STANDSTILL = 1e-4
"""A body that moves less than this in a step, in its sizes, has no direction of travel."""


class PropLayout(Stance):
    """A body on the ground, from touching it to leaving it.

    Parameters
    ----------
    character : str
    sole : Sole
        With a prop.
    steps : Steps
        All of the stance.
    """

    def __init__(self, character: str, sole: Sole, steps: Steps) -> None:
        assert sole.prop is not None, sole.name
        self.prop: Prop = sole.prop
        self._deepest = 0.0
        super().__init__(character, sole, steps)
        poses, outer = steps.poses[:, 0], self.prop.probes.T
        reach = np.zeros((2, len(poses), 2))
        for k, pose in enumerate(poses):
            if k and (pose == poses[k - 1]).all():
                reach[:, k] = reach[:, k - 1]
            else:
                place = pose[:2, :3] @ outer + pose[:2, 3:]
                reach[:, k] = place.min(axis=1), place.max(axis=1)
        self._reach = reach

    def _window(self, start: int, end: int, bed: Bed) -> Window:
        low, high = self._reach[:, start - self.first : end - self.first]
        half = bed.cell_size / 2
        window = Window.around(low.min(axis=0) - half, high.max(axis=0) + half, bed.cell_size)
        return window.expanded(whole_reach(bed.rim_reach))

    def _parts(self, start: int, end: int, bed: Bed) -> int:
        path = self._between(start, end, 1, before=True)[:, :2, 3]
        furthest = float(np.linalg.norm(np.diff(path, axis=0), axis=1).max(initial=0.0))
        return max(1, min(MOST_PARTS, ceil(furthest / max(bed.cell_size, STRIDE * self.prop.size) - 1e-6)))

    def _lay_out(self, start: int, end: int, window: Window, bed: Bed, step: float) -> Imprints:
        steps, material, cells = slice(start - self.first, end - self.first), bed.material, bed.surface(window)
        parts = self._parts(start, end, bed)
        poses = self._between(start, end, parts)
        force = np.repeat(self._force[steps], parts)
        upright = np.repeat(self._steps.normals[steps, 2], parts)
        factors = bed.factors(window)
        coverage = np.zeros((len(poses), window.rows, window.columns), np.float32)
        target = np.zeros(coverage.shape)
        sinkage, area = np.zeros(len(poses)), np.zeros(len(poses))
        for k, pose in enumerate(poses):
            if k and force[k] == force[k - 1] and upright[k] == upright[k - 1] and (pose == poses[k - 1]).all():
                coverage[k], target[k], sinkage[k], area[k] = (
                    coverage[k - 1],
                    target[k - 1],
                    sinkage[k - 1],
                    area[k - 1],
                )
            else:
                hollow = self._hollow(pose, force[k], cells, material, factors)
                coverage[k], target[k], sinkage[k] = hollow.coverage, hollow.compression, hollow.sinkage
                area[k] = hollow.area / upright[k]
            self._moment += force[k] * _middle(coverage[k] * target[k], cells)
        pressing = sinkage > 0
        load = force * pressing
        self._load += float(load.sum())
        self._area = max(self._area, float(area[load > 0].max(initial=0.0)))
        contact = in_contact(coverage)
        toward = material.rim_bias * self.lean[steps].repeat(parts, axis=0) if material.rim_bias else None
        rim = rim_weights(coverage, contact, bed.rim_reach, cells.bears, toward)
        rate = np.broadcast_to(compression_rate(step / parts, material, sinkage, self._descent / step), sinkage.shape)
        holds = None
        if material.crust_stress:
            holds = stress(target, material, **layer_factors(factors)) < material.crust_stress
        return Imprints(
            start, parts, window, coverage, contact, rim, pressing, target, rate, holds, factors, sinkage[::parts]
        )

    def _toward(self, step: int) -> Array:
        """The way that the body moves; of one that stands, its own x axis."""
        pose = self._steps.poses[step, 0]
        before = np.concatenate([self._steps.approach[-1:], self._steps.poses])[max(0, step)]
        travel: Array = pose[:2, 3] - before[0, :2, 3]
        return travel if np.linalg.norm(travel) > STANDSTILL * self.prop.size else pose[:2, 0]

    @property
    def _length(self) -> float:
        return self.prop.size

    def _middles(self, poses: Array) -> Array:
        middle: Array = poses[:, 0, :3, 3]
        return middle

    def _between(self, start: int, end: int, parts: int, *, before: bool = False) -> Array:
        """Poses (N, 4, 4) of these steps, each in so many parts; with that of the step before, if asked."""
        known = np.concatenate([self._steps.approach[-1:], self._steps.poses])[:, 0]
        first = len(known) - len(self._steps.poses) + start - self.first  # where `start` is among them
        at = first - 1 + np.arange(0 if before else 1, (end - start) * parts + 1) / parts
        return turning(known, np.maximum(at, 0.0))

    def _hollow(
        self, pose: Array, force: float, cells: Surface, material: GroundMaterial, factors: Factors | None
    ) -> _Hollow:
        """What the body presses at a pose, under a lasting force."""
        shape = (cells.window.rows, cells.window.columns)
        hollow = _Hollow(np.zeros(shape), np.zeros(shape), 0.0, 0.0)
        deepest = material.layer_depth * (float(factors.depth.max()) if factors else 1.0)
        reach = min(max(2 * self._deepest, FIRST_REACH * self.prop.size), deepest)
        while True:
            under = ground_under(self.prop, pose, cells, reach, factors) if force > 0 else None
            if under is None:
                return hollow
            sinkage = under.springs.sinkage(force, material)
            if sinkage <= reach or reach >= deepest:
                break
            reach = min(2 * sinkage, deepest)
        self._deepest = sinkage
        compression = np.zeros(under.over.shape)
        compression[under.over] = under.springs.compression(sinkage, material)
        covered, mean = under.by_cell(compression > 0), under.by_cell(compression)
        hollow.coverage[under.rows, under.columns] = covered
        hollow.compression[under.rows, under.columns] = np.divide(
            mean, covered, out=np.zeros_like(mean), where=covered > 0
        )
        area = float((compression > 0).sum() * under.springs.area[0])
        return _Hollow(hollow.coverage, hollow.compression, sinkage, area)


@dataclass(frozen=True)
class _Hollow:
    """What a body presses into the cells of a window.

    Attributes
    ----------
    coverage, compression : (rows, columns) float arrays
        Fraction of each cell that it touches, and mean compression there [m].
    sinkage : float
        Of its lowest point [m].
    area : float
        Horizontal area of contact [m²].
    """

    coverage: Array
    compression: Array
    sinkage: float
    area: float


def _middle(pressed: Array, cells: Surface) -> Array:
    """Middle of a pressed volume on the undisturbed ground, (3,) [m]; 0 where nothing is pressed."""
    total = float(pressed.sum())
    if total <= 0:
        return np.zeros(3)
    x, y = cells.window.centres(cells.cell_size)
    height = float((pressed * np.where(cells.bears, cells.heights, 0.0)).sum())
    return np.array([pressed.sum(axis=0) @ x, pressed.sum(axis=1) @ y, height]) / total
