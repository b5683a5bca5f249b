"""Registration of everything with Blender, in order; undone in the reverse order."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import bpy

from . import handlers, properties, session, state, translation
from .command_line import cli
from .ground import look
from .importing import import_capture
from .operators import (
    add_weather,
    bake_result,
    clinging,
    give_way,
    live_footprints,
    modal_bake,
    modal_job,
    prediction,
    show_prints,
)
from .output import event_points, export_formats, force_curves, make_sound
from .panels import (
    foot_locks_panel,
    ground_options_panel,
    help,
    menus,
    panels,
    preset_icons,
    preset_menu,
    response_panel,
    steps_panel,
    weather_panel,
)
from .reading import analysis
from .setup import character_editing, cover_object, ground_list, sample_scene, shot_setup
from .viewport import overlay, step_dragging, step_editing
from .weather import weather_result

_SETTINGS: tuple[tuple[Any, type], ...] = (
    (bpy.types.Scene, properties.SoftGroundSettings),
    (bpy.types.WindowManager, session.SoftGroundSession),
)
"""Where the settings and the session are kept, each as `softground`."""

CLASSES = (
    *session.CLASSES,
    *properties.CLASSES,
    *shot_setup.CLASSES,
    *character_editing.CLASSES,
    *ground_list.CLASSES,
    *cover_object.CLASSES,
    *give_way.CLASSES,
    *clinging.CLASSES,
    *sample_scene.CLASSES,
    *modal_bake.CLASSES,
    *modal_job.CLASSES,
    *live_footprints.CLASSES,
    *overlay.CLASSES,
    *preset_menu.CLASSES,
    *prediction.CLASSES,
    *force_curves.CLASSES,
    *event_points.CLASSES,
    *make_sound.CLASSES,
    *add_weather.CLASSES,
    *export_formats.CLASSES,
    *menus.CLASSES,
    *help.CLASSES,
    *import_capture.CLASSES,
    *panels.CLASSES,
    *response_panel.CLASSES,
    *ground_options_panel.CLASSES,
    *foot_locks_panel.CLASSES,
    *weather_panel.CLASSES,
    *bake_result.CLASSES,
    *show_prints.CLASSES,
    *step_editing.CLASSES,
    *step_dragging.CLASSES,
    *steps_panel.CLASSES,
)

_registered = ExitStack()
"""What unregisters each of them; lives between register and unregister."""


def register() -> None:
    """Register classes, `scene.softground` and the command `softground`: all of it, or on an error nothing."""
    with ExitStack() as undo:
        undo.callback(state.forget)
        for cls in CLASSES:
            if issubclass(cls, bpy.types.Operator):  # Blender shows docstrings as tooltips, with their line breaks
                cls.bl_description = " ".join((cls.__doc__ or "").split())
            bpy.utils.register_class(cls)
            undo.callback(bpy.utils.unregister_class, cls)
        for owner, group in _SETTINGS:
            owner.softground = bpy.props.PointerProperty(name="SoftGround", type=group)  # type: ignore[func-returns-value]
            undo.callback(delattr, owner, "softground")
        bpy.types.Material.softground_preset = bpy.props.StringProperty(  # type: ignore[assignment, func-returns-value]
            name="Ground Preset",
            description="File name of the preset of the ground that has this material, 'none' of a hard floor; empty "
            "for the ground's own",
        )
        undo.callback(delattr, bpy.types.Material, "softground_preset")
        for part in (handlers, menus, help, import_capture):
            part.register()
            undo.callback(part.unregister)
        translation.watch()
        undo.callback(translation.unregister)
        state.state.hooks.update(
            follow_look=_follow_look,
            show_depth_cm=prediction.shown_cm,
            type_depth_cm=prediction.type_cm,
            show_snow_cm=weather_result.snow_cm,
            type_snow_cm=weather_result.set_snow_cm,
            show_weather_hours=weather_result.hours,
            type_weather_hours=weather_result.set_hours,
        )
        for draw, when in () if bpy.app.background else (*overlay.DRAWN, *step_dragging.DRAWN):
            handle = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", when)
            undo.callback(bpy.types.SpaceView3D.draw_handler_remove, handle, "WINDOW")
        undo.callback(overlay.unregister)
        undo.callback(prediction.unregister)
        undo.callback(preset_icons.unregister)
        command = bpy.utils.register_cli_command("softground", cli.run_in_blender)  # type: ignore[func-returns-value]
        undo.callback(bpy.utils.unregister_cli_command, command)
        _registered.enter_context(undo.pop_all())


def _follow_look(scene: bpy.types.Scene) -> None:
    """Show another look on a scene's ground: what was read of its shot still holds."""
    with analysis.own_changes(scene):
        look.follow(scene.softground)


def unregister() -> None:
    """Undo `register()`, in the reverse order."""
    _registered.close()
