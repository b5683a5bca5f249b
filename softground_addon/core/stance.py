"""One stance of a sole: when and how hard it presses which cells, laid out ahead of the pressing itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .deformation import (
    GroundMaterial,
    compression_rate,
    in_contact,
    rim_weights,
    sink,
    target_compression,
    touching_fraction,
)
from .footprints import Footprint, FootprintRecorder
from .heightfield import SparseGrid, Surface, TerrainTiles, Window
from .imprint import SolePoints, cell_coverage, centroid, contact_window, places, point_contact
from .motion import Sole
from .pressure import pressure_field
from .soft_ground import SoftGround
from .variation import Factors, VariationTiles

Array = NDArray[np.float64]

STEPS_AT_ONCE = 128
"""Steps of one stance that are laid out in one go: about one stance of a walk."""
CELLS_AT_ONCE = 4_000_000
"""Fewer steps are laid out in one go where they would have more cells than this together: 50 MB."""
LARGEST_SPREAD = 4
"""Nor does a sliding sole's window grow beyond so many times that of the sole at rest."""
LEANING_SPEED = 0.3
"""Speed of a sole at which its rim leans 0.7 times as far as it does at most, in sole lengths per second: a planted
foot, which moves more slowly, raises an even rim."""


@dataclass(frozen=True)
class Timing:
    """How simulation steps and scene frames relate.

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


class Bed:
    """The ground that soles are laid on, in cells, and how they press on it.

    Parameters
    ----------
    ground : SoftGround
    cell_size : float
        Side of a cell [m].
    """

    def __init__(self, ground: SoftGround, cell_size: float) -> None:
        self.ground, self.cell_size = ground, cell_size
        self.variation = VariationTiles(ground.variation, cell_size) if ground.variation else None
        self._tiles: dict[int, TerrainTiles] = {}

    @property
    def material(self) -> GroundMaterial:
        """What the ground is made of."""
        return self.ground.material

    @property
    def rim_reach(self) -> float:
        """Reach of the rim in cells."""
        return self.material.rim_reach / self.cell_size

    def surface(self, window: Window, divisions: int = 1) -> Surface:
        """The undisturbed ground under a window, its cells divided in so many parts along each side."""
        if divisions not in self._tiles:
            self._tiles[divisions] = TerrainTiles(self.ground.terrain, self.cell_size / divisions)
        return self._tiles[divisions].surface(window.refined(divisions))


@dataclass(frozen=True)
class Imprints:
    """A stance over the cells, at each of N steps from `first` on, or at each of N parts of them.

    Attributes
    ----------
    first : int
        Step of the simulation.
    parts : int
        Number of parts that each step is laid out in: more than one where the sole moves far in a step.
    window : Window
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
    rate : (N,) float array
        From `deformation.compression_rate`.
    holds : (N,) or (N, rows, columns) bool array, or None
        Where an unbroken crust carries the stress.
    factors : Factors or None
        How the ground varies over the window.
    sinkage : (number of steps,) float array
        How far the ground had given way under the sole's lowest point when each step began [m].
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
    sinkage: Array

    @property
    def end(self) -> int:
        """The step after the last."""
        return self.first + len(self.pressing) // self.parts


@dataclass(frozen=True)
class Steps:
    """What a sole does at N steps in a row.

    Attributes
    ----------
    first : int
        Number of the first of them.
    frames : (N,) float array
        Scene frame of each.
    poses : (N, P, 4, 4) float array
        Of the sole's patches.
    approach : (K, P, 4, 4) float array
        Those of one or two steps before.
    forces, normals : (N, 3) float arrays
        Ground reaction force [N] and the ground's unit normal.
    centres : (N, 3) float array
        Centre of pressure [m].
    """

    first: int
    frames: Array
    poses: Array
    approach: Array
    forces: Array
    normals: Array
    centres: Array


