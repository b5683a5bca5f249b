"""Prediction of a bake before there is one, for panels and the overlay.

Nothing is computed while they are drawn: what has changed is worked out right after, and until then they show what they
knew last.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import bpy
from bpy.props import FloatProperty

from ...core.composers import prediction
from ...core.errors import InputError
from ...core.ground.ground_law import next_modulus
from ...core.loads.cell_limits import Fineness
from ...core.motion import motion
from ...core.settings import BakeSettings
from ...core.soles.deep_ground import wading
from .. import jobs, session, settings
from ..live import live
from ..operator_base import Act, OnShot
from ..reading import analysis
from ..remedies import said
from ..state import state
from ..translation import translated
from .modal_job import ReadingShot, Reports

SOON = 0.03
"""Time from the drawing that finds something changed until it is worked out anew [s]."""
AT_REST = 0.3
"""Time without a change after which the depth is worked out from all contacts, in place of a sample [s]."""

PART = 0.025
"""What is worked on before Blender has its turn again, beside the step that is being done when it is over [s]."""
PAUSE = 0.005
"""Time that Blender has until it is gone on [s]."""

_ENDED = object()


@dataclass(frozen=True)
class _Aim:
    """A depth that was typed [m], and the modulus that was set for it [Pa]."""

    depth: float
    modulus: float


@dataclass(frozen=True)
class DepthPrediction:
    """Knowledge of a bake to come.

    Attributes
    ----------
    analysis : Analysis
        The shot; masses and force models may have changed since.
    depth : float or None
        Of the typical print to expect [m], as it was known last.
    is_current : bool
        True if nothing has changed since.
    """

    analysis: analysis.Analysis
    depth: float | None
    is_current: bool


def fineness(wanted: BakeSettings, predicted: DepthPrediction) -> Fineness:
    """Fineness of the bake to come, with what legs will carve at the depth to expect."""
    length = motion.shortest_sole([character.motion for character in predicted.analysis.loads])
    return replace(wanted.fineness, is_carved=wanted.carves and bool(wading(predicted.depth or 0.0, length) > 0))


def look_anew() -> None:
    """Forget what was seen; for a timer, with which Blender's next turn begins."""
    state.seen.clear()


def look(scene: bpy.types.Scene) -> tuple[BakeSettings, DepthPrediction | None]:
    """The settings of a scene and the prediction if its shot is known, to be shown; looked at once in a turn.

    An outdated prediction is computed again soon.
    """
    if not bpy.app.timers.is_registered(look_anew):
        state.seen.clear()
        if not bpy.app.background:  # where there are no turns
            bpy.app.timers.register(look_anew, persistent=True)
    if scene.session_uid not in state.seen:
        wanted = settings.snapshot(scene)
        state.seen[scene.session_uid] = wanted, _prediction(analysis.known(wanted), wanted)
    seen: tuple[BakeSettings, DepthPrediction | None] = state.seen[scene.session_uid]
    return seen


def _prediction(known: analysis.Analysis | None, wanted: BakeSettings) -> DepthPrediction | None:
    """The prediction with some settings of a scene, by what is known of its shot."""
    uid = wanted.scene.uid
    if known is None:
        return None
    depth = analysis.known_depth(known, wanted)
    if depth is None:
        _stop_refining()
        if not bpy.app.timers.is_registered(_work_out):
            bpy.app.timers.register(_work_out, first_interval=SOON)
        return DepthPrediction(known, state.shown_depths.get(uid), is_current=False)
    state.shown_depths[uid] = depth
    return DepthPrediction(known, depth, is_current=True)


def shown_cm(options: Any) -> float:
    """The depth that was shown last for the scene of some settings [cm]; 0 before."""
    return (state.shown_depths.get(options.id_data.session_uid) or 0.0) * 100


def type_cm(options: Any, depth: float) -> None:
    """Set the stiffness so that the typical print gets a depth [cm]; says why where none gives it.

    Scripts without a window may set it before the shot was read, which is done then.
    """
    if not depth > 0:
        return
    scene = options.id_data
    try:
        wanted = settings.snapshot(scene)
        known = analysis.read(scene) if bpy.app.background else jobs.run(analysis.refreshing(wanted))
        if known is None:
            return
        if bpy.app.background or depth / 100 > wanted.material.deepest or not state.shown_depths.get(scene.session_uid):
            modulus = prediction.matching_modulus(known.contacts, wanted.material, depth / 100, wanted.pressure)
            scene.softground.material.youngs_modulus = modulus
        else:
            aim_at(scene, depth / 100)
    except InputError as error:
        if bpy.app.background:
            raise  # Blender writes it to the console
        message = said(error)
        bpy.context.window_manager.popup_menu(lambda menu, _: menu.layout.label(text=message), title="Depth")


