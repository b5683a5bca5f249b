"""Everything that Blender is told about, in order; taken back in the reverse order."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import bpy

from . import handlers, properties, session
from .command_line import cli
from .ground import look
from .importing import import_capture
from .interface import (
    bake_result,
    character_editing,
    foot_locks_panel,
    ground_options_panel,
    help,
    menus,
    modal_bake,
    operators,
    outdated,
    overlay,
    panels,
    prediction,
    preset_icons,
    preset_menu,
    response_panel,
    sample_scene,
    step_dragging,
    step_editing,
    steps_panel,
    weather_panel,
)
from .live import live
from .output import add_weather, event_points, export_formats, force_curves, make_sound
from .properties.material import look_followers
from .properties.scene import depth_field
from .reading import analysis

_SETTINGS: tuple[tuple[Any, type], ...] = (
    (bpy.types.Scene, properties.SoftGroundSettings),
    (bpy.types.WindowManager, session.SoftGroundSession),
)
"""Where the settings and the session are kept, each as `softground`."""

CLASSES = (
    *session.CLASSES,
    *properties.CLASSES,
    *operators.CLASSES,
    *character_editing.CLASSES,
    *sample_scene.CLASSES,
    *modal_bake.CLASSES,
    *live.CLASSES,
    *overlay.CLASSES,
    *preset_menu.CLASSES,
    *force_curves.CLASSES,
    *event_points.CLASSES,
    *make_sound.CLASSES,
    *add_weather.CLASSES,
    *export_formats.CLASSES,
    *menus.CLASSES,
    *help.CLASSES,
    *import_capture.CLASSES,
    *panels.CLASSES,
    *ground_options_panel.CLASSES,
    *response_panel.CLASSES,
    *foot_locks_panel.CLASSES,
    *weather_panel.CLASSES,
    *bake_result.CLASSES,
    *step_editing.CLASSES,
    *step_dragging.CLASSES,
    *steps_panel.CLASSES,
)

_registered = ExitStack()
"""What unregisters each of them; lives between register and unregister."""


def register() -> None:
    """Register classes, `scene.softground` and the command `softground`: all of it, or on an error nothing."""
    with ExitStack() as undo:
        for cls in CLASSES:
            if issubclass(cls, bpy.types.Operator):  # Blender shows docstrings as tooltips, with their line breaks
                cls.bl_description = " ".join((cls.__doc__ or "").split())
            bpy.utils.register_class(cls)
            undo.callback(bpy.utils.unregister_class, cls)
        for owner, group in _SETTINGS:
            owner.softground = bpy.props.PointerProperty(name="SoftGround", type=group)
            undo.callback(delattr, owner, "softground")
        for part in (handlers, overlay, step_dragging, menus, help, import_capture):
            part.register()
            undo.callback(part.unregister)
        look_followers.append(_follow_look)
        undo.callback(look_followers.clear)
        depth_field.update(get=prediction.shown_cm, set=prediction.type_cm)
        undo.callback(depth_field.clear)
        undo.callback(prediction.unregister)
        undo.callback(outdated.forget)
        undo.callback(preset_icons.unregister)
        command = bpy.utils.register_cli_command("softground", cli.run_in_blender)
        undo.callback(bpy.utils.unregister_cli_command, command)
        _registered.enter_context(undo.pop_all())


def _follow_look(scene: bpy.types.Scene) -> None:
    """Show another look on a scene's ground: what was read of its shot still holds."""
    with analysis.own_changes(scene):
        look.follow(scene)


def unregister() -> None:
    """Undo `register()`, in the reverse order."""
    _registered.close()
