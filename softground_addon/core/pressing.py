"""One stance after the other into one ground: the part of the simulation that works on cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .deformation import (
    GroundMaterial,
    compress,
    compression_rate,
    displaced_volume,
    in_contact,
    rim_weights,
    sink,
    touching_fraction,
)
from .footprints import Footprint, FootprintRecorder, quantised
from .heightfield import HeightField, Surface, Terrain, TerrainTiles, Window
from .imprint import SolePoints, cell_coverage, centroid, contact_window, point_contact
from .motion import Sole

Array = NDArray[np.float64]

STEPS_AT_ONCE = 128
"""Steps of one stance that are laid out in one go: about one stance of a walk."""
CELLS_AT_ONCE = 4_000_000
"""Fewer steps are laid out in one go where they would have more cells than this together: 50 MB."""
LARGEST_SPREAD = 4
"""Nor does a sliding sole's window grow beyond so many times that of the sole at rest."""


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


@dataclass(frozen=True)
class Imprints:
    """A stance over the cells, at each of N steps from `first` on.

    Attributes
    ----------
    first : int
        Step of the simulation.
    window : Window
    coverage : (N, rows, columns) float array
        Fraction of each cell that is in contact.
    contact : (N, rows, columns) bool array
        Cells that count as in contact.
    rim : (N, rows, columns) float array
        Shares of the displaced volume.
    target : (N,) float array
        Compression that the stress leads to [m].
    sinkage : (N,) float array
        How far the ground had given way under the sole's lowest point when each step began [m].
    """

    first: int
    window: Window
    coverage: NDArray[np.float32]
    contact: NDArray[np.bool_]
    rim: Array
    target: Array
    sinkage: Array

    @property
    def end(self) -> int:
        """The step after the last."""
        return self.first + len(self.target)


