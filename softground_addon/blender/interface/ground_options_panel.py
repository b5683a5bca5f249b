"""The sidebar's part on the ground's physics, its layers, what is painted on it, and its mesh."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.composers.relief_plan import IMAGE
from ...core.loads.cell_limits import BYTES_PER_CELL
from ...core.settings import spacing_of
from .. import settings
from ..after import debris_object
from ..ground import painted_ground
from . import prediction
from .character_editing import active_character
from .panel_base import ADVANCED, SidebarPanel


class _Closed(SidebarPanel):
    bl_parent_id = ADVANCED
    bl_options: Any = {"DEFAULT_CLOSED"}


class SOFTGROUND_PT_material(_Closed, bpy.types.Panel):
    """How the ground gives way, and how prints look up close"""

    bl_label = "Realism"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        scene = settings.scene_of(context)
        options, character = scene.softground, active_character(scene)
        if character:
            layout.prop(character, "force_model")
        column = layout.column()
        column.prop(options, "pressure")
        for field in ("stiffness_mpa", "poisson_ratio", "rim_reach_cm", "rim_bias", "repose_angle"):
            column.prop(options.material, field)
        for field in ("characteristic_time", "shortest_time"):
            column.prop(options.material, field)
        column.prop(options, "tread_mm")
        column.prop(options, "tread_pattern")
        if options.tread_pattern == IMAGE:
            column.template_ID(options, "tread_image", open="image.open")
        column.prop(options, "relief")
        amount = column.row()
        amount.active = options.relief != "OFF"
        amount.prop(options, "relief_strength", text="Amount")
        if options.relief == "CLOSE_UP":
            column.prop(options, "relief_vertices")
            predicted = prediction.of(scene)
            if predicted:
                row = layout.row()
                row.active = False
                spacing = spacing_of(settings.typed(options.cell_size), options.relief)
                text = vertices(predicted.analysis.area, spacing, options.relief_vertices)
                row.label(text=text, icon="INFO", translate=False)
        layout.prop(options, "debris")
        if options.debris and options.ground is not None:
            _wind(layout, options.ground)
        layout.operator("softground.match_depth", icon="DRIVER_DISTANCE")


class SOFTGROUND_PT_layers(_Closed, bpy.types.Panel):
    """Depth of the loose layer, its crust, the firm ground below it, and hardening"""

    bl_label = "Layers"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.fields().column()
        material = settings.scene_of(context).softground.material
        for field in ("layer_depth_cm", "crust_stress_kpa", "firm_depth_cm", "hardening"):
            column.prop(material, field)


class SOFTGROUND_PT_painted(_Closed, bpy.types.Panel):
    """Vertex groups or float attributes that vary the ground from place to place"""

    bl_label = "Masks"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return settings.scene_of(context).softground.ground is not None

    def draw(self, context: bpy.types.Context) -> None:
        column = self.fields().column()
        options = settings.scene_of(context).softground
        for field in ("stiffness", "layer_depth", "rim"):
            row = column.row()
            row.active = painted_ground.is_there(options.ground, getattr(options.painted, field))
            row.prop(options.painted, field, icon="GROUP_VERTEX")


class SOFTGROUND_PT_mesh(_Closed, bpy.types.Panel):
    """How fine the ground is, and what it looks like"""

    bl_label = "Mesh and Look"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        scene = settings.scene_of(context)
        options = scene.softground
        column = layout.column()
        column.prop(options.material, "surface")
        column.operator("softground.apply_look", icon="MATERIAL")
        column.prop(options, "cell_size_cm")
        column.prop(options, "longest_bake")
        column.prop(options.material, "blur_sigma_cm")
        column.prop(options, "detail")
        column.prop(options, "ground_margin")
        column.prop(options, "shape_keys")
        row = column.row()
        row.active = options.shape_keys
        row.prop(options, "dense_shape_keys")
        predicted = prediction.of(scene)
        if predicted:
            row = layout.row()
            row.active = False
            row.label(text=estimate(predicted.analysis.area, options.cell_size), icon="INFO", translate=False)


AROUND_SOLES = 3.0
"""Area that is fine around soles over the area that they cover, about."""


def vertices(area: float, spacing: float, most: int) -> str:
    """Vertices of a close-up along all of a trail, from the area that soles cover [m²], and if there may be fewer."""
    wanted = AROUND_SOLES * area / spacing**2
    text = f"About {rounded(wanted):,.0f} vertices along the whole trail"
    return text if wanted <= most else f"{text}, over Max Vertices"


def estimate(area: float, cell_size: float) -> str:
    """Cells that soles cover an area [m²] with, and the memory that a bake takes for them."""
    cells = area / cell_size**2
    return f"About {rounded(cells):,.0f} cells printed, {rounded(cells * BYTES_PER_CELL / 1e6):,.0f} MB"


def rounded(value: float) -> float:
    """A positive number to two digits, at least 1, as estimates are told."""
    return max(1.0, float(f"{value:.2g}"))


def _wind(layout: Any, ground: Any) -> None:
    """What acts on the debris at once, where there is any."""
    debris = debris_object.of(ground)
    if debris is None:
        return
    for name in ("Wind", "Amount", "Shaped"):
        if (field := debris_object.field_of(debris, name)) is not None:
            layout.prop(*field, text=name)


CLASSES = (SOFTGROUND_PT_material, SOFTGROUND_PT_layers, SOFTGROUND_PT_painted, SOFTGROUND_PT_mesh)
