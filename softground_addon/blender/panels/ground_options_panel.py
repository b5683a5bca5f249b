"""The look of prints and hard ground in the sidebar; the ground's own settings, in Properties > Physics."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.composers import relief_plan
from ...core.loads.cell_limits import Coverage, Fineness, duration
from .. import ground_slots, settings
from ..carried import marks_object
from ..debris import debris_object
from ..ground import painted_ground
from ..operators import prediction
from ..operators.panel_base import GroundPanel, Listed, SidebarPanel, draw_list
from ..translation import CONTEXT, translated
from .panels import draw_preset


class SOFTGROUND_PT_prints(SidebarPanel, bpy.types.Panel):
    """How prints look from close by, and what steps throw"""

    bl_label = "Look of Prints"
    bl_options: Any = {"DEFAULT_CLOSED"}
    bl_order = 1

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        options = settings.options_of(context)
        column = layout.column()
        column.prop(options, "cell_size_cm")
        column.prop(options, "relief")
        amount = column.row()
        amount.active = options.relief != "OFF"
        amount.prop(options, "relief_strength", text="Amount", text_ctxt=CONTEXT)
        wanted, predicted = prediction.look(context.scene)
        if predicted:
            row = column.row()
            row.active = False
            text = estimate(predicted.analysis.coverage, prediction.fineness(wanted, predicted))
            row.label(text=text, icon="TIME", translate=False)
        if options.relief == "CLOSE_UP":
            column.prop(options, "relief_vertices")
            if predicted:
                row = column.row()
                row.active = False
                text = vertices(predicted.analysis.coverage.vertices(wanted.fineness), options.relief_vertices)
                row.label(text=text, icon="INFO", translate=False)
        column.prop(options, "tread_mm")
        column.prop(options, "tread_pattern")
        if options.tread_pattern == relief_plan.IMAGE:
            column.template_ID(options, "tread_image", open="image.open")
        column.prop(options, "debris")
        if options.debris and options.ground is not None:
            _wind(column, options.ground)
        column.prop(options, "marks")
        if options.marks and options.ground is not None and (marks := marks_object.of(options.ground)):
            for name, field in marks_object.fields_of(marks):
                column.prop(*field, text=name)
        layout.operator("softground.open_settings", text="More of the Ground", icon="PHYSICS").of = "GROUND"


class SOFTGROUND_PT_of_ground(GroundPanel, bpy.types.Panel):
    """Settings of the ground"""

    bl_label = "SoftGround Ground"
    bl_parent_id = ""

    def draw(self, context: bpy.types.Context) -> None:
        draw_preset(self.fields(), context.scene)


class SOFTGROUND_PT_material(GroundPanel, bpy.types.Panel):
    """How the ground gives way"""

    bl_label = "Realism"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        scene = context.scene
        options = scene.softground
        column = layout.column()
        column.prop(options, "pressure")
        row = column.row()
        row.active = settings.sinks_feet(options)
        row.prop(options, "carve")
        for field in ("stiffness_mpa", "poisson_ratio", "rim_reach_cm", "rim_bias", "repose_angle"):
            column.prop(options.material, field)
        for field in ("characteristic_time", "shortest_time"):
            column.prop(options.material, field)
        layout.operator("softground.match_depth", icon="DRIVER_DISTANCE")


class SOFTGROUND_PT_layers(GroundPanel, bpy.types.Panel):
    """Depth of the loose layer, its crust, the firm ground below it, and how it gives way"""

    bl_label = "Layers"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.fields().column()
        material = settings.options_of(context).material
        for field in ("layer_depth_cm", "crust_stress_kpa", "firm_depth_cm", "hardening", "exponent"):
            column.prop(material, field)
        row = column.row(heading="Densest Packing")
        row.prop(material, "packs", text="")
        if material.packs:
            row.prop(material, "densest", text="")
        for field in ("edge_width_cm", "spread", "cohesionless"):
            column.prop(material, field)


class SOFTGROUND_PT_painted(GroundPanel, bpy.types.Panel):
    """Vertex groups or float attributes that vary the ground from place to place"""

    bl_label = "Masks"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and settings.options_of(context).ground is not None

    def draw(self, context: bpy.types.Context) -> None:
        column = self.fields().column()
        options = settings.options_of(context)
        for field in ("stiffness", "layer_depth", "rim"):
            row = column.row()
            row.active = painted_ground.is_there(options.ground, getattr(options.painted, field))
            row.prop(options.painted, field, icon="GROUP_VERTEX")


class SOFTGROUND_PT_regions(GroundPanel, bpy.types.Panel):
    """What the ground is made of in each of its materials"""

    bl_label = "Ground by Material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        ground = settings.options_of(context).ground
        has_several = ground is not None and (len(ground.material_slots) > 1 or any(ground_slots.naming(ground)))
        return super().poll(context) and has_several

    def draw(self, context: bpy.types.Context) -> None:
        column = self.fields().column(align=True)
        for number, slot in enumerate(settings.options_of(context).ground.material_slots):
            material = ground_slots.theirs(slot.material)
            row = column.split(factor=0.45, align=True)
            row.label(text=material.name if material else "", icon="MATERIAL", translate=False)
            title = ground_slots.title_of(material)
            row.alert = title.startswith("?")
            row.operator_menu_enum("softground.region_preset", "preset", text=title).slot = number


class SOFTGROUND_UL_hard_grounds(Listed):
    """Hard objects by name."""

    def draw_row(self, layout: Any, item: Any) -> None:
        layout.prop(item, "object", text="", emboss=False, icon="MESH_CUBE")


class SOFTGROUND_PT_hard_ground(SidebarPanel, bpy.types.Panel):
    """Crates, stairs, floors and rocks that feet stand on without a print"""

    bl_label = "Hard Ground"
    bl_parent_id = "SOFTGROUND_PT_feet"
    bl_options: Any = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        options = settings.options_of(context)
        layout = self.fields()
        draw_list(layout, options, "hard_grounds", "active_hard_ground", "hard_ground", most=5)
        if 0 <= options.active_hard_ground < len(options.hard_grounds):
            layout.prop(options.hard_grounds[options.active_hard_ground], "wet")


class SOFTGROUND_PT_mesh(GroundPanel, bpy.types.Panel):
    """How fine the ground is, and what it looks like"""

    bl_label = "Mesh and Look"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.fields()
        scene = context.scene
        options = scene.softground
        column = layout.column()
        column.prop(options.material, "surface")
        column.operator("softground.apply_look", icon="MATERIAL")
        column.prop(options, "under")
        column.prop(options, "longest_bake")
        column.prop(options.material, "blur_sigma_cm")
        column.prop(options, "detail")
        column.prop(options, "ground_margin")
        column.prop(options, "shape_keys")
        row = column.row()
        row.active = options.shape_keys
        row.prop(options, "dense_shape_keys")
        if options.marks and settings.hard_grounds_of(options):
            column.prop(options, "carried_amount")
            column.prop(options, "carried_reach")


def vertices(wanted: float, most: int) -> str:
    """Vertices of a close-up along all of a trail, and if there may be fewer."""
    count = f"{rounded(wanted):,.0f}"
    if wanted <= most:
        return translated("About {count} vertices along the whole trail", count=count)
    return translated("About {count} vertices along the whole trail, over Max Vertices", count=count)


def estimate(coverage: Coverage, fine: Fineness) -> str:
    """Cells that a bake changes, and the memory and time that it takes."""
    cells, (memory, time) = coverage.cells(fine.cell_size, fine.rim_reach), coverage.bake_costs(fine)
    return translated(
        "About {cells} cells, {memory} MB, {time}",
        cells=f"{rounded(cells):,.0f}",
        memory=f"{rounded(memory / 1e6):,.0f}",
        time=lasting(time),
    )


def lasting(time: float) -> str:
    """A time [s] as it is said, in the language of the interface."""
    count, unit = duration(time).split()
    return translated(DURATIONS[unit], count=count)


DURATIONS = {"seconds": "{count} seconds", "minutes": "{count} minutes", "hours": "{count} hours"}
"""Times as they are said, by their units."""


def rounded(value: float) -> float:
    """A positive number to two digits, at least 1, for estimates."""
    return max(1.0, float(f"{value:.2g}"))


def _wind(layout: Any, ground: Any) -> None:
    """What acts on the debris at once, where there is any."""
    debris = debris_object.of(ground)
    if debris is None:
        return
    for name in ("Wind", "Amount", "Shaped"):
        if (field := debris_object.field_of(debris, name)) is not None:
            layout.prop(*field, text=name, text_ctxt=CONTEXT)


CLASSES = (
    SOFTGROUND_PT_prints,
    SOFTGROUND_PT_of_ground,
    SOFTGROUND_PT_material,
    SOFTGROUND_PT_layers,
    SOFTGROUND_PT_regions,
    SOFTGROUND_PT_painted,
    SOFTGROUND_UL_hard_grounds,
    SOFTGROUND_PT_hard_ground,
    SOFTGROUND_PT_mesh,
)
