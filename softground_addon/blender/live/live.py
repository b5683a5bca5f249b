"""Live mode: the ground gives way while the timeline plays, is stepped or is scrubbed.

No modal operator is needed for it: a handler follows the frame, so that autosave, undo and every other tool go on
working. While live mode is on, the ground carries what a bake would leave on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.ground.heightfield import Window
from ...core.ground_plan import plan_ground
from ...core.meshing.refinement import refine
from ...core.numerics.cell_keys import cells_at, keys_at
from ...core.playhead import Playhead
from ...core.record import record
from ...core.record.pressed_ground import PressedGround
from ...core.settings import Acts, BakeSettings
from .. import jobs, session, settings
from ..baking import bake_report
from ..baking.bake_checks import coverage, shortest_sole, wants_detail
from ..baking.publish import at_the_end, publish, sign
from ..characters.character_setup import characters_of
from ..ground import baked_ground, ground_mesh, trail_detail
from ..ground.created_ground import create_ground, reach_of
from ..ground.modified_prints import are_undone
from ..operator_base import reports_errors
from ..reading import analysis, staleness
from ..reading.shots import ground_of, settings_of
from .live_ground import LiveGround

Contact = tuple[Sequence[tuple[Window, NDArray[np.bool_]]], float, float]
"""Windows, each with those of its cells (rows, columns) that are in contact; size of the cells and reach of the rim
around them [m]."""


class LiveMode:
    """A scene whose ground follows its timeline.

    Parameters
    ----------
    scene : bpy.types.Scene

    Raises
    ------
    InputError
        If the scene could not be baked either.
    """

    def __init__(self, scene: bpy.types.Scene) -> None:
        wanted = settings_of(scene)
        known = analysis.read(scene)
        if wanted.ground is None:
            assert known.shot.plan is not None
            with analysis.own_changes(scene):
                ground = create_ground(scene, wanted, known.shot.plan)
            wanted = replace(wanted, ground=settings.name_of(ground))
            known = analysis.read(scene)
        assert wanted.ground is not None
        self.scene = scene.session_uid
        self.rendering = False
        self._owner = wanted.ground
        self._ground = _display_mesh(wanted, known)
        self._begin(wanted, known)

    def _begin(self, wanted: BakeSettings, known: analysis.Analysis) -> None:
        self._analysis, self._wanted = known, wanted
        self._playhead = Playhead(known.loads, ground_of(wanted, known.shot), wanted.cell_size_m)

    def follow(self, scene: bpy.types.Scene) -> bool:
        """Show the ground at the scene's frame; False if the ground is gone or was changed by somebody else."""
        ground = self._object(scene)
        if ground is None:
            return False
        self._playhead.material = settings.material_of(scene)
        before = self._playhead.frame
        windows = self._playhead.go_to(float(scene.frame_current))
        if self._playhead.frame != before:
            self._show(ground, windows)
        return True

    def _show(self, ground: bpy.types.Object, windows: Sequence[Window]) -> None:
        self._ground.show(ground, self._playhead, windows, self._playhead.material.blur_sigma, self._wanted.frame_rate)

    def _object(self, scene: bpy.types.Scene) -> bpy.types.Object | None:
        ground = scene.softground.ground
        return self._ground.object(ground and baked_ground.display_mesh_of(ground))

    def show_anew(self, scene: bpy.types.Scene) -> bool:
        """Show the ground at the scene's frame whatever the mesh shows at the moment, as after an undo."""
        ground = self._object(scene)
        if ground is None:
            return False
        self._ground.take_from(ground)
        self._playhead.go_to(float(scene.frame_current))
        self._show(ground, self._playhead.ground.tile_windows())
        return True

    def read_anew(self, scene: bpy.types.Scene) -> bool:
        """Start from the animation, mass and forces as they are now; False if that is not possible."""
        try:
            self._begin(settings.snapshot(scene), analysis.read(scene))
        except InputError:
            return False
        return self.show_anew(scene)

    def is_outdated(self, scene: bpy.types.Scene) -> bool:
        """Whether the character has changed since it was read."""
        return analysis.current(scene) is not self._analysis

    def in_contact(self) -> Contact:
        """See `in_contact` of this module."""
        return self._playhead.in_contact(), self._playhead.ground.cell_size, self._playhead.material.rim_reach

    def keep(self, scene: bpy.types.Scene) -> None:
        """Leave the ground as it is shown, as the bake of the frames up to now with what they were pressed with."""
        ground = self._object(scene)
        if ground is None:
            return
        pressed, now = self._playhead.materials(), settings.snapshot(scene)
        made_with = replace(
            self._wanted,
            material=pressed[-1],
            frames=(self._wanted.frames[0], int(self._playhead.frame)),
            shape_keys=now.shape_keys,
            tread_m=now.tread_m,
        )
        footprints = self._playhead.footprints()
        vertices = ground_mesh.rest_vertices(ground, made_with.unit_scale_m)
        shown = PressedGround.at(footprints, **at_the_end(made_with))
        place = baked_ground.on_itself(ground, np.flatnonzero(shown.covers(*vertices[:, :2].T)), vertices)
        left = record.BakeRecord(footprints, {"inputs": made_with.inputs(), "input_hash": ""})
        published = jobs.run(publish(left, place, made_with))
        inputs = made_with.inputs(Acts.WRITING)
        if len(pressed) > 1:  # no setting gives this ground again
            inputs["material"] = [asdict(material) for material in pressed]
        sign(
            published.display_mesh,
            settings.found(self._owner),
            inputs,
            staleness.of_movers(scene, made_with),
            summary=bake_report.summary_of_prints(footprints),
        )

    def discard(self) -> None:
        """Leave the ground as it was before."""
        owner = next((obj for obj in bpy.data.objects if obj.session_uid == self._owner.uid), None)
        ground = owner or self._ground.object(None)
        if ground is not None:
            baked_ground.clear(ground)


