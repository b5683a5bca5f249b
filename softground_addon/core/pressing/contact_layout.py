"""One stance of a sole: when and how hard it presses which cells, laid out ahead of the pressing itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.heightfield import SparseGrid, Window
from ..motion.motion import Sole
from ..record.footprints import Footprint, FootprintRecorder
from .ground_cells import Bed, Imprints, Timing
from .rim import lean_of_landing, leaning

Array = NDArray[np.float64]

STEPS_AT_ONCE = 128
"""Steps of one stance that are laid out in one go: about one stance of a walk."""
CELLS_AT_ONCE = 4_000_000
"""Fewer steps are laid out in one go where they would have more cells than this together: 50 MB."""
LARGEST_SPREAD = 4
"""Nor does a sliding sole's window grow beyond so many times that of the sole at rest."""


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
    steps : Steps
        All of the stance.

    Attributes
    ----------
    earlier : Stance or None
        The stance that this one goes on from without leaving the ground, where a long track is cut into several.
    pressed : SparseGrid or None
        What it compressed itself, kept where the ground hardens.
    lean : (N, 2) float array
        Which way the rim leans at each step; see `rim.leaning`.
    """

    def __init__(self, character: str, sole: Sole, steps: Steps) -> None:
        self.character, self.sole = character, sole
        self.first, self.end = steps.first, steps.first + len(steps.frames)
        self.compressed = self.raised = self.unplaced = 0.0
        self.recorder: FootprintRecorder | None = None
        self.pressed: SparseGrid | None = None
        self.earlier: Stance | None = None
        self._steps = steps
        self._force = np.maximum(np.einsum("ni,ni->n", steps.forces, steps.normals), 0.0)
        self._descent = descent(sole, np.concatenate([steps.approach, steps.poses[:1]]), steps.normals[0])
        approach = steps.approach if len(steps.approach) else steps.poses[:1]
        path = self._middles(np.concatenate([approach[-1:], steps.poses]))
        self.lean = leaning(path, self._length, lean_of_landing(path[:2], self._length))
        self._area = self._sinkage = self._load = 0.0
        self._moment = np.zeros(3)
        self._imprints: Imprints | None = None

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
        frames, hardest = self._steps.frames, int(self._force.argmax())
        return self.recorder.footprint(
            character=self.character,
            sole=self.sole.name,
            start_frame=float(frames[0]),
            end_frame=float(frames[-1]),
            position=self._moment / self._load,
            heading=float(np.arctan2(*self._toward(hardest)[::-1])),
            area_m2=self._area,
            peak_force_n=float(self._force[hardest]),
            compressed_m3=self.compressed,
            rim_m3=self.raised,
            unplaced_rim_m3=self.unplaced,
            load_frames=frames,
            load_n=self._force,
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

    @property
    @abstractmethod
    def _length(self) -> float:
        """Longest extent of what touches [m]."""

    @abstractmethod
    def _middles(self, poses: Array) -> Array:
        """Middle of what can touch at poses (N, P, 4, 4), (N, 3) [m]."""


def descent(sole: Sole, poses: Array, normal: Array) -> float:
    """Furthest that the landmark which lands first came down between two of the last poses (K, P, 4, 4) [m]."""
    pose = poses[:, sole.landmark_patch]
    height = (np.einsum("klij,lj->kli", pose[..., :3, :3], sole.landmarks) + pose[..., :3, 3]) @ normal
    return max(0.0, float(-np.diff(height[:, height[-1].argmin()]).min(initial=0.0)))
