"""Bases of the panels: those of the sidebar, and those of a ground or character in Properties > Physics."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from .. import session, settings
from ..ground import baked_ground
from ..operator_base import Act
from ..translation import CONTEXT

CATEGORY = "SoftGround"
"""The sidebar's tab."""


class _Panel:
    """A panel in Blender's property style."""

    bl_translation_context = CONTEXT

    layout: Any

    def fields(self) -> Any:
        """The layout for fields; greyed while a bake runs."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.enabled = not session.current().is_baking
        return layout


class SidebarPanel(_Panel):
    """A panel in the add-on's tab."""

    bl_space_type: Any = "VIEW_3D"
    bl_region_type: Any = "UI"
    bl_category = CATEGORY


class _PhysicsPanel(_Panel):
    """A panel in Properties > Physics of an object."""

    bl_space_type: Any = "PROPERTIES"
    bl_region_type: Any = "WINDOW"
    bl_context = "physics"
    bl_options: Any = {"DEFAULT_CLOSED"}


def belongs_to(character: Any, obj: bpy.types.Object | None) -> bool:
    """True if an object is a character's armature, its skin or one of its props."""
    if character is None or obj is None:
        return False
    rig = obj.find_armature()
    of_it = (character.armature, character.body, *(sole.object for sole in character.soles))
    return obj in of_it or (rig is not None and rig == character.armature)


class CharacterPanel(_PhysicsPanel):
    """A part of the chosen character's settings."""

    bl_parent_id = "SOFTGROUND_PT_of_character"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if the active object belongs to the character that is chosen in the list."""
        chosen = chosen_of(settings.options_of(context), "characters", "active_character")
        return belongs_to(chosen, context.object) and settings.is_set_up(chosen)


class GroundPanel(_PhysicsPanel):
    """A part of the ground's settings; beside those of the chosen character until there is a ground."""

    bl_parent_id = "SOFTGROUND_PT_of_ground"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if the active object is the ground, or the copy of it that takes the prints."""
        options = settings.options_of(context)
        if not settings.exists(options.ground):
            return belongs_to(chosen_of(options, "characters", "active_character"), context.object)
        return context.object in (options.ground, baked_ground.display_mesh_of(options.ground))


def draw_list(layout: Any, owner: Any, items: str, active: str, item: str, *, rows: int = 2, most: int = 6) -> None:
    """Draw a list of `owner` with the buttons that add an `item` and remove the chosen one."""
    row = layout.row()
    row.template_list(f"SOFTGROUND_UL_{item}s", "", owner, items, owner, active, rows=rows, maxrows=most)
    buttons = row.column(align=True)
    buttons.operator(f"softground.add_{item}", text="", icon="ADD")
    buttons.operator(f"softground.remove_{item}", text="", icon="REMOVE")


def chosen_of(owner: Any, items: str, active: str) -> Any:
    """The item that is chosen in a list of `owner`; None if none is, or there is no owner."""
    listed, number = (getattr(owner, items), getattr(owner, active)) if owner is not None else ((), 0)
    return listed[number] if 0 <= number < len(listed) else None


def active_character(options: Any) -> Any:
    """The character that is chosen in the list, or None."""
    return chosen_of(options, "characters", "active_character")


def active_sole(options: Any) -> Any:
    """The sole that is chosen in the list of the active character, or None."""
    return chosen_of(active_character(options), "soles", "active_sole")


class OnMeshes:
    """Operators on a mesh that is named, or on those that are selected."""

    object: StringProperty(
        name="Object",
        description="Name of the mesh; those that are selected if empty",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    def meshes(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        """What is meant; a named object whatever it is, none if the scene has none of that name."""
        if self.object:
            return [obj for obj in context.scene.objects if obj.name == self.object]
        return [obj for obj in context.selected_objects if obj.type == "MESH"]


class RemovesChosen(Act):
    """Operators that take the chosen item out of a list; the one that comes into its place is chosen then."""

    of_list = ("items", "active_item")
    """Names of the list and of the number of what is chosen in it."""

    @staticmethod
    def owner(options: Any) -> Any:
        """What the list belongs to, None if it is not there."""
        return options

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        chosen = chosen_of(cls.owner(settings.options_of(context)), *cls.of_list)
        return "Select an item of the list first" if chosen is None else ""

    def act(self, context: bpy.types.Context) -> None:
        owner, (items, active) = self.owner(settings.options_of(context)), self.of_list
        listed = getattr(owner, items)
        listed.remove(getattr(owner, active))
        setattr(owner, active, max(0, min(getattr(owner, active), len(listed) - 1)))


class Listed(bpy.types.UIList):
    """A list of which each row is drawn by `draw_row`."""

    def draw_item(
        self, _c: Any, layout: Any, _data: Any, item: Any, _icon: Any, _active: Any, _property: Any, *_: Any
    ) -> None:
        self.draw_row(layout, item)

    def draw_row(self, layout: Any, item: Any) -> None:
        """Draw an item of the list."""
        raise NotImplementedError
