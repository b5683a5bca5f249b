"""The finished ground while a step is dragged over it: only where it changes is looked up, and nothing is stored."""

from __future__ import annotations

from collections.abc import Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.ground.sparse_grid import Window
from ...core.numerics.arrays import Array
from ...core.record.edits import StepEdit
from ...core.record.footprints import Footprint
from ...core.record.pressed_ground import sample_at
from .. import session, settings
from ..baking.publish import at_the_end
from ..baking.step_edits import EditableBake
from ..debris import debris_object
from ..ground import baked_ground, ground_mesh, ground_surface
from ..playback import display_key, playback

REACH = 4.0
"""How far around a print the display blur spreads it, in its standard deviations."""


class StepPreview:
    """The ground of a bake, finished, as it would be with other edits."""

    def __init__(self, ground: bpy.types.Object, bake: EditableBake) -> None:
        shown = baked_ground.display_mesh_of(ground)
        self._bake, self._name = bake, settings.name_of(shown)
        unit_scale, frame = bake.made_with.unit_scale_m, bake.made_with.frame
        place = ground_surface.rest_vertices(shown, unit_scale, frame)
        self._x, self._y = np.ascontiguousarray(place.T[:2])  # axis by axis: looked through at each move
        self._up = ground_surface.up_of(shown, unit_scale, frame)
        self._before = ground_mesh.displayed_positions(shown)
        self._rest = ground_mesh.rest_positions(ground_mesh.mesh_of(shown))
        self._changed: list[Window] = []
        debris = debris_object.of(ground)
        self._pieces = debris_object.Pieces(debris, unit_scale) if debris else None
        self._hidden = [modifier.name for modifier in shown.modifiers if modifier == playback.modifier_of(shown)]
        self._show_playback(False)
        session.show_preview(True)

    def show(self, edits: Mapping[str, StepEdit]) -> None:
        """Show the ground with these edits."""
        edited = self._bake.with_edits(edits)
        baked = self._bake.record
        windows = _windows(dict(enumerate(baked.footprints)), baked.pressed_again, edited.pressed_again)
        windows += _windows({}, baked.laid_carves, edited.laid_carves)
        near = np.flatnonzero(self._within([*windows, *self._changed], self._x, self._y))
        self._changed = windows
        positions = self._before.copy()
        made_with = self._bake.made_with
        sample = sample_at(edited.shaping, self._x[near], self._y[near], **at_the_end(made_with))
        positions[near] = self._rest[near] + (sample.display[:, None] * self._up).astype(np.float32)
        self._write(positions)
        if self._pieces:  # of those that move, and on ground that moves: they are thrown anew once the step is let go
            before = {step.index: step.edit for step in self._bake.record.steps}
            changed = [step.index for step in edited.steps if step.edit != before.get(step.index)]
            place = self._pieces.place.T
            self._pieces.hide(np.isin(self._pieces.step, changed) | self._within(windows, *place))

    def end(self) -> None:
        """Show the bake as it was."""
        session.show_preview(False)
        self._write(self._before)
        if self._pieces:
            self._pieces.hide(np.zeros(len(self._pieces.step), bool))
        self._show_playback(True)

    def _within(self, windows: list[Window], x: Array, y: Array) -> NDArray[np.bool_]:
        """Which of some places (N,) [m] are on ground that some windows may move."""
        size = self._bake.made_with.cell_size_m
        margin = REACH * self._bake.made_with.material.blur_sigma
        inside = np.zeros(len(x), bool)
        for window in windows:
            low, high = window.corners(size)
            low, high = low - margin, high + margin
            inside |= (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1])
        return inside

    def _write(self, positions: NDArray[np.float32]) -> None:
        mesh = ground_mesh.mesh_of(settings.resolve(self._name))
        keys = mesh.shape_keys
        shown = keys.key_blocks.get(display_key.DISPLAY_KEY) if keys else None
        if shown is not None:
            shown.points.foreach_set("co", positions.ravel())
            mesh.update()
        else:
            ground_mesh.write_positions(mesh, positions)

    def _show_playback(self, shown: bool) -> None:
        for name in self._hidden:
            settings.resolve(self._name).modifiers[name].show_viewport = shown


def _windows(
    unedited: Mapping[int, Footprint], before: Mapping[int, Footprint | None], after: Mapping[int, Footprint | None]
) -> list[Window]:
    """Windows in which the prints of two sets of edits differ."""
    pairs = ([prints.get(n, unedited.get(n)) for prints in (before, after)] for n in sorted({*before, *after}))
    return [side.window for pair in pairs if pair[0] is not pair[1] for side in pair if side]
