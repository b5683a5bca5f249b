"""The manual, from the preferences and from any button's *Online Manual*; and what a report of a bug needs to say."""

from __future__ import annotations

import json
import platform
from typing import Any

import bpy
import gpu

from ...core.errors import SoftGroundError
from .. import settings
from ..command_line import program
from ..ground import baked_ground, ground_mesh
from ..operator_base import Checked, OperatorResult
from ..operators.bake_result import warnings_of

MANUAL = program.PACKAGE / "manual"
"""The manual's pages; the package has them, the sources do not."""

PAGES = (
    ("bpy.ops.softground.*step", "steps.html"),
    ("bpy.ops.softground.*steps", "steps.html"),
    ("bpy.ops.softground.tilt_preset", "response.html#tilt"),
    ("bpy.types.softgroundtilt.*", "response.html#tilt"),
    ("bpy.ops.softground.response_preset", "response.html#acting-in-deep-ground"),
    ("bpy.ops.softground.slow_down", "response.html#acting-in-deep-ground"),
    ("bpy.ops.softground.sink_feet", "response.html#grounding"),
    ("bpy.types.softgroundgrounding.*", "response.html#grounding"),
    ("bpy.ops.softground.clean_feet", "response.html#clean-feet"),
    ("bpy.ops.softground.*foot_lock", "response.html#clean-feet"),
    ("bpy.types.softgroundhold.*", "response.html#clean-feet"),
    ("bpy.ops.softground.*root_motion", "response.html#root-motion"),
    ("bpy.ops.softground.*weather", "after.html#weather"),
    ("bpy.ops.softground.give_way", "after.html#plants-and-litter"),
    ("bpy.ops.softground.cling", "after.html#snow-and-mud-on-legs"),
    ("bpy.ops.softground.add_sample_meadow", "after.html#plants-and-litter"),
    ("bpy.ops.softground.make_sound", "after.html#sound"),
    ("bpy.ops.softground.event_*", "after.html#events"),
    ("bpy.ops.softground.*force*", "forces.html"),
    ("bpy.ops.softground.import_capture", "forces.html#your-own-captures"),
    ("bpy.ops.softground.export", "playback.html#other-programs"),
    ("bpy.ops.softground.final_mesh", "playback.html#other-programs"),
    ("bpy.ops.softground.region_preset", "ground.html#several-grounds-on-one-mesh"),
    ("bpy.ops.softground.*preset", "ground.html"),
    ("bpy.types.softgroundmaterial.*", "ground_law.html#fields"),
    ("bpy.types.softgroundpainted.*", "ground.html#masks"),
    ("bpy.ops.softground.choose_ground", "ground.html#several-ground-objects"),
    ("bpy.ops.softground.add_ground", "ground.html#several-ground-objects"),
    ("bpy.ops.softground.clear_unlisted", "ground.html#several-ground-objects"),
    ("bpy.ops.softground.remove_ground", "ground.html#several-ground-objects"),
    ("bpy.types.softgroundfurtherground.*", "ground.html#several-ground-objects"),
    ("bpy.ops.softground.*hard_ground", "ground.html#hard-ground"),
    ("bpy.types.softgroundhardground.*", "ground.html#hard-ground"),
    ("bpy.ops.softground.cover", "ground.html#snow-on-things"),
    ("bpy.ops.softground.*character", "panel.html#character"),
    ("bpy.types.softgroundcharacter.*", "panel.html#character"),
    ("bpy.types.softgroundsole.*", "panel.html#character"),
    ("bpy.ops.softground.open_settings", "panel.html#physics"),
    ("bpy.ops.softground.live", "panel.html#live"),
    ("bpy.ops.softground.overlay", "panel.html#overlay"),
    ("bpy.ops.softground.*", "panel.html"),
    ("bpy.types.softground*", "panel.html"),
)
"""By names of operators and properties, as Blender's own *Online Manual* finds them; the first that fits."""


