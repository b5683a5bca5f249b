"""A contact of a rigid body: it presses by whatever faces down, as it rolls, slides, tips or rests."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np

from ..ground.heightfield import Surface
from ..ground.material import GroundMaterial
from ..ground.sparse_grid import Window
from ..ground.variation import Factors, layer_factors
from ..imprints.indentation import stress
from ..imprints.prop_imprint import ground_under
from ..motion.props import Prop
from ..motion.sole_motion import Sole
from ..numerics.arrays import Array
from ..numerics.interpolation import turning
from ..record.contact_steps import Steps
from .contact_layout import ContactLayout
from .deformation import compression_rate
from .ground_cells import GroundCells, Imprints, Loads
from .rim import in_contact, rim_weights, whole_reach

STRIDE = 1 / 32
"""A body that moves further than this in a step is laid out in parts of the step, in its sizes."""
MOST_PARTS = 32
"""Parts of a step at most."""
FIRST_EXTENT = 0.05
"""Part of a body that is looked at before it is known how deep it sinks, in its sizes above its lowest point."""
DIRECTIONS = 16
"""Directions in which a body is measured for how narrow it is."""
NARROWEST = 1e-3
"""Least width of a body, in its sizes."""
STANDSTILL = 1e-4
"""A body that moves less than this in a step, in its sizes, has no direction of travel."""


class PropLayout(ContactLayout):
    """A body on the ground, from touching it to leaving it.

    Parameters
    ----------
    sole : Sole
        With a prop.
    steps : Steps
        All of the contact.
    """

    def __init__(self, character: str, sole: Sole, steps: Steps, *, strength: float = 1.0) -> None:
        assert sole.prop is not None, sole.name
        self.prop: Prop = sole.prop
        super().__init__(character, sole, steps, strength=strength)
        poses, outer = steps.poses[:, 0], self.prop.probes.T
        extent = np.zeros((2, len(poses), 2))
        for k, pose in enumerate(poses):
            if k and (pose == poses[k - 1]).all():
                extent[:, k] = extent[:, k - 1]
            else:
                place = pose[:2, :3] @ outer + pose[:2, 3:]
                extent[:, k] = place.min(axis=1), place.max(axis=1)
        self._extent = extent

    def _window(self, start: int, end: int, cells: GroundCells) -> Window:
        low, high = self._extent[:, start - self.first : end - self.first]
        half = cells.cell_size / 2
        window = Window.around(low.min(axis=0) - half, high.max(axis=0) + half, cells.cell_size)
        return window.expanded(whole_reach(cells.rim_reach))

    def _parts(self, start: int, end: int, cells: GroundCells) -> int:
        path = self._between(start, end, 1, before=True)[:, :2, 3]
        furthest = float(np.linalg.norm(np.diff(path, axis=0), axis=1).max(initial=0.0))
        return max(1, min(MOST_PARTS, ceil(furthest / max(cells.cell_size, STRIDE * self.prop.size) - 1e-6)))

    def _lay_out(
        self, start: int, end: int, window: Window, cells: GroundCells, step: float, sinkage: float
    ) -> Imprints:
        steps, material, surface = slice(start - self.first, end - self.first), cells.material, cells.surface(window)
        parts = self._parts(start, end, cells)
        poses = self._between(start, end, parts)
        force = np.repeat(self.force[steps], parts)
        upright = np.repeat(self.steps.normals[steps, 2], parts)
        factors = cells.factors(window)
        coverage = np.zeros((len(poses), window.rows, window.columns), np.float32)
        target = np.zeros(coverage.shape)
        depth, area, middle = np.zeros(len(poses)), np.zeros(len(poses)), np.zeros((len(poses), 3))
        reached = np.full(len(poses) + 1, sinkage)
        for k, pose in enumerate(poses):
            if k and force[k] == force[k - 1] and upright[k] == upright[k - 1] and (pose == poses[k - 1]).all():
                for values in (coverage, target, depth, area, middle):
                    values[k] = values[k - 1]
            else:
                indentation = self._indentation(pose, force[k], surface, material, factors, reached[k])
                coverage[k], target[k], depth[k] = indentation.coverage, indentation.compression, indentation.sinkage
                area[k] = indentation.area / upright[k]
                middle[k] = _middle(coverage[k] * target[k], surface)
            reached[k + 1] = depth[k] or reached[k]
        pressing = depth > 0
        contact = in_contact(coverage)
        toward = material.rim_bias * self.lean[steps].repeat(parts, axis=0) if material.rim_bias else None
        rim = rim_weights(coverage, contact, cells.rim_reach, surface.bears, toward)
        rate = np.broadcast_to(compression_rate(step / parts, material, depth, self._landing_drop / step), depth.shape)
        holds = None
        if material.crust_stress:
            firmness = material.firmness(self._width)
            holds = stress(target, material, firmness=firmness, **layer_factors(factors)) < material.crust_stress
        return Imprints(
            start,
            parts,
            window,
            coverage,
            contact,
            rim,
            pressing,
            target,
            rate,
            holds,
            factors,
            float(reached[-1]),
            Loads(np.where(pressing, force, 0.0), area, middle),
            material,
            cells.made_of,
        )

    def _toward(self, step: int) -> Array:
        """The way that the body moves; of one that stands, and of a limb, its own x axis."""
        pose = self.steps.poses[step, 0]
        if self.prop.give:
            return np.asarray(pose[:2, 0])
        before = np.concatenate([self.steps.approach[-1:], self.steps.poses])[max(0, step)]
        travel: Array = pose[:2, 3] - before[0, :2, 3]
        return travel if np.linalg.norm(travel) > STANDSTILL * self.prop.size else pose[:2, 0]

    @property
    def _length(self) -> float:
        return self.prop.size

    @cached_property
    def _width(self) -> float:
        """Narrowest extent of the body across the ground as it comes down [m]."""
        angle = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
        across = np.stack([np.cos(angle), np.sin(angle)], axis=-1) @ self.steps.poses[0, 0, :2, :3]
        return max(float(np.ptp(across @ self.prop.probes.T, axis=1).min()), NARROWEST * self.prop.size)

    def _middles(self, poses: Array) -> Array:
        middle: Array = poses[:, 0, :3, 3]
        return middle

    def _between(self, start: int, end: int, parts: int, *, before: bool = False) -> Array:
        """Poses (N, 4, 4) of these steps, each in so many parts; with that of the step before, if asked."""
        known = np.concatenate([self.steps.approach[-1:], self.steps.poses])[:, 0]
        first = len(known) - len(self.steps.poses) + start - self.first  # where `start` is among them
        at = first - 1 + np.arange(0 if before else 1, (end - start) * parts + 1) / parts
        return turning(known, np.maximum(at, 0.0))

    def _indentation(
        self,
        pose: Array,
        force: float,
        cells: Surface,
        material: GroundMaterial,
        factors: Factors | None,
        reached: float,
    ) -> _Indentation:
        """Hollow of the body at a pose, under a lasting force, after one under which it sank so far [m]."""
        shape = (cells.window.rows, cells.window.columns)
        indentation = _Indentation(np.zeros(shape), np.zeros(shape), 0.0, 0.0)
        deepest = material.deepest * (float(factors.depth.max()) if factors else 1.0)
        firmness = material.firmness(self._width)
        extent = min(max(2 * reached, FIRST_EXTENT * self.prop.size), deepest)
        while True:
            under = ground_under(self.prop, pose, cells, extent, factors) if force > 0 else None
            if under is None:
                return indentation
            sinkage = under.springs.sinkage(force, material, firmness, reached)
            if sinkage <= extent or extent >= deepest:
                break
            extent = min(2 * sinkage, deepest)
        compression = np.zeros(under.over.shape)
        compression[under.over] = under.springs.compression(sinkage, material) * under.bears
        covered, mean = under.by_cell(compression > 0), under.by_cell(compression)
        indentation.coverage[under.rows, under.columns] = covered
        indentation.compression[under.rows, under.columns] = np.divide(
            mean, covered, out=np.zeros_like(mean), where=covered > 0
        )
        area = float((compression > 0).sum() * under.springs.area[0])
        return _Indentation(indentation.coverage, indentation.compression, sinkage, area)


@dataclass(frozen=True)
class _Indentation:
    """Depth to which a body presses the cells of a window.

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