class Stance(ABC):
    """One sole from touching down to leaving, and its footprint as it grows.

    Parameters
    ----------
    character : str
    sole : Sole

    Attributes
    ----------
    earlier : Stance or None
        The stance that this one goes on from without leaving the ground, where a long track is cut into several.
    pressed : SparseGrid or None
        What it compressed itself, kept where the ground hardens.
    """

    def __init__(self, character: str, sole: Sole) -> None:
        self.character, self.sole = character, sole
        self.first = self.end = 0
        self.compressed = self.raised = self.unplaced = 0.0
        self.recorder: FootprintRecorder | None = None
        self.pressed: SparseGrid | None = None
        self.earlier: Stance | None = None
        self._frames: list[Array] = []
        self._forces: list[Array] = []
        self._peak = self._heading = self._area = self._sinkage = self._load = self._descent = 0.0
        self._moment = np.zeros(3)
        self._imprints: Imprints | None = None

    def extend(self, steps: Steps) -> None:
        """Go on with the next steps of the stance."""
        if not self._frames:
            self._descent = _descent(self.sole, np.concatenate([steps.approach, steps.poses[:1]]), steps.normals[0])
        self.first, self.end = steps.first, steps.first + len(steps.frames)
        self._steps = steps
        self._force = np.maximum(np.einsum("ni,ni->n", steps.forces, steps.normals), 0.0)
        self._frames.append(steps.frames)
        self._forces.append(self._force)
        self._imprints = None
        hardest = int(self._force.argmax())
        if self._force[hardest] > self._peak:
            self._peak = float(self._force[hardest])
            self._heading = float(np.arctan2(*self._toward(hardest)[::-1]))

    def imprints(self, start: int, end: int, bed: Bed, timing: Timing) -> Imprints:
        """The imprints of these steps, laid out together with as many later ones as pays."""
        if self._imprints is None or self._imprints.end < end:
            per_frame = timing.steps_per_frame
            last = min(self.end, end + per_frame * max(0, STEPS_AT_ONCE // per_frame - 1))
            allowed = LARGEST_SPREAD * self._window(start, start + 1, bed).cells
            window = self._window(start, last, bed)
            most = CELLS_AT_ONCE // self._parts(start, last, bed)
            while last > end and (window.cells > allowed or window.cells * (last - start) > most):
                last = end + (last - end) // (2 * per_frame) * per_frame
                window = self._window(start, last, bed)
            self._imprints = self._lay_out(start, last, window, bed, timing.step)
        return self._imprints

    def lay_out_anew(self, start: int) -> None:
        """Forget the imprints from a step on, as they were laid out on other terms."""
        if self._imprints is not None and self._imprints.first <= start < self._imprints.end:
            self._sinkage = float(self._imprints.sinkage[start - self._imprints.first])
        self._imprints = None

    @property
    def printed(self) -> bool:
        """Whether it changed the ground."""
        return self.recorder is not None

    def footprint(self) -> Footprint:
        """The record of what was pressed so far."""
        if self.recorder is None:
            raise ValueError("a stance that pressed nothing leaves no footprint")
        frames = np.concatenate(self._frames)
        return self.recorder.footprint(
            character=self.character,
            sole=self.sole.name,
            start_frame=float(frames[0]),
            end_frame=float(frames[-1]),
            position=self._moment / self._load,
            heading=self._heading,
            area_m2=self._area,
            peak_force_n=self._peak,
            compressed_m3=self.compressed,
            rim_m3=self.raised,
            unplaced_rim_m3=self.unplaced,
            load_frames=frames,
            load_n=np.concatenate(self._forces),
        )

    @abstractmethod
    def _window(self, start: int, end: int, bed: Bed) -> Window:
        """The cells that may change in these steps."""

    @abstractmethod
    def _lay_out(self, start: int, end: int, window: Window, bed: Bed, step: float) -> Imprints:
        """The imprints of these steps."""

    def _parts(self, _start: int, _end: int, _bed: Bed) -> int:
        """Number of parts in which each of these steps is laid out."""
        return 1

    def _toward(self, step: int) -> Array:
        """Horizontal direction of the toes at a step, (2,)."""
        direction: Array = self._steps.poses[step, 0, :2, 0]
        return direction

    def _leaning(self, path: Array, step: float, bias: float, length: float) -> Array:
        """Where the rim leans to and how far at each of N steps, (N, 2): the way that the sole moves.

        Parameters
        ----------
        path : (N + 1, 2) float array
            Of the middle of what can touch, from the step before on [m].
        step : float
            Time between them [s].
        bias : float
            How far it leans at most.
        length : float
            Of the sole [m].
        """
        velocity = np.diff(path, axis=0) / step
        leaning: Array = (
            bias * velocity / np.sqrt((velocity**2).sum(axis=1, keepdims=True) + (LEANING_SPEED * length) ** 2)
        )
        return leaning


class SoleStance(Stance):
    """A stance of a foot: patches that keep their underside, tilted a little at most.

    Parameters
    ----------
    character : str
    sole : Sole
    points : SolePoints
        Of that sole.
    """

    def __init__(self, character: str, sole: Sole, points: SolePoints) -> None:
        super().__init__(character, sole)
        self.points = points

    def _window(self, start: int, end: int, bed: Bed) -> Window:
        window = contact_window(self.points, self._steps.poses[start - self.first : end - self.first], bed.cell_size)
        return window.expanded(max(1, int(bed.rim_reach + 1e-6)))

    def _lay_out(self, start: int, end: int, window: Window, bed: Bed, step: float) -> Imprints:
        steps, points, material = slice(start - self.first, end - self.first), self.points, bed.material
        poses, force = self._steps.poses[steps], self._force[steps]
        divisions = points.cell_divisions(bed.cell_size)
        cells = bed.surface(window)
        ground = bed.surface(window, divisions) if divisions > 1 else cells
        over_ground = point_contact(points, poses, ground)
        area = over_ground.area / self._steps.normals[steps, 2, None]
        factors = bed.variation.factors(window) if bed.variation else None
        sinking = sink(
            over_ground.clearance,
            area,
            force,
            tolerance=points.tolerance,
            step=step,
            material=material,
            sinkage=self._sinkage,
            landing_speed=self._descent / step,
            softness=_at_points(factors.softness, points, poses, cells) if factors else None,
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
        toward = None
        if material.rim_bias:
            toward = self._leaning(self._path(steps), step, material.rim_bias, points.length)
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

    def _path(self, steps: slice) -> Array:
        """Middle of the sole from the step before on, (N + 1, 2) [m]."""
        poses = np.concatenate([self._steps.approach[-1:], self._steps.poses])[steps.start : steps.stop + 1]
        area = np.concatenate([patch.area for patch in self.points.patches])
        return centroid(self.points, poses, np.broadcast_to(area, (len(poses), len(area))))[:, :2]


def _descent(sole: Sole, poses: Array, normal: Array) -> float:
    """Furthest that the landmark which lands first came down between two of the last poses (K, P, 4, 4) [m]."""
    pose = poses[:, sole.landmark_patch]
    height = (np.einsum("klij,lj->kli", pose[..., :3, :3], sole.landmarks) + pose[..., :3, 3]) @ normal
    return max(0.0, float(-np.diff(height[:, height[-1].argmin()]).min(initial=0.0)))


def _at_points(values: Array, points: SolePoints, poses: Array, ground: Surface) -> Array:
    """The values (rows, columns) of the cells that lie under a sole's points, (N, Q)."""
    x, y = places(points, poses)
    column = np.floor(x / ground.cell_size).astype(int) - ground.window.column
    row = np.floor(y / ground.cell_size).astype(int) - ground.window.row
    under: Array = values[np.clip(row, 0, ground.window.rows - 1), np.clip(column, 0, ground.window.columns - 1)]
    return under
