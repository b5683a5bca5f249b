"""Base of the sidebar's panels."""

from __future__ import annotations

from typing import Any

import bpy

from .. import session
from ..translation import CONTEXT

CATEGORY = "SoftGround"
"""The sidebar's tab."""


ADVANCED = "SOFTGROUND_PT_advanced"
"""The panel that holds all that is not on the first screen."""


class SidebarPanel:
    """A panel in the add-on's tab, in Blender's property style."""

    bl_space_type: Any = "VIEW_3D"
    bl_region_type: Any = "UI"
    bl_category = CATEGORY
    bl_translation_context = CONTEXT

    layout: Any

    def fields(self) -> Any:
        """The layout for fields; greyed while a bake runs."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.enabled = not session.current().is_baking
        return layout


class AdvancedPanel(SidebarPanel):
    """A panel that is not on the first screen."""

    bl_parent_id = ADVANCED
    bl_options: Any = {"DEFAULT_CLOSED"}


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


def remove_chosen(owner: Any, items: str, active: str) -> None:
    """Take the chosen item out of a list of `owner`, and choose the one that comes into its place."""
    listed = getattr(owner, items)
    listed.remove(getattr(owner, active))
    setattr(owner, active, max(0, min(getattr(owner, active), len(listed) - 1)))


class Listed(bpy.types.UIList):
    """A list of which each row is drawn by `draw_row`."""

    def draw_item(
        self, _c: Any, layout: Any, _data: Any, item: Any, _icon: Any, _active: Any, _property: Any, _index: int = 0
    ) -> None:
        self.draw_row(layout, item)

    def draw_row(self, layout: Any, item: Any) -> None:
        """Draw an item of the list."""
        raise NotImplementedError
