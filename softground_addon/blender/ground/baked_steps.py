"""The steps of the bake on the ground, as the panel lists them and the viewport draws them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.motion.ground_frame import GroundFrame
from ...core.numerics.arrays import Array
from ...core.numerics.rigid import rotation
from ...core.pressing.edited_contacts import swapped
from ...core.record import record
from ...core.record.contact_steps import PressingSole, Steps
from ...core.record.edits import UNCHANGED, StepEdit, feet, sole_of
from ...core.record.footprints import Footprint
from .. import session
from ..rigs.object_data import mesh_of
from ..state import state
from . import baked_ground

APART = 1.2
"""How far ahead of a step its copy lies, in lengths of its outline."""


@dataclass(frozen=True, eq=False)
class BakedStep(record.EditableStep):
    """One step.

    Attributes
    ----------
    number : int
        In the order of the bake, from 1; copies follow.
    feet : mapping of str to PressingSole
        Soles of the bake that may press it.
    """

    number: int
    feet: Mapping[str, PressingSole]

    @property
    def is_edited(self) -> bool:
        """True if there is anything to be reset."""
        return self.is_copy or self.edit != UNCHANGED

    @property
    def frames(self) -> tuple[int, int]:
        """First and last frame of the contact."""
        shift = self.edit.shift_frames
        return int(np.ceil(self.baked.start_frame)) + shift, int(self.baked.end_frame) + shift

    @property
    def there_from(self) -> int:
        """First frame without the foot."""
        return int(np.ceil(self.baked.end_frame)) + self.edit.shift_frames

    @property
    def side(self) -> str:
        """ "L", "R" or "" for neither."""
        made_by = self.baked.pressed_by
        return made_by.pressing.sole.side if made_by else ""

    @cached_property
    def depth_cm(self) -> float:
        """Depth of the step now [cm]."""
        return self.footprint.max_depth_m * 100 if self.footprint else 0.0

    @property
    def height(self) -> float:
        """Height of the undisturbed ground under it [m]."""
        return float((self.footprint or self.baked).position[2])

    def outline(self, edit: StepEdit | None = None) -> Array:
        """Its sole on the undisturbed ground, where it is or would be with another edit, (N, 3) [m]."""
        edit = edit or self.edit
        turn = rotation(np.array([0.0, 0.0, np.radians(edit.turn_deg)]))[:2, :2]
        middle = self.baked.position[:2]
        outline = edit.scale * (self._outline_of(edit) - middle) @ turn.T + middle + edit.move_m
        return np.column_stack([outline, np.full(len(outline), self.height)])

    def ahead(self) -> tuple[float, float]:
        """Place ahead of the step, along world x and y [m]."""
        along = np.array([np.cos(heading := (self.footprint or self.baked).heading), np.sin(heading)])
        length = float(np.ptp(self.outline()[:, :2] @ along))
        x, y = np.array(self.edit.move_m) + APART * length * along
        return float(x), float(y)

    @property
    def has_foot(self) -> bool:
        """True if a foot made it, and neither a ball nor a wheel."""
        made_by = self.baked.pressed_by
        return made_by is not None and made_by.pressing.sole.prop is None

    def _outline_of(self, edit: StepEdit) -> Array:
        """Seen from above, in the place of the bake, (N, 2) [m]: of a foot a sole, of a prop what it touched."""
        return self._sole_outline(edit) if self.has_foot else self._touched

    def _sole_outline(self, edit: StepEdit) -> Array:
        steps, sole = self._at_peak
        other = sole_of(edit, sole, self.feet)
        pose = swapped(steps, sole, other).poses[0, 0]
        return np.asarray(other.sole.outline @ pose[:2, :2].T + pose[:2, 3])

    @cached_property
    def _at_peak(self) -> tuple[Steps, PressingSole]:
        """Motion of its sole where its force was largest."""
        made_by, step = self.baked.pressed_by, self.baked
        assert made_by is not None
        steps, peak = made_by.steps(step.load_frames), int(step.load_n.argmax())
        at = slice(peak, peak + 1)
        return replace(steps, poses=steps.poses[at], centres=steps.centres[at]), made_by.pressing

    @cached_property
    def _touched(self) -> Array:
        step = self.baked
        row, column = np.divmod(step.contact_cells, step.window.columns)
        low = np.array([column.min(), row.min()]) + step.window[:2]
        high = np.array([column.max(), row.max()]) + step.window[:2] + 1
        corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])], float)
        return corners * step.cell_size


@dataclass(frozen=True, eq=False)
class ShownBake:
    """Steps of a bake in order, its footprints as they were left, the reach of rims [m], and the frame of all that."""

    steps: Sequence[BakedStep] = ()
    footprints: Sequence[Footprint] = ()
    rim_reach: float = 0.0
    frame: GroundFrame | None = None


NOTHING = ShownBake()


def bake_on(ground: bpy.types.Object | None) -> ShownBake:
    """The bake on a ground; nothing where there is none that can be read."""
    if ground is None or not baked_ground.is_baked(ground):
        return NOTHING
    try:
        stored = baked_ground.stored_record(ground)
        key = (mesh_of(baked_ground.display_mesh_of(ground)).session_uid, bytes(stored[-record.TAIL :]))
        if key not in state.shown_bake:
            loaded = record.load(bytes(stored))
            soles = feet(loaded.footprints)
            steps = [
                BakedStep(**vars(step), number=number, feet=soles) for number, step in enumerate(loaded.steps, start=1)
            ]
            about = loaded.about
            reach, frame = baked_ground.baked_with(about, "rim_reach"), baked_ground.frame_in(about["inputs"])
            state.shown_bake = {key: ShownBake(steps, loaded.edited, reach, frame)}
    except InputError:
        return NOTHING
    shown: ShownBake = state.shown_bake[key]
    return shown


def of(ground: bpy.types.Object | None) -> Sequence[BakedStep]:
    """The steps of the bake on the scene's ground, in their order; none where there is no bake that can be read."""
    return bake_on(ground).steps


def frame_of(ground: bpy.types.Object | None) -> GroundFrame | None:
    """The frame that these steps are in; None where that is the world's."""
    return bake_on(ground).frame


def chosen(ground: bpy.types.Object | None) -> list[BakedStep]:
    """All steps that are chosen, first the one that the panel shows."""
    steps = {step.name: step for step in of(ground)}
    return [steps[name] for name in session.chosen_steps() if name in steps]
