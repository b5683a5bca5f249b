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
    target_compression,
    touching_fraction,
)
from .footprints import Footprint, FootprintRecorder, quantised
from .heightfield import HeightField, SparseGrid, Surface, Terrain, TerrainTiles, Window
from .imprint import SolePoints, cell_coverage, centroid, contact_window, places, point_contact
from .motion import Sole
from .pressure import Pressure, pressure_slope
from .repose import SWEEPS_PER_STEP, SWEEPS_TO_REST, slid, slide_reach
from .variation import Factors, Variation, VariationTiles

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
    sinkage : (N,) float array
        How far the ground had given way under the sole's lowest point when each step began [m].
    """

    first: int
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
        return self.first + len(self.pressing)


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
        self.pressed: SparseGrid | None = None
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
            self._heading = float(np.arctan2(steps.poses[hardest, 0, 1, 0], steps.poses[hardest, 0, 0, 0]))

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
        window = contact_window(self.points, self._steps.poses[start - self.first : end - self.first], press.cell_size)
        return window.expanded(max(1, int(press.rim_reach + 1e-6)))

    def _lay_out(self, start: int, end: int, window: Window, press: Press, step: float) -> Imprints:
        steps, points, material = slice(start - self.first, end - self.first), self.points, press.material
        poses, force = self._steps.poses[steps], self._force[steps]
        divisions = points.cell_divisions(press.cell_size)
        cells = press.surface(window)
        ground = press.surface(window, divisions) if divisions > 1 else cells
        over_ground = point_contact(points, poses, ground)
        area = over_ground.area / self._steps.normals[steps, 2, None]
        factors = press.variation.factors(window) if press.variation else None
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
        toward = self._leaning(steps, step, material.rim_bias) if material.rim_bias else None
        rim = rim_weights(coverage, contact, press.rim_reach, cells.bears, toward)
        rate = np.broadcast_to(
            compression_rate(step, material, sinking.target, self._descent / step), sinking.target.shape
        )
        stress = np.divide(load, sinking.area, out=np.zeros_like(load), where=pressing)
        target = sinking.target
        if press.pressure == "CENTRE_OF_PRESSURE" or factors:
            stress = stress[:, None, None]
            if press.pressure == "CENTRE_OF_PRESSURE":
                x, y = places(points, poses)
                centre = self._steps.centres[steps, :2]
                slope = pressure_slope(x, y, touching, centre, points.tolerance)
                stress = stress * slope.over(*window.centres(press.cell_size), coverage)
            varying = {"stiffness": factors.stiffness, "depth": factors.depth} if factors else {}
            target = target_compression(stress, material, **varying)
        holds = stress < material.crust_stress if material.crust_stress else None
        return Imprints(start, window, coverage, contact, rim, pressing, target, rate, holds, factors, sinking.sinkage)

    def _leaning(self, steps: slice, step: float, bias: float) -> Array:
        """Where the rim leans to and how far at each of these steps, (N, 2): the way that the sole moves."""
        poses = np.concatenate([self._steps.approach[-1:], self._steps.poses])[steps.start : steps.stop + 1]
        area = np.concatenate([patch.area for patch in self.points.patches])
        middle = centroid(self.points, poses, np.broadcast_to(area, (len(poses), len(area))))
        velocity = np.diff(middle[:, :2], axis=0) / step
        slow = LEANING_SPEED * self.points.length
        leaning: Array = bias * velocity / np.sqrt((velocity**2).sum(axis=1, keepdims=True) + slow**2)
        return leaning


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


class Press:
    """A ground to be pressed, and on what terms.

    Parameters
    ----------
    terrain : Terrain
        The undisturbed ground.
    material : GroundMaterial
    ground : HeightField
        Its state, which is worked on.
    pressure : Pressure
        How the force on a sole spreads over its contact.
    variation : Variation, optional
        How the ground varies from place to place.
    """

    def __init__(
        self,
        terrain: Terrain,
        material: GroundMaterial,
        ground: HeightField,
        *,
        pressure: Pressure = "UNIFORM",
        variation: Variation | None = None,
    ) -> None:
        self.terrain, self.material, self.ground, self.pressure = terrain, material, ground, pressure
        self.variation = VariationTiles(variation, ground.cell_size) if variation else None
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
                    windows += self._press(stance, imprints, max(first, begin), min(last, stop), frame, timing)
        return tuple(windows)

    def settle(self, stance: Stance, frame: float) -> tuple[Window, ...]:
        """Let slide what a stance that has ended left too steep; where the ground may have changed by that."""
        if not self.material.repose_angle or stance.recorder is None:
            return ()
        window, surface = self._around(stance.recorder.window)
        state = self.ground.read(window)
        before = quantised(state)
        state[1] = self._slid(state, surface, ~surface.bears, SWEEPS_TO_REST)
        change = quantised(state) - before
        if not change.any():
            return ()
        self.ground.write(window, state)
        stance.recorder.add(frame, window, change, np.zeros(change.shape[1:], bool))
        return (window,)

    def _press(
        self, stance: Stance, imprints: Imprints, start: int, end: int, frame: float, timing: Timing
    ) -> list[Window]:
        steps = (
            start - imprints.first + np.flatnonzero(imprints.pressing[start - imprints.first : end - imprints.first])
        )
        if not len(steps):
            return []
        window, surface = imprints.window, None
        if self.material.repose_angle:
            window, surface = self._around(imprints.window)
        whole = self.ground.read(window)
        before = quantised(whole)
        inside = _inside(window, imprints.window)
        state = whole[:, inside[0], inside[1]]
        found = self._found(stance, imprints.window, state) if self.material.hardening else None
        heights, displaced = np.zeros(len(steps)), np.zeros(len(steps))
        rim = imprints.rim[steps].reshape(len(steps), -1)
        for k, step in enumerate(steps):
            compression = compress(
                state[0],
                imprints.coverage[step],
                imprints.target[step],
                imprints.rate[step],
                holds=False if imprints.holds is None else imprints.holds[step],
                found=found,
                hardening=self.material.hardening,
            )
            newly = compression - state[0]
            heights[k] = newly.sum()
            if imprints.factors is None:
                displaced[k] = displaced_volume(heights[k], self.material)
            else:
                displaced[k] = displaced_volume(newly, self.material, imprints.factors.rim).sum()
            state[0] = compression
            if surface:
                state[1] += (displaced[k] * rim[k]).reshape(state[1].shape)
                fixed = ~surface.bears
                fixed[inside] |= imprints.contact[step]
                whole[1] = self._slid(whole, surface, fixed, SWEEPS_PER_STEP)
        rise = displaced @ rim
        if not surface:
            state[1] += rise.reshape(state[1].shape)
        self.ground.write(window, whole)
        if stance.pressed is not None and found is not None:
            stance.pressed.write(imprints.window, (state[0] - found)[None])
        cell_area = self.cell_size**2
        stance.compressed += float(heights.sum()) * cell_area
        stance.raised += float(rise.sum()) * cell_area
        stance.unplaced += float(displaced[~rim.any(axis=1)].sum()) * cell_area
        if stance.recorder is None:
            stance.recorder = FootprintRecorder(self.cell_size, timing.frame_step)
        touched = np.zeros(whole.shape[1:], bool)
        touched[inside] = imprints.contact[steps].any(axis=0)
        stance.recorder.add(frame, window, quantised(whole) - before, touched)
        return [window] if surface else []

    def _found(self, stance: Stance, window: Window, state: Array) -> Array:
        """Compression of a window that a stance found when it began: all but its own (rows, columns) [m]."""
        if stance.pressed is None:
            stance.pressed = SparseGrid(self.cell_size, channels=1)
        return np.maximum(state[0] - stance.pressed.read(window)[0], 0.0)

    def _around(self, window: Window) -> tuple[Window, Surface]:
        """A window with the ground around it that may slide with it."""
        compression, rim = self.ground.read(window)
        reach = slide_reach(rim, compression, self.material.repose_angle, self.cell_size)
        wider = window.expanded(reach)
        return wider, self.surface(wider)

    def _slid(self, state: Array, surface: Surface, fixed: NDArray[np.bool_], sweeps: int) -> Array:
        """The rim of a window after what is too steep has slid down."""
        return slid(
            state[1],
            state[0],
            surface.heights,
            angle=self.material.repose_angle,
            cell_size=self.cell_size,
            fixed=fixed,
            corner=(surface.window.row, surface.window.column),
            sweeps=sweeps,
        )


def _inside(whole: Window, part: Window) -> tuple[slice, slice]:
    """Rows and columns of a window that a part of it takes."""
    row, column = part.row - whole.row, part.column - whole.column
    return slice(row, row + part.rows), slice(column, column + part.columns)