class Stance:
    """One sole from touching down to leaving, and its footprint as it grows.

    Parameters
    ----------
    character : str
    sole : Sole
    points : SolePoints
        Of that sole.
    """

    def __init__(self, character: str, sole: Sole, points: SolePoints) -> None:
        self.character, self.sole, self.points = character, sole, points
        self.first = self.end = 0
        self.compressed = self.raised = self.unplaced = 0.0
        self.recorder: FootprintRecorder | None = None
        self._frames: list[Array] = []
        self._forces: list[Array] = []
        self._peak = self._heading = self._area = self._sinkage = self._load = 0.0
        self._moment = np.zeros(3)
        self._imprints: Imprints | None = None

    def extend(self, first: int, frames: Array, poses: Array, forces: Array, normals: Array) -> None:
        """Go on with the next N steps of the stance.

        Parameters
        ----------
        first : int
            Number of the first of them.
        frames : (N,) float array
            Scene frame of each.
        poses : (N, P, 4, 4) float array
            Of the sole's patches.
        forces, normals : (N, 3) float arrays
            Ground reaction force [N] and the ground's unit normal.
        """
        self.first, self.end = first, first + len(frames)
        self._poses, self._upright = poses, normals[:, 2]
        self._force = np.maximum(np.einsum("ni,ni->n", forces, normals), 0.0)
        self._frames.append(frames)
        self._forces.append(self._force)
        self._imprints = None
        hardest = int(self._force.argmax())
        if self._force[hardest] > self._peak:
            self._peak = float(self._force[hardest])
            self._heading = float(np.arctan2(poses[hardest, 0, 1, 0], poses[hardest, 0, 0, 0]))

    def imprints(self, start: int, end: int, press: Press, timing: Timing) -> Imprints:
        """The imprints of these steps, laid out together with as many later ones as pays."""
        if self._imprints is None or self._imprints.end < end:
            per_frame = timing.steps_per_frame
            last = min(self.end, end + per_frame * max(0, STEPS_AT_ONCE // per_frame - 1))
            allowed = LARGEST_SPREAD * self._window(start, start + 1, press).cells
            window = self._window(start, last, press)
            while last > end and (window.cells > allowed or window.cells * (last - start) > CELLS_AT_ONCE):
                last = end + (last - end) // (2 * per_frame) * per_frame
                window = self._window(start, last, press)
            self._imprints = self._lay_out(start, last, window, press, timing.step)
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

    def _window(self, start: int, end: int, press: Press) -> Window:
        window = contact_window(self.points, self._poses[start - self.first : end - self.first], press.cell_size)
        return window.expanded(max(1, int(press.rim_reach + 1e-6)))

    def _lay_out(self, start: int, end: int, window: Window, press: Press, step: float) -> Imprints:
        steps, points = slice(start - self.first, end - self.first), self.points
        poses, force = self._poses[steps], self._force[steps]
        divisions = points.cell_divisions(press.cell_size)
        cells = press.surface(window)
        ground = press.surface(window, divisions) if divisions > 1 else cells
        over_ground = point_contact(points, poses, ground)
        area = over_ground.area / self._upright[steps, None]
        sinking = sink(
            over_ground.clearance,
            area,
            force,
            tolerance=points.tolerance,
            step=step,
            material=press.material,
            sinkage=self._sinkage,
        )
        self._sinkage = sinking.reached
        pressing = force * (sinking.target > 0)
        self._area = max(self._area, float(sinking.area[pressing > 0].max(initial=0.0)))
        touching = area * touching_fraction(over_ground.clearance, sinking.sinkage[:, None], points.tolerance)
        middle = centroid(points, poses, touching)
        above = (touching * over_ground.clearance).sum(axis=1) / np.maximum(touching.sum(axis=1), 1e-300)
        middle[:, 2] -= over_ground.lowest + above
        self._moment += pressing @ middle
        self._load += float(pressing.sum())
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
        rim = rim_weights(coverage, contact, press.rim_reach, cells.bears)
        return Imprints(start, window, coverage, contact, rim, sinking.target, sinking.sinkage)


class Press:
    """A ground to be pressed, and on what terms.

    Parameters
    ----------
    terrain : Terrain
        The undisturbed ground.
    material : GroundMaterial
    ground : HeightField
        Its state, which is worked on.
    """

    def __init__(self, terrain: Terrain, material: GroundMaterial, ground: HeightField) -> None:
        self.terrain, self.material, self.ground = terrain, material, ground
        self._tiles: dict[int, TerrainTiles] = {}

    @property
    def cell_size(self) -> float:
        """Side of a cell [m]."""
        return self.ground.cell_size

    @property
    def rim_reach(self) -> float:
        """Reach of the rim in cells."""
        return self.material.rim_reach / self.cell_size

    def surface(self, window: Window, divisions: int = 1) -> Surface:
        """The undisturbed ground under a window, its cells divided in so many parts along each side."""
        if divisions not in self._tiles:
            self._tiles[divisions] = TerrainTiles(self.terrain, self.cell_size / divisions)
        return self._tiles[divisions].surface(window.refined(divisions))

    def advance(
        self, stances: Sequence[Stance], start: int, end: int, frame: float, timing: Timing
    ) -> tuple[Window, ...]:
        """Press the steps from start to before end; where stances share ground, all of them step by step.

        Returns
        -------
        tuple of Window
            Where the ground may have changed.
        """
        parts = []
        for stance in stances:
            first, last = max(start, stance.first), min(end, stance.end)
            if first < last:
                parts.append((stance, stance.imprints(first, last, self, timing), first, last))
        windows = [imprints.window for _, imprints, _, _ in parts]
        spans = [(start, end)]
        if any(one.intersects(other) for one, other in combinations(windows, 2)):
            spans = [(step, step + 1) for step in range(start, end)]
        for begin, stop in spans:
            for stance, imprints, first, last in parts:
                if max(first, begin) < min(last, stop):
                    self._press(stance, imprints, max(first, begin), min(last, stop), frame, timing)
        return tuple(windows)

    def _press(self, stance: Stance, imprints: Imprints, start: int, end: int, frame: float, timing: Timing) -> None:
        steps = start - imprints.first + np.flatnonzero(imprints.target[start - imprints.first : end - imprints.first])
        if not len(steps):
            return
        state = self.ground.read(imprints.window)
        before = quantised(state)
        rate = compression_rate(timing.step, self.material)
        heights = np.zeros(len(steps))
        for k, step in enumerate(steps):
            compression = compress(state[0], imprints.coverage[step], imprints.target[step], rate)
            heights[k] = (compression - state[0]).sum()
            state[0] = compression
        displaced = displaced_volume(heights, self.material)
        rim = imprints.rim[steps].reshape(len(steps), -1)
        rise = displaced @ rim
        state[1] += rise.reshape(state[1].shape)
        self.ground.write(imprints.window, state)
        cell_area = self.cell_size**2
        stance.compressed += float(heights.sum()) * cell_area
        stance.raised += float(rise.sum()) * cell_area
        stance.unplaced += float(displaced[~rim.any(axis=1)].sum()) * cell_area
        if stance.recorder is None:
            stance.recorder = FootprintRecorder(self.cell_size, timing.frame_step)
        stance.recorder.add(frame, imprints.window, quantised(state) - before, imprints.contact[steps].any(axis=0))
