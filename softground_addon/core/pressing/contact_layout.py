"""One contact of a sole: when and how hard it presses which cells, laid out ahead of the pressing itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..ground.sparse_grid import Window
from ..motion.sole_motion import Sole
from ..numerics.arrays import Array
from ..record.contact_steps import Steps
from .ground_cells import GroundCells, Imprints, Timing
from .kind_shares import across
from .rim import in_contact, lean_of_landing, leaning, rim_weights, whole_reach

STEPS_AT_ONCE = 128
"""Steps of one contact that are laid out in one go: about one contact of a walk."""
CELLS_AT_ONCE = 4_000_000
"""Fewer steps are laid out in one go where they would have more cells than this together: 50 MB."""
LARGEST_SPREAD = 4
"""Nor does a sliding sole's window grow beyond so many times that of the sole at rest."""


class ContactLayout(ABC):
    """One sole from touching down to leaving, as it is laid out on the cells of the ground.

    It remembers nothing of what was pressed: the same steps on the same cells give the same imprints.

    Parameters
    ----------
    steps : Steps
        All of the contact.
    strength : float
        Its compression over what the loads lead to.

    Attributes
    ----------
    first, end : int
        Number of the first step and of the one after the last.
    force : (N,) float array
        Normal force at each step [N].
    lean : (N, 2) float array
        Which way the rim leans at each step; see `rim.leaning`.
    remembers : bool
        It keeps what does not depend on the material, as it is pressed into one after the other.
    """

    remembers = False

    def __init__(self, character: str, sole: Sole, steps: Steps, *, strength: float = 1.0) -> None:
        self.character, self.sole, self.steps, self.strength = character, sole, steps, strength
        self.first, self.end = steps.first, steps.first + len(steps.frames)
        self.force = np.maximum(np.einsum("ni,ni->n", steps.forces, steps.normals), 0.0)
        self._landing_drop = landing_drop(sole, np.concatenate([steps.approach, steps.poses[:1]]), steps.normals[0])
        approach = steps.approach if len(steps.approach) else steps.poses[:1]
        path = self._middles(np.concatenate([approach[-1:], steps.poses]))
        self.lean = leaning(path, self._length, lean_of_landing(path[:2], self._length))

    def lay_out(self, start: int, end: int, cells: GroundCells, timing: Timing, sinkage: float) -> Imprints:
        """The imprints of the steps from start to before end, and of as many later ones as pays.

        Parameters
        ----------
        sinkage : float
            How far the ground has given way under the sole's lowest point by then [m].
        """
        widest = cells.widest
        per_frame = timing.steps_per_frame
        last = min(self.end, end + per_frame * max(0, STEPS_AT_ONCE // per_frame - 1))
        allowed = LARGEST_SPREAD * self._window(start, start + 1, widest).cells
        window = self._window(start, last, widest)
        most = CELLS_AT_ONCE // self._parts(start, last, cells)
        while last > end and (window.cells > allowed or window.cells * (last - start) > most):
            last = end + (last - end) // (2 * per_frame) * per_frame
            window = self._window(start, last, widest)
        numbers, shares = [0], None
        if regions := cells.ground.regions:
            sole = window.expanded(-whole_reach(widest.rim_reach))
            numbers, shares = regions.under(sole, window, cells.cell_size)
        kinds = [cells.kinds[number] for number in numbers]
        if len(kinds) == 1 and kinds[0] is not widest:
            window = self._window(start, last, kinds[0])
        of_kinds = [self._deeper(self._lay_out(start, last, window, c, timing.step, sinkage), c) for c in kinds]
        return of_kinds[0] if shares is None else self._across(of_kinds, shares, kinds)

    def _across(self, of_kinds: Sequence[Imprints], shares: Array, kinds: Sequence[GroundCells]) -> Imprints:
        """The imprints across borders between kinds of ground, whose shares in each cell are (K, rows, columns)."""
        laid, most = across(of_kinds, shares)
        cells, bias = kinds[most], kinds[most].material.rim_bias
        contact, lean = in_contact(laid.coverage), self.lean[laid.first - self.first : laid.end - self.first]
        toward = bias * lean.repeat(laid.parts, axis=0) if bias else None
        rim = rim_weights(laid.coverage, contact, cells.rim_reach, cells.surface(laid.window).bears, toward)
        return replace(laid, contact=contact, rim=rim)

    def window(self, cells: GroundCells) -> Window:
        """The cells that the whole contact may change, but for ground that slides."""
        return self._window(self.first, self.end, cells.widest)

    def _deeper(self, imprints: Imprints, cells: GroundCells) -> Imprints:
        """The imprints with `strength` times their compression, as far as the ground gives way."""
        if self.strength == 1.0:
            return imprints
        deepest = cells.material.deepest * (imprints.factors.depth if imprints.factors else 1.0)
        return replace(imprints, target=np.minimum(imprints.target * self.strength, deepest))

    def heading(self, step: int) -> float:
        """Direction of the toes at a step of the contact, counter-clockwise from world x [rad]."""
        return float(np.arctan2(*self._toward(step)[::-1]))

    @abstractmethod
    def _window(self, start: int, end: int, cells: GroundCells) -> Window:
        """The cells that may change in these steps."""

    @abstractmethod
    def _lay_out(
        self, start: int, end: int, window: Window, cells: GroundCells, step: float, sinkage: float
    ) -> Imprints:
        """The imprints of these steps."""

    def _parts(self, _start: int, _end: int, _cells: GroundCells) -> int:
        """Number of parts in which each of these steps is laid out."""
        return 1

    def _toward(self, step: int) -> Array:
        """Horizontal direction of the toes at a step, (2,)."""
        direction: Array = self.steps.poses[step, 0, :2, 0]
        return direction

    @property
    @abstractmethod
    def _length(self) -> float:
        """Longest extent of what touches [m]."""

    @abstractmethod
    def _middles(self, poses: Array) -> Array:
        """Middle of what can touch at poses (N, P, 4, 4), (N, 3) [m]."""


def landing_drop(sole: Sole, poses: Array, normal: Array) -> float:
    """Furthest that the landmark which lands first came down between two of the last poses (K, P, 4, 4) [m]."""
    pose = poses[:, sole.landmark_patch]
    height = (np.einsum("klij,lj->kli", pose[..., :3, :3], sole.landmarks) + pose[..., :3, 3]) @ normal
    return max(0.0, float(-np.diff(height[:, height[-1].argmin()]).min(initial=0.0)))