def _display_mesh(wanted: BakeSettings, known: analysis.Analysis) -> LiveGround:
    """What takes the prints: the ground, or a copy that is fine where its characters will step.

    Raises
    ------
    InputError
        If the ground is too coarse and is to stay so.
    """
    assert wanted.ground is not None
    ground, shot = settings.found(wanted.ground), known.shot
    unit_scale, cell_size, detail = wanted.unit_scale_m, wanted.cell_size_m, wanted.detail
    vertices = shot.surface.vertices if shot.surface else ground_mesh.rest_vertices(ground, unit_scale)
    plan = shot.plan or plan_ground(shot.motions)
    if plan.footfalls is not None:
        footfalls = cells_at(plan.footfalls, cell_size)
        cover = coverage(vertices, slice(None), footfalls, cell_size)
        under = np.flatnonzero(np.isin(keys_at(vertices[:, :2], cell_size), footfalls))
        if wants_detail(ground, cover, detail, cell_size, shortest_sole(shot.motions)) or are_undone(
            ground, vertices, under, shot.terrain, unit_scale=unit_scale, detail=detail
        ):
            surface = trail_detail.surface_of(ground, unit_scale)
            region = trail_detail.region_around(footfalls, cell_size, reach_of(wanted.material))
            refinement = refine(surface, region, cell_size)
            with trail_detail.draft(ground, surface, refinement) as draft:
                ground = trail_detail.publish(ground, draft)
            vertices = refinement.at_vertices(surface, surface.vertices)
    return LiveGround(ground, vertices, shot, unit_scale)


_mode: LiveMode | None = None
"""Live mode if it is on: Blender's handlers are functions, so that what they follow lives here."""


def is_on() -> bool:
    """Whether live mode is on."""
    return _mode is not None


def follow(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None) -> None:
    """Handle a change of the frame; never during a render."""
    if _mode is None or _mode.rendering or scene.session_uid != _mode.scene:
        return
    if depsgraph is not None and depsgraph.mode == "RENDER":
        return
    if not _mode.follow(scene):
        forget()


def in_contact(scene: bpy.types.Scene) -> Contact | None:
    """Cells in contact at the frame that is shown; None if live mode is not on there."""
    if _mode is None or _mode.scene != scene.session_uid:
        return None
    return _mode.in_contact()


def rendering(active: bool) -> None:
    """Handle the begin or the end of a render."""
    if _mode is not None:
        _mode.rendering = active


def after_undo() -> None:
    """Handle an undo or redo: the mesh is another one now, live mode goes on if it still is live mode's."""
    scene = _scene()
    if _mode is not None and (scene is None or not _mode.show_anew(scene)):
        forget()


def after_edit() -> float | None:
    """Read the character anew where it was edited; for a timer, as nothing may be evaluated in a handler."""
    scene = _scene()
    if _mode is not None and scene is not None and _mode.is_outdated(scene) and not _mode.read_anew(scene):
        forget()
    return None


def forget() -> None:
    """End live mode as it stands, because its scene or its ground went away."""
    global _mode  # noqa: PLW0603
    _mode = None
    session.current().is_live = False
    session.redraw()


def discard() -> None:
    """End live mode and take its prints off the ground, as the file or the add-on is about to go."""
    if _mode is not None:
        _mode.discard()
        forget()


def _scene() -> bpy.types.Scene | None:
    uid = _mode.scene if _mode else None
    return next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)


class SOFTGROUND_OT_live(bpy.types.Operator):
    """Let the ground give way while the timeline plays, or end that"""

    bl_idname = "softground.live"
    bl_label = "Live Footprints"
    bl_options = {"REGISTER", "UNDO"}

    keep: BoolProperty(
        name="Keep",
        description="When it ends: leave the prints on the ground as a bake, instead of taking them off",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether live mode can start or end; otherwise the button says what is missing."""
        if is_on():
            return True
        reason = _why_not(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """What the button does at the moment."""
        if not is_on():
            return "Press prints while the timeline plays; sliders act at once on what follows"
        if properties.keep:
            return "End live mode and leave the prints on the ground, as a bake up to the frame that is shown"
        return "End live mode and leave the ground as it was before"

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        global _mode  # noqa: PLW0603
        scene = _scene() or settings.scene_of(context)
        if _mode is None:
            _mode = LiveMode(scene)
            session.current().is_live = True
            _mode.follow(scene)
        elif self.keep:
            with analysis.own_changes(scene):
                _mode.keep(scene)
            forget()
        else:
            discard()
        session.redraw()
        return {"FINISHED"}


def _why_not(context: bpy.types.Context) -> str:
    """What keeps live mode from starting, or an empty text."""
    options = settings.scene_of(context).softground
    if session.current().is_baking:
        return "A bake is running"
    if session.is_rendering():
        return "A render is running: wait until it has ended"
    if not characters_of(settings.scene_of(context)):
        return "Add a character first: select its armature and press Add Character"
    if options.ground and baked_ground.is_baked(options.ground):
        return "There is a bake on the ground: clear it first"
    return ""


CLASSES = (SOFTGROUND_OT_live,)
