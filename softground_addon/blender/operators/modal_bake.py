"""The bake and other jobs as the user runs them: in steps between events, with progress, time left, and a way out."""

from __future__ import annotations

from typing import Any, ClassVar

import bpy

from .. import jobs, session
from ..baking import bake_job, clean_feet, make_keys, root_motion, sink_feet
from ..translation import translated
from . import prediction, show_prints
from .modal_job import STAGE_NAMES, ModalJob, why_no_start


class _Bake(ModalJob):
    """Base of operators that bake."""

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        is_live = session.current().is_live
        return why_no_start(context) or ("Live mode is on: press Keep or Discard first" if is_live else "")


class _Pressing(_Bake):
    """Base of operators that press the ground."""

    def _job_of(self) -> jobs.Job[bake_job.BakeResult]:
        yield from prediction.settling(self.scene.session_uid)
        return (yield from self._pressed())

    def _pressed(self) -> jobs.Job[bake_job.BakeResult]:
        raise NotImplementedError


class _BakeFootprints(_Pressing):
    """Base of both buttons that bake."""

    cancelled = "Bake cancelled: nothing was changed"

    def _pressed(self) -> jobs.Job[bake_job.BakeResult]:
        self._is_first = show_prints.is_first_bake(self.scene)
        return bake_job.bake(self.scene)

    def _show(self, result: bake_job.BakeResult) -> None:
        totals: Any = result.report["totals"]
        text = translated(
            "{count} steps, deepest print {depth} cm",
            count=totals["steps"],
            depth=f"{totals['max_depth_m'] * 100:.1f}",
        )
        steps: Any = result.report["steps"]
        scene = bpy.context.scene
        seen_from = "frame_end" if self._is_first else "frame_start"  # a first bake shows what a foot has left
        if steps and all(scene.frame_current < step[seen_from] for step in steps):
            if bpy.app.background:
                text = translated("{summary}. Press Play to see them", summary=text)
            else:  # the ground would look as it did before
                scene.frame_set(show_prints.last_step(scene.softground))
        if steps and self._is_first:
            show_prints.show_first(scene, bpy.context.area)
        self.report({"INFO"}, text)
        warnings: Any = result.report["warnings"]
        for warning in warnings:  # the status bar shows the last that is told
            self.report({"WARNING"}, warning)


class SOFTGROUND_OT_bake(_BakeFootprints):
    """Press the footprints of all characters into the ground, over the whole frame range. Esc cancels"""

    bl_idname = "softground.bake"
    bl_label = "Bake Footprints"


class SOFTGROUND_OT_bake_again(_BakeFootprints):
    """Something has changed since the last bake: bake again. Esc cancels"""

    bl_idname = "softground.bake_again"
    bl_label = "Bake Again"

    @classmethod
    def description(cls, _context: bpy.types.Context, _properties: Any) -> str:
        """Changes since the bake, all of them: the panel has a line."""
        return "\n".join((translated(cls.bl_description), *session.current().stale.splitlines()))


class SOFTGROUND_OT_sink_feet(_Pressing):
    """Lower the feet into their prints, with hips and knees: switches Grounding on and bakes it as a layer above the
    animation. The prints do not change, and Clear Bake removes the layer. Esc cancels"""

    bl_idname = "softground.sink_feet"
    bl_label = "Sink Feet"

    def _pressed(self) -> jobs.Job[bake_job.BakeResult]:
        return sink_feet.sink_feet(self.scene)

    def _show(self, result: bake_job.BakeResult) -> None:
        gaps: Any = result.report["gaps_mm"]
        largest = max(gap["max"] for of_one in gaps["after"].values() for gap in of_one.values())
        text = translated("Feet stand on their prints; the largest gap left is {gap} mm", gap=f"{largest:.1f}")
        self.report({"INFO"}, text)


class _ChangingTheMotion(_Bake):
    """Base of operators whose layer changes the motion that bakes read."""

    keeps_shot = False


class SOFTGROUND_OT_clean_feet(_ChangingTheMotion):
    """Stop planted feet from sliding, floating and sinking, on the ground as a hard floor, or on a flat one. Hips
    and legs follow, in a layer above the animation that Clear Bake removes. Esc cancels"""

    bl_idname = "softground.clean_feet"
    bl_label = "Clean Feet"
    stage_names: ClassVar[dict[str, str]] = STAGE_NAMES | {
        "simulate": "Setting the feet down",
        "write": "Writing the layer",
    }

    def _job_of(self) -> jobs.Job[clean_feet.CleanFeet]:
        return clean_feet.clean_feet(self.scene)

    def _show(self, result: clean_feet.CleanFeet) -> None:
        self.report({"INFO"}, result.summary)
        for warning in result.warnings:
            self.report({"WARNING"}, warning)


class SOFTGROUND_OT_make_keys(_ChangingTheMotion):
    """Write what is seen of each character with layers as keys of a new action, for engines and exports. The layers
    go, and your action is kept. Esc cancels"""

    bl_idname = "softground.make_keys"
    bl_label = "Make Keys"

    def _job_of(self) -> jobs.Job[tuple[make_keys.MadeKeys, ...]]:
        return make_keys.make_keys(self.scene)

    def _show(self, result: tuple[make_keys.MadeKeys, ...]) -> None:
        for made in result:
            self.report({"INFO"}, made.summary)
            if made.warning:
                self.report({"WARNING"}, made.warning)


class SOFTGROUND_OT_root_motion(_ChangingTheMotion):
    """Make a cycle on the spot travel as fast as its standing feet imply: keys on the root bone, or else on the
    armature, in a layer of their own. Esc cancels"""

    bl_idname = "softground.root_motion"
    bl_label = "Root Motion"
    stage_names: ClassVar[dict[str, str]] = STAGE_NAMES | {
        "simulate": "Measuring the feet",
        "write": "Writing the layer",
    }

    def _job_of(self) -> jobs.Job[tuple[root_motion.Travel, ...]]:
        return root_motion.root_motion(self.scene)

    def _show(self, result: tuple[root_motion.Travel, ...]) -> None:
        for travel in result:
            self.report({"INFO"}, travel.summary)
            if travel.caveat:
                self.report({"WARNING"}, travel.caveat)


CLASSES = (
    SOFTGROUND_OT_bake,
    SOFTGROUND_OT_bake_again,
    SOFTGROUND_OT_sink_feet,
    SOFTGROUND_OT_clean_feet,
    SOFTGROUND_OT_root_motion,
    SOFTGROUND_OT_make_keys,
)
