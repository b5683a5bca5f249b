"""A ground that follows the timeline and the settings of its scene.

Blender does not report changes of settings: they are compared. After a change the shot is pressed again, a little at a
time and the newest steps first.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.carving.carved_step import is_deep
from ...core.composers.playhead import Playhead, footprints_of
from ...core.composers.relief_plan import with_shoe_treads
from ...core.errors import InputError
from ...core.ground.sparse_grid import Window
from ...core.loads.cell_limits import check_cell_size
from ...core.record import record
from ...core.record.pressed_ground import PressedGround
from ...core.settings import Acts, BakeSettings
from .. import jobs, settings
from ..baking import bake_report
from ..baking.publish import at_the_end, publish, sign, with_debris
from ..ground import baked_ground, ground_surface
from ..reading import analysis, staleness
from ..reading.shots import ground_of
from ..remedies import said
from .live_ground import LiveGround

Contact = tuple[Sequence[tuple[Window, NDArray[np.bool_]]], float, float]
"""Windows, each with those of its cells (rows, columns) that are in contact; size of the cells and reach of the rim
around them [m]."""

PART = 0.025
"""Processor time of a part of an answer, beside the frame that is being pressed when it ends [s]."""


class LiveMode:
    """A scene whose ground follows its timeline.

    Parameters
    ----------
    wanted : BakeSettings
        With its ground.
    known : analysis.Analysis
        Of its shot.
    ground : LiveGround
        Shows `playhead`.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        wanted: BakeSettings,
        known: analysis.Analysis,
        ground: LiveGround,
        playhead: Playhead,
    ) -> None:
        assert wanted.ground is not None
        self.scene = scene.session_uid
        self.rendering = False
        self.answered_at = 0.0  # on the clock of `time.perf_counter`
        self._refused: tuple[BakeSettings, str] | None = None
        self._answering: Generator[None] | None = None
        self._asked: BakeSettings | None = None
        self._can_start_over = True
        self._drawn_over: list[Window] = []
        self._owner, self._ground = wanted.ground, ground
        self._analysis, self._wanted, self._playhead = known, wanted, playhead

    def follow(self, scene: bpy.types.Scene) -> bool:
        """Show the ground at the scene's frame; False if the ground is gone or was changed by somebody else."""
        ground = self._object(scene)
        if ground is None:
            return False
        if bpy.app.background:  # where there are no timers, and nobody waits
            with suppress(InputError):  # the last reading stays shown
                self.answer(scene)
        before = self._playhead.frame
        windows = self._playhead.go_to(float(scene.frame_current))
        if self._playhead.frame != before:
            self._show(ground, windows)
        return True

    def _show(self, ground: bpy.types.Object, windows: Sequence[Window]) -> None:
        """Show changes in some windows, and wherever something else was shown in the meantime."""
        wanted, windows = self._wanted, [*windows, *self._drawn_over]
        self._ground.show(ground, self._playhead, windows, wanted.material.blur_sigma, wanted.frame_rate)
        self._drawn_over = []

    def _object(self, scene: bpy.types.Scene | None) -> bpy.types.Object | None:
        ground = scene.softground.ground if scene else None
        return self._ground.object(ground and baked_ground.display_mesh_of(ground))

    def show_anew(self, scene: bpy.types.Scene) -> bool:
        """Show the ground at the scene's frame whatever the mesh shows at the moment, as after an undo."""
        ground = self._object(scene)
        if ground is None:
            return False
        self._ground.take_from(ground)
        self._answering, self._can_start_over = None, True
        self._playhead.go_to(float(scene.frame_current))
        self._show(ground, self._playhead.ground.tile_windows())
        return True

    def answer(self, scene: bpy.types.Scene, seconds: float = np.inf) -> bool:
        """Press again with the present settings and animation, for a while; True if there is more.

        The newest steps follow a slider that is dragged: only the work after these begins anew with each setting.

        Parameters
        ----------
        seconds : float
            Of the processor [s]: where other programs take their share of it, Blender draws no oftener for that.

        Raises
        ------
        InputError
            If the shot cannot be read any more.
        """
        try:
            return self._answer(scene, time.thread_time() + seconds)
        finally:
            self.answered_at = time.perf_counter()

    def _answer(self, scene: bpy.types.Scene, until: float) -> bool:
        asked = settings.snapshot(scene)
        if self._can_start_over and self._is_another(scene, asked):
            if analysis.known(scene, asked) is None:
                if self._asked != asked and np.isfinite(until):  # to be read as a whole, but not while it is dragged
                    self._asked = asked
                    return False
                analysis.read(scene)
            self._answering, self._asked, self._can_start_over = self._pressing_again(asked), asked, False
        while self._answering is not None:
            if next(self._answering, _ENDED) is _ENDED:
                self._answering, self._can_start_over = None, True
            elif time.thread_time() > until:
                return True
        return False

    def has_more(self, scene: bpy.types.Scene) -> bool:
        """True if the ground does not show the present settings yet."""
        return self._answering is not None or self._is_another(scene, settings.snapshot(scene))

    def _is_another(self, scene: bpy.types.Scene, asked: BakeSettings) -> bool:
        """True if settings or animation differ from those that are being pressed, or were last."""
        if asked.ground is None or self._wanted.ground is None or asked.ground.uid != self._wanted.ground.uid:
            return False  # another ground wants another live mode
        if self.refusal(asked):
            return False
        if self._answering is None and analysis.known(scene, asked) is not self._analysis:
            return True
        last = self._wanted if self._answering is None else self._asked
        return last is None or (asked != last and _pressed_by(asked) != _pressed_by(last))

    @property
    def has_refused(self) -> bool:
        """True if there were settings that it did not press with."""
        return self._refused is not None

    def refusal(self, asked: BakeSettings) -> str:
        """Reason why settings are not pressed; empty if they are, or were not tried."""
        return self._refused[1] if self._refused is not None and self._refused[0] == asked else ""

    def _pressing_again(self, asked: BakeSettings) -> Generator[None]:
        """Press the shot up to the frame that is shown: the newest steps onto the present ground, then all of them."""
        scene = self.current_scene()
        assert scene is not None
        known = yield from _in_steps(analysis.refreshing(scene))
        if known is None:
            raise InputError("The shot can no longer be read: check that its characters and its ground are there.")
        try:
            check_cell_size(known.loads, asked.fineness, asked.longest_bake_s)
        except InputError as error:  # the last ground stays shown
            self._refused = asked, said(error)
            return
        whole = self._playhead
        if not self._presses_like(known, asked):
            if self._playhead.ground.cell_size == asked.cell_size_m:
                yield from self._pressing_newest(known, asked)
            self._can_start_over = True
            undisturbed = self._playhead.undisturbed
            looked_up = known.shot is self._analysis.shot and undisturbed.cell_size == asked.cell_size_m
            whole = Playhead(
                known.loads,
                ground_of(asked, known.shot),
                asked.cell_size_m,
                undisturbed=undisturbed if looked_up else None,
            )
            while whole.advance(self._frame()):
                yield
            whole.go_to(self._frame())
        windows = [*self._playhead.ground.tile_windows(), *whole.ground.tile_windows()]
        if whole.ground.cell_size != self._playhead.ground.cell_size:
            self._ground.forget_cells()
        self._playhead, self._analysis, self._wanted = whole, known, asked
        if shown_on := self._object(self.current_scene()):
            self._show(shown_on, windows)

    def _pressing_newest(self, known: analysis.Analysis, asked: BakeSettings) -> Generator[None]:
        """Show the newest steps as they will be; nothing where they are most of the shot."""
        since, shown = self._playhead.before_newest(), self._playhead.frame
        if since - self._playhead.first_frame < shown - since:
            return
        newest = self._playhead.pressed_anew(since, known.loads, ground_of(asked, known.shot))
        while newest.advance(shown):
            yield
        if ground := self._object(self.current_scene()):
            changed = [*self._playhead.changed_since(since), *newest.changed_since(since)]
            windows = [*changed, *self._drawn_over]
            self._ground.show(ground, newest, windows, asked.material.blur_sigma, asked.frame_rate)
            self._drawn_over = changed
            yield

    def _presses_like(self, known: analysis.Analysis, asked: BakeSettings) -> bool:
        """True if the ground that is shown need not be pressed again."""
        same_loads = known.loads is self._analysis.loads and known.shot is self._analysis.shot
        looks = replace(self._wanted.material, blur_sigma=asked.material.blur_sigma)
        return same_loads and _pressed_by(replace(self._wanted, material=looks)) == _pressed_by(asked)

    def current_scene(self) -> bpy.types.Scene | None:
        """The scene, which may be another one after an undo."""
        return next((scene for scene in bpy.data.scenes if scene.session_uid == self.scene), None)

    def _frame(self) -> float:
        scene = self.current_scene()
        return float(scene.frame_current) if scene else -np.inf

    def in_contact(self) -> Contact:
        """See `in_contact` of this module."""
        return self._playhead.in_contact(), self._playhead.ground.cell_size, self._wanted.material.rim_reach

    def keeping(self, scene: bpy.types.Scene) -> jobs.Job[None]:
        """Keep the ground as shown: as the bake of the frames up to now, with the settings that pressed them."""
        now = jobs.Progress("simulate", 0.0)
        with suppress(InputError):  # then the last ground is kept
            if self.has_more(scene):
                yield from analysis.reading(scene)
            while self.answer(scene, PART):
                yield now
        ground = self._object(scene)
        if ground is None:
            return
        playhead, loads, shot = self._playhead, self._playhead.loads_by_now(), self._analysis.shot
        asked = settings.snapshot(scene)
        made_with = replace(
            self._wanted,
            frames=(self._wanted.frames[0], int(playhead.frame)),
            shape_keys=asked.shape_keys,
            dense_shape_keys=asked.dense_shape_keys,
            tread_m=asked.tread_m,
            debris=asked.debris,
            weather=None,  # which live mode does not follow
        )
        with suppress(InputError):  # of soles that are flat; the prints are kept without a tread
            made_with = with_shoe_treads(made_with, shot.motions)
        movers, name = staleness.of_movers(scene.objects, made_with), settings.name_of(ground)
        footprints = yield from jobs.meanwhile(now, footprints_of.slices(playhead, loads))
        bodies = {motion.name for motion in shot.motions if motion.joints}
        if made_with.carves and any(is_deep(print) for print in footprints if print.character in bodies):
            made_with = replace(made_with, carve=False)  # live mode carves nothing
        yield now
        vertices = ground_surface.rest_vertices(settings.resolve(name), made_with.unit_scale_m, made_with.frame)
        pressing = PressedGround.at.slices(footprints, **at_the_end(made_with))
        shown = yield from jobs.meanwhile(now, pressing)
        looking = ground_surface.pressed_vertices.slices(vertices, shown.covers, shot.terrain)
        index = yield from jobs.meanwhile(now, looking)
        place = baked_ground.on_itself(settings.resolve(name), index, vertices)
        baked = record.BakeRecord(footprints, {"inputs": made_with.inputs(), "input_hash": ""})
        throwing = with_debris.slices(baked, ground_of(made_with, shot), made_with, loads)
        baked, debris = yield from jobs.meanwhile(now, throwing)
        published = yield from publish(baked, debris, place, made_with)
        sign(published, made_with, movers, summary=bake_report.summary_of_prints(baked.footprints))
        bake_report.note_prints(scene.softground)

    def discard(self) -> None:
        """Leave the ground as it was before."""
        ground = settings.find(self._owner) or self._ground.object(None)
        if ground is not None:
            baked_ground.clear(ground)


_ENDED = object()


def _in_steps(job: jobs.Job[jobs.Result]) -> Generator[None, None, jobs.Result]:
    """A job without its progress."""
    while True:
        try:
            next(job)
        except StopIteration as end:
            result: jobs.Result = end.value
            return result
        yield


def _pressed_by(wanted: BakeSettings) -> dict[str, Any]:
    """The settings on which the prints depend: the name of a preset is none of them."""
    return replace(wanted, preset="").between(Acts.READING, Acts.PRESSING)
