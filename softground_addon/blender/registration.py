"""Everything that Blender is told about, in order; taken back in the reverse order."""

from __future__ import annotations

import bpy

from . import (
    character_editing,
    cli,
    force_curves,
    ground_options_panel,
    handlers,
    live,
    menus,
    modal_bake,
    operators,
    overlay,
    panels,
    preset_menu,
    properties,
    response_panel,
    session,
)

CLASSES = (
    *session.CLASSES,
    *properties.CLASSES,
    *operators.CLASSES,
    *character_editing.CLASSES,
    *modal_bake.CLASSES,
    *live.CLASSES,
    *overlay.CLASSES,
    *preset_menu.CLASSES,
    *force_curves.CLASSES,
    *menus.CLASSES,
    *panels.CLASSES,
    *ground_options_panel.CLASSES,
    *response_panel.CLASSES,
)

_command: object | None = None
"""Handle of the registered command, which Blender wants back to take it away."""


def register() -> None:
    """Register classes, `scene.softground` and the command `softground`."""
    global _command  # noqa: PLW0603  (the handle has to live between register and unregister)
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.softground = bpy.props.PointerProperty(name="SoftGround", type=properties.SoftGroundSettings)
    bpy.types.WindowManager.softground = bpy.props.PointerProperty(type=session.SoftGroundSession)
    handlers.register()
    overlay.register()
    menus.register()
    _command = bpy.utils.register_cli_command("softground", cli.run_in_blender)


def unregister() -> None:
    """Undo `register()`."""
    global _command  # noqa: PLW0603
    if _command is not None:
        bpy.utils.unregister_cli_command(_command)
        _command = None
    menus.unregister()
    overlay.unregister()
    handlers.unregister()
    del bpy.types.WindowManager.softground
    del bpy.types.Scene.softground
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
