"""Grounds that follow the timeline and the settings of their scene.

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
from ...core.composers.floor_prints import floor_prints
from ...core.composers.playhead import Playhead, footprints_of
from ...core.composers.pressed_shot import shares_of
from ...core.composers.relief_plan import with_shoe_treads
from ...core.errors import InputError
from ...core.ground.sparse_grid import Window
from ...core.loads.cell_limits import check_cell_size
from ...core.loads.estimate import CharacterLoads
from ...core.record import record
from ...core.record.footprints import Footprint
from ...core.record.pressed_ground import PressedGround
from ...core.settings import Acts, BakeSettings, ObjectName
from .. import jobs, settings
from ..baking import bake_report
from ..baking.publish import Published, at_the_end, publish, sign, until_ready, with_debris
from ..ground import baked_ground, ground_surface
from ..reading import analysis, staleness
from ..reading.shots import ground_of
from ..remedies import said
from ..translation import translated
from .live_part import LivePart, touched

Contact = tuple[Sequence[tuple[Window, NDArray[np.bool_]]], float, float]
"""Windows, each with those of its cells (rows, columns) that are in contact; size of the cells and reach of the rim
around them [m]."""

_Shares = Sequence[Sequence[CharacterLoads]]
"""From `shares_of`."""

PART = 0.025
"""Processor time of a part of an answer, beside the frame that is being pressed when it ends [s]."""


class LiveMode:
    """A scene whose grounds follow its timeline.

    Parameters
    ----------
    wanted : BakeSettings
        With its ground.
    known : analysis.Analysis
        Of its shot.
    parts : sequence of LivePart
        The grounds that soles touch, or the first.
    """

    def __init__(self, wanted: BakeSettings, known: analysis.Analysis, parts: Sequence[LivePart]) -> None:
        assert wanted.ground is not None
        self.scene = wanted.scene.uid
        self.rendering = False
        self.answered_at = 0.0  # on the clock of `time.perf_counter`
        self._refused: tuple[BakeSettings, analysis.Analysis, str] | None = None
        self._answering: Generator[None] | None = None
        self._asked: BakeSettings | None = None
        self._can_start_over = True
        self._parts = tuple(parts)
        self._analysis, self._wanted = known, wanted
        self._shares: tuple[analysis.Analysis, list[float], _Shares] | None = None

    def follow(self) -> bool:
        """Show the grounds at the scene's frame; False if one is gone or was changed by somebody else."""
        shown = self._objects()
        if shown is None:
            return False
        if bpy.app.background:  # where there are no timers, and nobody waits
            with suppress(InputError):  # the last reading stays shown
                self.answer()
        for part, obj in zip(self._parts, shown, strict=True):
            part.go_to(obj, self._frame(), self._wanted)
        return True

    def _listed(self) -> list[bpy.types.Object]:
        """The grounds of the scene."""
        scene = settings.scene_with(self.scene)
        return settings.listed_grounds(scene.softground) if scene else []

    def _objects(self) -> list[bpy.types.Object] | None:
        """What shows the prints of each part; None if any of them is gone."""
        listed = self._listed()
        shown = [obj for obj in (part.object(listed) for part in self._parts) if obj is not None]
        return shown if len(shown) == len(self._parts) else None

    def show_anew(self) -> bool:
        """Show the grounds at the scene's frame whatever the meshes show at the moment, as after an undo."""
        shown = self._objects()
        if shown is None:
            return False
        self._answering, self._can_start_over = None, True
        for part, obj in zip(self._parts, shown, strict=True):
            part.show_anew(obj, self._frame(), self._wanted)
        return True

    def answer(self, seconds: float = np.inf) -> bool:
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
            return self._answer(time.thread_time() + seconds)
        finally:
            self.answered_at = time.perf_counter()

    def _answer(self, until: float) -> bool:
        scene = self._here()
        asked = settings.snapshot(scene)
        if self._can_start_over and self._is_another(asked):
            if analysis.known(asked) is None:
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

    def has_more(self) -> bool:
        """True if the ground does not show the present settings yet."""
        return self._answering is not None or self._is_another(settings.snapshot(self._here()))

    def _is_another(self, asked: BakeSettings) -> bool:
        """True if settings or animation differ from those that are being pressed, or were last."""
        if self._left_out():
            return False  # other grounds want another live mode
        known = analysis.known(asked)
        if self._refused and self._refused[0] == asked and known is self._refused[1]:
            return False
        if self._answering is None and known is not self._analysis:
            return True
        last = self._wanted if self._answering is None else self._asked
        return last is None or (asked != last and _pressed_by(asked) != _pressed_by(last))

    def _left_out(self) -> str:
        """Name of a part that is not among the grounds of its scene any more; empty where all are."""
        listed = {ground.session_uid for ground in settings.grounds_of(self._here().softground)}
        return next((part.owner.name for part in self._parts if part.owner.uid not in listed), "")

    def refusal(self) -> str:
        """Reason why the present settings are not pressed; empty if they are, or were not tried."""
        if name := self._left_out():
            return translated("'{name}' is not among the grounds any more: list it again, or end live mode", name=name)
        refused = self._refused
        return refused[2] if refused and refused[0] == settings.snapshot(self._here()) else ""

    def _pressing_again(self, asked: BakeSettings) -> Generator[None]:
        """Press the shot up to the frame that is shown: the newest steps onto the present ground, then all of them."""
        known = yield from jobs.meanwhile(None, analysis.refreshing(asked))
        if known is None:
            raise InputError("The shot can no longer be read: check that its characters and its ground are there.")
        try:
            check_cell_size(known.loads, asked.fineness, asked.longest_bake_s)
        except InputError as error:  # the last ground stays shown
            self._refused = asked, known, said(error)
            return
        wholes = [part.playhead for part in self._parts]
        if not self._presses_like(known, asked):
            shares = yield from self._shared(known, asked)
            numbers = [part.number_in(asked) for part in self._parts]
            if fault := _not_shown(shares, numbers):
                self._refused = asked, known, fault
                return
            if self._parts[0].playhead.ground.cell_size == asked.cell_size_m:
                for part, number in zip(self._parts, numbers, strict=True):
                    yield from part.pressing_newest(self._listed, asked, known.shot, shares[number])
            self._can_start_over = True
            wholes = [self._begun(*each, known, asked, shares) for each in zip(self._parts, numbers, strict=True)]
            for whole in wholes:
                while whole.advance(self._frame()):
                    yield
            for whole in wholes:
                whole.go_to(self._frame())
        self._analysis, self._wanted, self._refused = known, asked, None
        for part, whole in zip(self._parts, wholes, strict=True):
            part.take_over(whole, part.object(self._listed()), asked)

    def _shared(self, known: analysis.Analysis, asked: BakeSettings) -> Generator[None, None, _Shares]:
        """What of the loads each ground bears, which is looked up once for a shot: no slider waits for it."""
        landing = [each.material.characteristic_time for each in asked.of_each_ground]
        if self._shares is None or self._shares[0] is not known or self._shares[1] != landing:
            sharing = shares_of(asked, known.shot.motions, known.loads, known.shot.terrain)
            self._shares = known, landing, (yield from sharing)
        return self._shares[2]

    def _begun(
        self, part: LivePart, number: int, known: analysis.Analysis, asked: BakeSettings, shares: _Shares
    ) -> Playhead:
        """A simulation of a part, the ground of a number, by other settings, at its beginning."""
        undisturbed = part.playhead.undisturbed
        looked_up = known.shot is self._analysis.shot and undisturbed.cell_size == asked.cell_size_m
        return Playhead(
            shares[number],
            ground_of(asked.of_each_ground[number], known.shot.of_each_ground[number]),
            asked.cell_size_m,
            undisturbed=undisturbed if looked_up else None,
        )

    def _presses_like(self, known: analysis.Analysis, asked: BakeSettings) -> bool:
        """True if the ground that is shown need not be pressed again."""
        same_loads = known.loads is self._analysis.loads and known.shot is self._analysis.shot
        looks = replace(self._wanted.material, blur_sigma=asked.material.blur_sigma)
        return same_loads and _pressed_by(replace(self._wanted, material=looks)) == _pressed_by(asked)

    def _here(self) -> bpy.types.Scene:
        scene = settings.scene_with(self.scene)
        assert scene is not None
        return scene

    def _frame(self) -> float:
        scene = settings.scene_with(self.scene)
        return float(scene.frame_current) if scene else -np.inf

    def in_contact(self) -> Contact:
        """See `in_contact` of this module."""
        touching = [contact for part in self._parts for contact in part.playhead.in_contact()]
        return touching, self._parts[0].playhead.ground.cell_size, self._wanted.material.rim_reach

    def keeping(self) -> jobs.Job[None]:
        """Keep the grounds as shown: as the bake of the frames up to now, with the settings that pressed them.

        Raises
        ------
        InputError
            If one of them cannot be changed; then all are as they were.
        """
        self._check_writable()
        now = jobs.Progress("simulate", 0.0)
        with suppress(InputError):  # then the last ground is kept
            if self.has_more():
                yield from analysis.reading(self._here())
            while self.answer(PART):
                yield now
        shown = self._objects()
        if shown is None:
            return
        names, shot = [settings.name_of(obj) for obj in shown], self._analysis.shot
        made_with = self._kept_with(settings.snapshot(self._here()))
        of_each = [made_with.of_each_ground[part.number_in(made_with)] for part in self._parts]
        movers = [staleness.of_movers(self._here().objects, each) for each in of_each]
        pressed = []
        for part in self._parts:
            loads = part.playhead.loads_by_now()
            pressed.append((yield from jobs.meanwhile(now, footprints_of.slices(part.playhead, loads))))
        bodies = {motion.name for motion in shot.motions if motion.joints}
        deep = any(is_deep(each) for prints in pressed for each in prints if each.character in bodies)
        if made_with.carves and deep:
            of_each = [replace(each, carve=False) for each in of_each]  # live mode carves nothing
        yield now
        writing: list[tuple[jobs.Job[Published], Sequence[Footprint]] | None] = []
        for part, name, each, footprints in zip(self._parts, names, of_each, pressed, strict=True):
            if footprints or len(self._parts) == 1:
                writing.append((yield from self._writing(part, name, each, footprints, not any(writing))))
            else:
                writing.append(None)
        for waiting in filter(None, writing):
            yield from until_ready(waiting[0])
        baked_at = {bake_report.BAKED_AT: time.time()}
        for part, job, each, moved in zip(self._parts, writing, of_each, movers, strict=True):
            if job is None:  # no step is on it by now
                part.discard()
                continue
            published = (yield from job[0]) if len(writing) == 1 else jobs.run(job[0])
            sign(published, each, moved, summary=bake_report.summary_of_prints(job[1]) | baked_at)
        bake_report.note_prints(self._here().softground)

    def _kept_with(self, asked: BakeSettings) -> BakeSettings:
        """Settings of the bake that is kept, with the present ones of what does not press."""
        made_with = replace(
            self._wanted,
            frames=(self._wanted.frames[0], int(self._parts[0].playhead.frame)),
            shape_keys=asked.shape_keys,
            dense_shape_keys=asked.dense_shape_keys,
            tread_m=asked.tread_m,
            debris=asked.debris,
            weather=None,  # which live mode does not follow
            grounds=tuple(replace(each, weather=None) for each in self._wanted.grounds),
        )
        with suppress(InputError):  # of soles that are flat; the prints are kept without a tread
            made_with = with_shoe_treads(made_with, self._analysis.shot.motions)
        return made_with

    def _writing(
        self, part: LivePart, name: ObjectName, made_with: BakeSettings, footprints: list[Footprint], has_floors: bool
    ) -> jobs.Job[tuple[jobs.Job[Published], Sequence[Footprint]]]:
        """The job that publishes the prints of a part on the object of a name, and these; with the steps on hard floors
        if it has those."""
        now, shot = jobs.Progress("simulate", 0.0), self._analysis.shot.of_each_ground[part.number_in(self._wanted)]
        vertices = ground_surface.rest_vertices(settings.resolve(name), made_with.unit_scale_m, made_with.frame)
        pressing = PressedGround.at.slices(footprints, **at_the_end(made_with))
        shown = yield from jobs.meanwhile(now, pressing)
        looking = ground_surface.pressed_vertices.slices(vertices, shown.covers, shot.terrain)
        index = yield from jobs.meanwhile(now, looking)
        place = baked_ground.on_itself(settings.resolve(name), index, vertices)
        baked = record.BakeRecord(footprints, {"inputs": made_with.inputs(), "input_hash": ""})
        loads = part.playhead.loads_by_now()
        if has_floors:
            treading = floor_prints.slices(loads, self._analysis.shot.terrain, made_with.cell_size_m)
            baked = replace(baked, on_floors=(yield from jobs.meanwhile(now, treading)))
        throwing = with_debris.slices(baked, ground_of(made_with, shot), made_with, loads)
        baked, debris = yield from jobs.meanwhile(now, throwing)
        return publish(baked, debris, place, made_with), baked.footprints

    def discard(self) -> None:
        """Leave the grounds as they were before; all as they are if one of them cannot be changed (InputError)."""
        self._check_writable()
        for part in self._parts:
            part.discard()
        if scene := settings.scene_with(self.scene):
            bake_report.note_prints(scene.softground)

    def _check_writable(self) -> None:
        for part in self._parts:
            part.check_writable()


_ENDED = object()


def _not_shown(shares: _Shares, followed: Sequence[int]) -> str:
    """Reason if soles touch a ground that does not follow the timeline, by the numbers of those that do."""
    if {number for number, loads in enumerate(shares) if touched(loads)} <= {*followed}:
        return ""
    return translated("Steps are on other grounds by now: end live mode, and start it again")


def _pressed_by(wanted: BakeSettings) -> dict[str, Any]:
    """The settings on which the prints depend: the name of a preset is none of them."""
    return replace(wanted, preset="").between(Acts.READING, Acts.PRESSING)