class SOFTGROUND_OT_open_manual(Checked):
    """Open SoftGround's manual in the web browser. It is part of the add-on and needs no network"""

    bl_idname = "softground.open_manual"
    bl_label = "SoftGround Manual"

    @classmethod
    def missing(cls, _context: bpy.types.Context) -> str:
        return "" if MANUAL.is_dir() else "The sources have no manual: read docs/, or install the package"

    def execute(self, _context: bpy.types.Context) -> OperatorResult:
        bpy.ops.wm.url_open(url=(MANUAL / "index.html").as_uri())
        return {"FINISHED"}


class SOFTGROUND_OT_report_bug(bpy.types.Operator):
    """Copy what a bug report should say: versions, system, and the settings and result of this scene's bake. Opens the
    add-on's website, if its publisher has one
    """

    bl_idname = "softground.report_bug"
    bl_label = "Report a Bug"

    def execute(self, context: bpy.types.Context) -> OperatorResult:
        context.window_manager.clipboard = bug_report(context.scene)
        self.report({"INFO"}, "Copied the details: paste them into your report, below what you did and what happened")
        website = program.about().get("website")
        if website:
            bpy.ops.wm.url_open(url=website)
        return {"FINISHED"}


def bug_report(scene: bpy.types.Scene) -> str:
    """Versions, system, the settings of a scene, and what its bake says of itself; not where the file is."""
    lines = [program.made_by(), platform.platform()]
    if not bpy.app.background:
        lines += [f"{gpu.platform.renderer_get()}, {gpu.platform.version_get()}"]
    try:
        inputs = settings.snapshot(scene).inputs()
        lines += [f"Settings: {json.dumps({name: inputs[name] for name in inputs if name not in _UNSAID})}"]
    except SoftGroundError as error:
        lines += [f"Settings: {error}"]
    ground = scene.softground.ground
    if ground is not None:
        lines += [f"Bake: {json.dumps(ground_mesh.summary_of(baked_ground.display_mesh_of(ground)))}"]
        lines += warnings_of(scene.softground.ground)
    return "\n".join(lines) + "\n"


_UNSAID = ("file", "tread_image", "shoe_treads")
"""Inputs that are private, or long."""


def _pages() -> tuple[str, tuple[tuple[str, str], ...]]:
    """Address of the manual and its pages, for *Online Manual* in the menu of a button."""
    return MANUAL.as_uri() + "/", PAGES if MANUAL.is_dir() else ()


WHERE = "SoftGround is in the 3D viewport's sidebar: press N there, then choose the SoftGround tab"


class SOFTGROUND_OT_tell_where(bpy.types.Operator):
    """Say in the status bar where the panel is"""

    bl_idname = "softground.tell_where"
    bl_label = "Where SoftGround Is"
    bl_options = {"INTERNAL"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> OperatorResult:
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, _context: bpy.types.Context, _event: bpy.types.Event) -> OperatorResult:
        self.report({"INFO"}, WHERE)  # which is seen only of operators that events have run
        return {"FINISHED", "PASS_THROUGH"}


def _tell_where() -> None:
    """Tell it once: the preferences, which go as the add-on is disabled, know if it was told."""
    ours: Any = bpy.context.preferences.addons.get(settings.ADD_ON)
    windows = bpy.context.window_manager.windows
    if ours and windows and not ours.preferences.was_told:
        ours.preferences.was_told = True
        with bpy.context.temp_override(window=windows[0]):
            bpy.ops.softground.tell_where("INVOKE_DEFAULT")  # type: ignore[attr-defined]


def register() -> None:
    """Let Blender's *Online Manual* find the manual, and tell a user who has just enabled the add-on where it is."""
    bpy.utils.register_manual_map(_pages)
    if not bpy.app.background:
        bpy.app.timers.register(_tell_where, first_interval=0.5)


def unregister() -> None:
    """Take that back."""
    bpy.utils.unregister_manual_map(_pages)
    if bpy.app.timers.is_registered(_tell_where):
        bpy.app.timers.unregister(_tell_where)


CLASSES = (SOFTGROUND_OT_open_manual, SOFTGROUND_OT_report_bug, SOFTGROUND_OT_tell_where)