def aim_at(scene: bpy.types.Scene, depth: float) -> None:
    """Set the stiffness so that the typical print gets about a depth [m]; it is put right as the depth is worked out.

    So a drag is answered at once.
    """
    material = scene.softground.material
    law = settings.snapshot(scene).material
    material.youngs_modulus = next_modulus(
        [(material.youngs_modulus, state.shown_depths[scene.session_uid])], depth, law
    )
    state.shown_depths[scene.session_uid] = depth
    state.aims[scene.session_uid] = _Aim(depth, material.youngs_modulus)


def settling(uid: int) -> jobs.Job[None]:
    """Set the stiffness of the scene of a session uid for the depth that was typed last, unless it is set otherwise
    meanwhile."""
    aim: _Aim | None = state.aims.pop(uid, None)
    if aim is None or (scene := settings.scene_with(uid)) is None:
        return
    wanted = settings.snapshot(scene)
    known = analysis.known(wanted)
    if known is None or scene.softground.material.youngs_modulus != aim.modulus:
        return
    search = prediction.matching_modulus.slices(known.contacts, wanted.material, aim.depth, wanted.pressure)
    with suppress(InputError):  # the stiffness that comes nearest stays
        modulus = yield from jobs.meanwhile(jobs.Progress("sample", 0.0), search)
        scene = settings.scene_with(uid)  # which an undo may have replaced
        if scene and scene.softground.material.youngs_modulus == aim.modulus:
            scene.softground.material.youngs_modulus = modulus


def _work_out() -> float | None:
    """Bring the predictions that are shown up to date, after live mode's prints."""
    if live.is_answering():
        return SOON
    if not state.predicting:
        state.predicting.extend(_working_out(wanted.scene.uid) for wanted in _shown())
    if not _is_done(state.predicting):
        return PAUSE
    if not state.aims and not bpy.app.timers.is_registered(_refine):
        bpy.app.timers.register(_refine, first_interval=AT_REST)
    return PAUSE if state.aims else None


def _working_out(uid: int) -> jobs.Job[None]:
    """Settle what was typed in the scene of a session uid, and work its depth out with the settings of then."""
    yield from settling(uid)
    if scene := settings.scene_with(uid):
        yield from analysis.working_out_depth(settings.snapshot(scene))


def _refine() -> float | None:
    """Press all contacts, where the depths that are shown come from a sample of them."""
    if live.is_answering():
        return AT_REST
    if not state.refining:
        state.refining.extend(map(analysis.pressing_all, _shown()))
    return None if _is_done(state.refining) else PAUSE


def _stop_refining() -> None:
    """Leave what is refined to the next time that nothing changes."""
    state.refining.clear()
    if bpy.app.timers.is_registered(_refine):
        bpy.app.timers.unregister(_refine)


def _shown() -> list[BakeSettings]:
    """Settings of the scenes in windows whose shot is known."""
    scenes = {window.scene for window in bpy.context.window_manager.windows}
    return list(filter(analysis.known, map(settings.snapshot, scenes)))


def _is_done(work: list[jobs.Job[None]]) -> bool:
    """Work for a part of a turn, from the last job on; return whether all is done, which is drawn."""
    until = time.perf_counter() + PART
    while work:
        if next(work[-1], _ENDED) is _ENDED:
            work.pop()
        elif time.perf_counter() > until and not bpy.app.background:
            return False
    session.redraw()
    if session.current().show_overlay:
        session.redraw(region_type="WINDOW")
    return True


def unregister() -> None:
    """Work nothing out any more."""
    for timer in (_work_out, _refine, look_anew):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)


class SOFTGROUND_OT_predict_depth(ReadingShot):
    """Read the animation and predict how deep the prints will be, before any bake. Esc cancels"""

    bl_idname = "softground.predict_depth"
    bl_label = "Predict Depth"
    cancelled = "Predict Depth cancelled"

    def _job_of(self) -> jobs.Job[Reports]:
        analysis.forget()
        known = yield from analysis.reading(self.scene)
        depth = yield from analysis.working_out_depth(settings.snapshot(self.scene))
        deepest = known.contacts.depths.max(initial=0.0)
        text = translated(
            "Typical step: {typical} cm deep; the deepest: {deepest} cm",
            typical=f"{(depth or 0.0) * 100:.1f}",
            deepest=f"{deepest * 100:.1f}",
        )
        return [("INFO", text)]


class SOFTGROUND_OT_match_depth(OnShot, Act):
    """Set the stiffness of the ground so that the typical step is as deep as you type"""

    bl_idname = "softground.match_depth"
    bl_label = "Match Depth"

    depth: FloatProperty(
        name="Depth (cm)", description="Depth of the typical step", default=5.0, min=0.01, soft_max=30.0, precision=2
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        depth = analysis.expected_depth(context.scene)
        if depth:
            self.depth = depth * 100
        return context.window_manager.invoke_props_dialog(self)

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        scene.softground.material.youngs_modulus = analysis.match_depth(scene, self.depth / 100)


CLASSES = (SOFTGROUND_OT_predict_depth, SOFTGROUND_OT_match_depth)
