"""Base of operators with a job: a bar, Esc, and a hold on the other windows, while the user goes on looking."""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext
from typing import Any, ClassVar, Literal

import bpy

from ...core.errors import InputError, SoftGroundError
from ...core.settings import ObjectName
from .. import jobs, session, settings
from ..characters import character_setup
from ..operator_base import Act, OnShot, OperatorResult, reports_errors
from ..reading import analysis
from ..remedies import said
from ..state import state
from ..translation import translated
from .panel_base import CATEGORY

TICK = 0.02
"""Longest work between two looks at the user's events [s]; a single step of the bake may exceed it."""

TIMER_STEP = 0.001
"""Time left to the events between two ticks [s]; what they and Blender's drawing need beyond, they take."""

LONG_DRAWING = 0.02
"""Time that Blender took for itself after which its user's events come before more work [s]."""

SHOWN_FOR = 0.15
"""Shortest time between two drawings of the progress [s]: they cost more than many a tick."""

WORK_PER_DRAWING = 4.0
"""Least time for work, as a multiple of that for drawing, where drawing takes long."""

STAGE_NAMES = {"sample": "Reading the animation", "simulate": "Pressing the ground", "write": "Writing the ground"}

BUSY = "A bake is running, or an animation is being read: wait for it, or press Esc"
"""Why no other job begins."""

Reports = list[tuple[Literal["INFO", "WARNING"], str]]
"""What to say, and how urgent it is."""

_NAVIGATION = (
    "MOUSEMOVE",
    "INBETWEEN_MOUSEMOVE",
    "MIDDLEMOUSE",
    "WHEEL",
    "TRACKPAD",
    "MOUSEROTATE",
    "MOUSESMARTZOOM",
    "NDOF",
    "TIMER",
    "WINDOW_DEACTIVATE",
)
"""Events that change nothing in the file (first parts of their names): they go on to Blender during a bake."""


