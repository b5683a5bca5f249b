"""What the sidebar's panels have in common."""

from __future__ import annotations

from typing import Any

from .. import session

CATEGORY = "SoftGround"
"""The sidebar's tab."""


ADVANCED = "SOFTGROUND_PT_advanced"
"""The panel that holds all that is not on the first screen."""


class SidebarPanel:
    """A panel in the add-on's tab, in Blender's property style."""

    bl_space_type: Any = "VIEW_3D"
    bl_region_type: Any = "UI"
    bl_category = CATEGORY

    layout: Any

    def fields(self) -> Any:
        """The layout for fields; greyed while a bake runs."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.enabled = not session.current().is_baking
        return layout
