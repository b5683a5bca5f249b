"""Entries in Blender's own menus, through which the search (F3) finds operators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy


class SOFTGROUND_MT_object(bpy.types.Menu):
    """Footprints of animated characters"""

    bl_label = "SoftGround"

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        layout.operator("softground.add_character", icon="ARMATURE_DATA")
        layout.operator("softground.add_contact", icon="PLUS")
        layout.operator("softground.add_sample_scene", icon="OUTLINER_OB_ARMATURE")
        layout.operator("softground.create_ground", icon="MESH_GRID").use_selected = False
        layout.operator("softground.use_as_ground", icon="EYEDROPPER")
        layout.operator("softground.add_ground", icon="ADD")
        layout.operator("softground.cover", icon="MOD_CLOTH")
        layout.separator()
        layout.operator("softground.bake", icon="MOD_DYNAMICPAINT")
        layout.operator("softground.live", icon="PLAY")
        layout.operator("softground.show_prints", icon="VIEWZOOM")
        layout.operator("softground.clear_bake", icon="TRASH")
        layout.operator("softground.apply_look", icon="MATERIAL")
        layout.operator("softground.add_sample_meadow", icon="STRANDS")
        layout.separator()
        layout.operator("softground.overlay", icon="HIDE_OFF")
        layout.operator("softground.predict_depth", icon="DRIVER_DISTANCE")
        layout.operator("softground.match_depth")
        layout.separator()
        layout.menu("SOFTGROUND_MT_output", icon="EXPORT")
        layout.separator()
        layout.operator("softground.open_manual", icon="HELP")


class SOFTGROUND_MT_output(bpy.types.Menu):
    """Use the bake elsewhere: files, markers, sound, plants that give way"""

    bl_label = "Output"

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        layout.operator("softground.export", icon="EXPORT")
        layout.operator("softground.final_mesh", icon="MESH_DATA")
        layout.separator()
        layout.operator("softground.force_curves", icon="GRAPH")
        layout.operator("softground.export_forces", icon="EXPORT")
        layout.separator()
        layout.operator("softground.event_markers", icon="MARKER_HLT")
        layout.operator("softground.event_points", icon="POINTCLOUD_DATA")
        layout.operator("softground.make_sound", icon="SOUND")
        layout.operator("softground.make_keys", icon="KEYINGSET")
        layout.operator_menu_enum("softground.give_way", "kind", icon="STRANDS")
        layout.operator("softground.cling", icon="MOD_CLOTH")
        layout.separator()
        layout.operator("softground.copy_bake_command", icon="COPYDOWN")


def _draw_menu(menu: Any, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.menu("SOFTGROUND_MT_object")


def _entry(operator: str, *, text: str, icon: str = "NONE", **values: Any) -> Callable[[Any, bpy.types.Context], None]:
    """A function that appends an operator to a menu."""

    def draw(menu: Any, _context: bpy.types.Context) -> None:
        button = menu.layout.operator(operator, text=text, icon=icon)
        for name, value in values.items():
            setattr(button, name, value)

    return draw


_ENTRIES = {
    "VIEW3D_MT_object": _draw_menu,
    "VIEW3D_MT_mesh_add": _entry("softground.create_ground", text="SoftGround", icon="MESH_GRID", use_selected=False),
    "VIEW3D_MT_armature_add": _entry(
        "softground.add_sample_scene", text="SoftGround Walking Figure", icon="OUTLINER_OB_ARMATURE"
    ),
    "TOPBAR_MT_file_export": _entry("softground.export", text="SoftGround (.abc, .usdc, .pc2, .exr, ...)"),
}
"""What is appended to Blender's own menus, by their names."""


def register() -> None:
    """Add the entries."""
    for name, draw in _ENTRIES.items():
        getattr(bpy.types, name).append(draw)


def unregister() -> None:
    """Take the entries away."""
    for name, draw in _ENTRIES.items():
        getattr(bpy.types, name).remove(draw)


CLASSES = (SOFTGROUND_MT_object, SOFTGROUND_MT_output)