class ModalJob(Act):
    """Base of operators with a job: blocking in a script, modal for the user."""

    cancelled: ClassVar[str] = ""
    """What to say when the user has left the job, if not that."""

    keeps_shot: ClassVar[bool] = True
    """True if what was read of the shot still holds after what the job changes."""

    stage_names: ClassVar[dict[str, str]] = STAGE_NAMES
    """What the status bar says of each stage."""

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        return BUSY if session.current().is_baking else super().missing(context)

    def act(self, context: bpy.types.Context) -> None:
        self._scene = settings.name_of(context.scene)
        with self._changing():
            result = jobs.run(self._job_of())
        self._show(result)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        run = self.execute if bpy.app.background else self._start  # a modal operator gets no events in background
        return run(context)

    @property
    def scene(self) -> bpy.types.Scene:
        """The scene that the job began in, found anew each time: another window may show another one meanwhile."""
        return settings.scene_named(self._scene)

    def _job_of(self) -> jobs.Job[Any]:
        raise NotImplementedError

    def _changing(self) -> AbstractContextManager[None]:
        """What the scene's analysis makes of what the job changes."""
        return analysis.own_changes(self.scene) if self.keeps_shot else nullcontext()

    def _done(self, progress: jobs.Progress) -> float:
        """The finished part of the job."""
        return progress.overall

    @reports_errors
    def _start(self, context: bpy.types.Context) -> OperatorResult:
        self._scene = settings.name_of(context.scene)
        self._job = self._job_of()
        self._started = self._ticked = self._show_at = time.perf_counter()
        self._gave_way = False
        self._progress: jobs.Progress | None = None
        try:
            with self._changing():
                next(self._job)  # what cannot be baked is refused before anything moves
        except StopIteration as finished:  # done at once, as with a shot that is known
            self._show(finished.value)
            return {"FINISHED"}
        self._needed = _needed_by_job(self.scene) | _named(_parts_of_bodies(self.scene.softground))
        manager = context.window_manager
        self._timer = manager.event_timer_add(TIMER_STEP, window=context.window)
        self._workspace = context.workspace.name if context.workspace else ""
        manager.progress_begin(0.0, 1.0)
        self._show_status(0.0, translated(self.stage_names["sample"]))
        manager.modal_handler_add(self)
        state.jobs.append(self)
        for window in manager.windows:
            if window != context.window:
                with context.temp_override(window=window):
                    bpy.ops.softground.hold_window("INVOKE_DEFAULT")  # type: ignore[attr-defined]
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        if self not in state.jobs:
            return {"CANCELLED"}  # ended by `stop`
        if (event.type == "ESC" and event.value == "PRESS") or session.current().cancel_requested:
            self._end()
            text = self.cancelled or "{job} cancelled: nothing was changed"
            self.report({"INFO"}, translated(text, job=translated(self.bl_label)))
            return {"CANCELLED"}
        if event.type == "TIMER":
            try:
                return self._tick()
            finally:
                self._ticked = time.perf_counter()
        return {"PASS_THROUGH"} if _is_harmless(context, event) else {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """End the bake as Blender quits or opens another file."""
        self._end()

    def _tick(self) -> OperatorResult:
        now = time.perf_counter()
        waited = now - self._ticked
        if session.is_rendering():  # it reads what a bake reads and writes: it has the scene for itself
            self._started += waited
            if now > self._show_at:
                self._show_at = now + SHOWN_FOR
                self._show_status(session.current().progress, translated("Waiting for the render"))
            return {"PASS_THROUGH"}
        self._gave_way = waited > LONG_DRAWING and not self._gave_way
        if self._gave_way:  # to the events that have come while Blender drew: they wait for its drawing or a tick
            self._show_at = max(self._show_at, now + WORK_PER_DRAWING * waited)
            return {"PASS_THROUGH"}
        if self._progress and now > self._show_at:  # a tick works or has something drawn
            self._show_at = now + SHOWN_FOR
            self._show_progress(self._progress)
            return {"PASS_THROUGH"}
        try:
            _check_still_there(self._needed)
            is_done = self._work(until=now + TICK)
        except SoftGroundError as error:
            self._end()
            self.report({"ERROR"}, said(error))
            return {"CANCELLED"}
        except BaseException:
            self._end()
            raise
        if not is_done:
            return {"PASS_THROUGH"}
        self._end()
        self._show(self._result)
        return {"FINISHED"}

    def _work(self, until: float) -> bool:
        """Go on with the job until a time; True if it is done by then, with its result, which may be None."""
        self._needed |= _needed_by_job(self.scene)
        blocks = _count_of_blocks()

        def goes_on() -> bool:
            if self._progress and self._progress.overall >= 1.0:
                return True  # what is written is not cancelled
            drawn_anew = _count_of_blocks() != blocks  # the whole window, as soon as the tick ends
            return time.perf_counter() < until and not drawn_anew

        with self._changing():
            try:
                self._progress = next(self._job)
                while goes_on():
                    self._progress = next(self._job)
            except StopIteration as finished:
                self._result: Any = finished.value
                return True
        return False

    def _show_progress(self, progress: jobs.Progress) -> None:
        done = max(session.current().progress, self._done(progress))
        passed = time.perf_counter() - self._started
        remaining = passed * (1.0 - done) / max(done, 1e-3)
        bpy.context.window_manager.progress_update(done)
        stage = translated(self.stage_names[progress.stage])
        self._show_status(done, translated("{stage}: {time} s left", stage=stage, time=max(1, round(remaining))))

    def _show_status(self, progress: float, status: str) -> None:
        label, end = translated(self.bl_label), translated("[Esc] Cancel")
        self._write_status_bar(f"{label} {progress:.0%}  |  {status}  |  {end}")
        session.show_bake(progress, status)

    def _write_status_bar(self, text: str | None) -> None:
        workspace = bpy.data.workspaces.get(self._workspace)
        if workspace:
            workspace.status_text_set(text)

    def _end(self) -> None:
        """Leave nothing behind: no job, no timer, no progress. What the job has not written yet is never written."""
        if self not in state.jobs:
            return
        state.jobs.remove(self)
        self._job.close()
        manager = bpy.context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        self._write_status_bar(None)
        session.current().cancel_requested = False
        session.show_no_bake()

    def _show(self, result: Any) -> None:
        raise NotImplementedError


class Reading(ModalJob):
    """Base of operators that read the shot for its prediction."""

    keeps_shot = False

    def _done(self, progress: jobs.Progress) -> float:
        return progress.fraction

    def _show(self, result: Any) -> None:
        for kind, text in result:
            self.report({kind}, text)


class ReadingShot(OnShot, Reading):
    """Base of operators that read the shot as it is."""

    bl_options = {"REGISTER"}


class SOFTGROUND_OT_hold_window(bpy.types.Operator):
    """Block changes from a window while a bake runs in another one"""

    bl_idname = "softground.hold_window"
    bl_label = "Wait for the Bake"
    bl_options = {"INTERNAL"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> OperatorResult:
        if not state.jobs:
            return {"FINISHED", "PASS_THROUGH"}
        if event.type == "ESC" and event.value == "PRESS":
            session.current().cancel_requested = True
        return {"PASS_THROUGH"} if _is_harmless(context, event) else {"RUNNING_MODAL"}


class SOFTGROUND_OT_cancel_bake(Act):
    """Stop the bake; the scene stays as it was"""

    bl_idname = "softground.cancel_bake"
    bl_label = "Cancel Bake"
    bl_options = {"INTERNAL"}

    @classmethod
    def missing(cls, _context: bpy.types.Context) -> str:
        return "" if session.current().is_baking else "No bake is running"

    def act(self, context: bpy.types.Context) -> None:
        session.current().cancel_requested = True


def stop() -> None:
    """End the bake that may be running, as the scene that it works on is about to be replaced."""
    for operator in list(state.jobs):
        operator._end()


def why_no_start(context: bpy.types.Context) -> str:
    """Reason that keeps a bake or live mode from starting, or an empty text."""
    if session.current().is_baking:
        return BUSY
    if session.is_rendering():
        return "A render is running: wait until it has ended"
    if not character_setup.characters_of(settings.options_of(context)):
        return "Add a character first: select its armature and press Add Character"
    return ""


def _needed_by_job(scene: bpy.types.Scene) -> dict[int, str]:
    """Scene, grounds, rigs, bodies and soles that a job reads: their names, by their identifiers in this session."""
    options = scene.softground
    soles = [sole.object for character in options.characters for sole in character.soles]
    rigs = [character.armature or character.body for character in options.characters]
    return _named((scene, *settings.listed_grounds(options), *rigs, *soles))


def _parts_of_bodies(options: Any) -> list[bpy.types.Object]:
    """Parts of bodies without an armature; to find them, Blender goes through all objects of the file."""
    return [part for character in options.characters if character.body for part in character.body.children_recursive]


def _named(blocks: Iterable[bpy.types.ID | None]) -> dict[int, str]:
    return {block.session_uid: block.name for block in blocks if block}


def _count_of_blocks() -> int:
    """Number of the file's data-blocks of the kinds that a bake makes."""
    data = bpy.data
    return sum(len(kind) for kind in (data.scenes, data.objects, data.meshes, data.materials, data.node_groups))


def _check_still_there(needed: dict[int, str]) -> None:
    """Raise InputError if something that a job reads was deleted meanwhile: Blender does not survive its use."""
    present = {uid for scene in bpy.data.scenes for uid in _needed_by_job(scene)}  # Blender takes out what is deleted
    for uid, name in needed.items():
        if uid not in present and settings.find(ObjectName(name, uid)) is None:
            raise InputError(f"'{name}' was deleted while the bake read it: nothing was changed. Bake again.")


def _is_harmless(context: bpy.types.Context, event: bpy.types.Event) -> bool:
    """True if an event neither edits, saves nor renders: it navigates, or clicks in grey panels."""
    if event.type.startswith(_NAVIGATION):
        return not event.ctrl  # the wheel turns a field's value with it
    if event.type != "LEFTMOUSE":
        return False
    for area in context.screen.areas if context.screen else ():
        for region in area.regions:
            if (
                area.type == "VIEW_3D"
                and region.type == "UI"
                and region.active_panel_category == CATEGORY
                and 0 <= event.mouse_x - region.x < region.width
                and 0 <= event.mouse_y - region.y < region.height
            ):
                return True
    return False


CLASSES = (SOFTGROUND_OT_hold_window, SOFTGROUND_OT_cancel_bake)
