"""Settings of the ground's material. Lengths are metres whatever the scene's units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...core.ground import presets
from ...core.ground.material import MATERIAL_RANGES, GroundMaterial
from ...core.ground.surfaces import SURFACES
from ..state import state
from ..translation import CONTEXT
from .fields import in_unit

USUAL_PACKING = 0.6
"""Densest packing that is set where there was none: that of settled snow."""
DEFAULT: Any = presets.find(presets.DEFAULT)
"""What the settings of a ground are in a new scene."""


def _number(field: str, name: str, description: str, **looks: Any) -> Any:
    """A property for a field of the material, within its range."""
    low, high = MATERIAL_RANGES[field]
    default = getattr(DEFAULT.material, field)
    return FloatProperty(name=name, description=description, min=low, max=high, default=default, **looks)


_STIFFNESS = (
    "Stiffness of the loose layer: twice the value makes prints half as deep where Exponent is 1. An effective "
    "modulus for compaction, far below the elastic modulus in textbooks"
)
_LAYER = "Thickness of the loose layer. No print can be deeper"
_RIM_REACH = "How far around the foot the displaced ground rises"
_SMOOTHING = "How much the displayed ground is blurred. Forces and depths are not affected"
_CRUST = (
    "Pressure that breaks the crust on untouched ground; less leaves no print. A person exerts about "
    "20 kPa standing, 40 walking. 0 is no crust"
)
_EDGE_WIDTH = (
    "Width of a sole whose edges bear as much as its area: narrower ones sink less, as in snow and clay. 0 makes depth "
    "depend on pressure alone"
)
_FIRM_BELOW = "Compressed further than this, the ground is ten times stiffer. 0 is loose all the way down"


def _look_changed(material: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    state.hooks["follow_look"](material.id_data)


def _packs(material: Any) -> bool:
    return bool(material.densest > 0)


def _let_pack(material: Any, packs: bool) -> None:
    material.densest = USUAL_PACKING if packs else 0.0


class SoftGroundMaterial(bpy.types.PropertyGroup):
    """The ground's physics; see `core.ground.material.GroundMaterial`."""

    preset: StringProperty(name="Preset", description="Last preset loaded", default=DEFAULT.name)
    surface: EnumProperty(
        name="Look",
        translation_context=CONTEXT,
        description="Render material of the ground. It replaces SoftGround's own material, never yours",
        update=_look_changed,
        items=[(surface.name, surface.label, "") for surface in SURFACES.values()],
        default=DEFAULT.surface,
    )
    youngs_modulus: _number("youngs_modulus", "Young's Modulus (Pa)", _STIFFNESS, precision=0, step=1000000)
    poisson_ratio: _number(
        "poisson_ratio",
        "Rim Volume",
        "How much of the displaced volume rises around the foot: none at 0, all of it at 0.5 (sand). Poisson's ratio",
        precision=3,
    )
    characteristic_time: _number(
        "characteristic_time",
        "Settling Time",
        "How long the ground takes to give way under a steady load",
        precision=3,
        unit="TIME_ABSOLUTE",
    )
    layer_depth: _number("layer_depth", "Layer Depth (m)", _LAYER, precision=3, soft_max=2.0)
    rim_reach: _number("rim_reach", "Rim Reach (m)", _RIM_REACH, precision=3, soft_max=0.5)
    blur_sigma: _number("blur_sigma", "Smoothing (m)", _SMOOTHING, precision=4, soft_max=0.05)
    rim_bias: _number(
        "rim_bias",
        "Forward Push",
        "How much more of the rim rises ahead of a moving foot than behind it: at 0 the "
        "rim is even, at 1 nothing rises right behind",
        subtype="FACTOR",
    )
    repose_angle: _number(
        "repose_angle",
        "Angle of Repose",
        "Steepest slope that loose ground can hold: steeper rims and walls slide down. 0 "
        "leaves them as pressed; dry sand holds 32°",
        subtype="ANGLE",
    )
    shortest_time: _number(
        "shortest_time",
        "Shortest Time",
        "Lower limit of the settling time under a fast landing, where the ground gives "
        "way as fast as the foot stops. 0 always uses the full Settling Time",
        precision=3,
        soft_max=0.2,
        unit="TIME_ABSOLUTE",
    )
    hardening: _number(
        "hardening",
        "Hardening",
        "How much stiffer trodden ground is under the next foot: at 10, a second "
        "identical step adds less than a third of the depth. 0 is off",
        precision=1,
        soft_max=50.0,
    )
    crust_stress: _number("crust_stress", "Crust (Pa)", _CRUST, precision=0, soft_max=100e3, step=100000)
    firm_depth: _number("firm_depth", "Firm Below (m)", _FIRM_BELOW, precision=3, soft_max=0.3)
    exponent: _number(
        "exponent",
        "Exponent",
        "How stress grows with compression: 1 is a spring, as in the paper. In snow, at 2, twice the "
        "weight sinks 1.4 times as deep; in clay, at 0.5, four times",
        precision=2,
        step=5,
    )
    densest: _number(
        "densest",
        "Densest Packing",
        "Part of the layer by which it can be pressed: what remains is packed as densely as it can be",
        subtype="FACTOR",
    )
    edge_width: _number("edge_width", "Edges (m)", _EDGE_WIDTH, precision=3, soft_max=0.5)
    spread: _number(
        "spread",
        "Load Spread",
        "How far a load widens on its way down, sideways per depth: it evens out the floors of deep "
        "prints. 0.5 is usual in snow; 0 is off",
        precision=2,
    )
    cohesionless: _number(
        "cohesionless",
        "Cohesionless",
        "Part of the stiffness that comes from the ground's own weight, and so goes with the scene's "
        "gravity: 1 for loose sand, 0 for what holds together",
        subtype="FACTOR",
    )
    packs: BoolProperty(
        name="Densest Packing",
        description="Let the ground give way less and less as it is packed, rather than break off at the layer's depth",
        get=_packs,
        set=_let_pack,
        options={"SKIP_SAVE"},
    )

    stiffness_mpa: in_unit(
        "youngs_modulus", 1e6, "Stiffness (MPa)", _STIFFNESS, min=1e-3, soft_min=0.02, soft_max=5.0, precision=3, step=1
    )
    layer_depth_cm: in_unit("layer_depth", 0.01, "Layer (cm)", _LAYER, min=0.1, soft_max=100.0, precision=1)
    rim_reach_cm: in_unit("rim_reach", 0.01, "Rim Reach (cm)", _RIM_REACH, min=0.0, soft_max=20.0, precision=1)
    blur_sigma_cm: in_unit("blur_sigma", 0.01, "Smoothing (cm)", _SMOOTHING, min=0.0, soft_max=5.0, precision=2)
    crust_stress_kpa: in_unit("crust_stress", 1e3, "Crust (kPa)", _CRUST, min=0.0, soft_max=100.0, precision=1)
    edge_width_cm: in_unit("edge_width", 0.01, "Edges (cm)", _EDGE_WIDTH, min=0.0, soft_max=50.0, precision=1)
    firm_depth_cm: in_unit("firm_depth", 0.01, "Firm Below (cm)", _FIRM_BELOW, min=0.0, soft_max=30.0, precision=1)


def as_core(material: Any) -> GroundMaterial:
    """The material as the core's type, in Blender's single precision."""
    return GroundMaterial(**{field: float(getattr(material, field)) for field in MATERIAL_RANGES})


def by_feel(
    name: str,
    description: str,
    read: Callable[[GroundMaterial], float],
    changed: Callable[[GroundMaterial, float], GroundMaterial],
    **limits: Any,
) -> Any:
    """A property of the settings by which people know a ground: it is read from the material, and sets its fields."""

    def shown(options: Any) -> float:
        return read(as_core(options.material))

    def set_to(options: Any, value: float) -> None:
        before = as_core(options.material)
        for field, number in vars(changed(before, value)).items():
            if number != getattr(before, field):
                setattr(options.material, field, number)

    return FloatProperty(name=name, description=description, get=shown, set=set_to, options={"SKIP_SAVE"}, **limits)


def _paintable(painted: SoftGroundPainted, _context: bpy.types.Context, _typed: str) -> list[str]:
    """Vertex groups that the scene's ground could be painted with."""
    ground = cast("Any", painted.id_data).softground.ground
    if ground is None:
        return []
    floats = {
        attribute.name
        for attribute in ground.data.attributes
        if (attribute.domain, attribute.data_type) == ("POINT", "FLOAT")
    }
    return [*ground.vertex_groups.keys(), *sorted(name for name in floats if not name.startswith("softground_"))]


class SoftGroundPainted(bpy.types.PropertyGroup):
    """Vertex groups or float attributes of the ground's mesh that scale its material; see `core.ground.variation`."""

    stiffness: StringProperty(
        name="Stiffness",
        description="Vertex group or float attribute that multiplies the ground's stiffness: 1 leaves "
        "it as set, 0.5 halves it. Vertices outside the group count as 1",
        default="softground_stiffness",
        search=_paintable,
    )
    layer_depth: StringProperty(
        name="Layer Depth",
        description="Vertex group or float attribute that multiplies the depth of the loose layer: 1 "
        "leaves it as set, 0 takes no print",
        default="softground_layer_depth",
        search=_paintable,
    )
    rim: StringProperty(
        name="Rim",
        translation_context=CONTEXT,
        description="Vertex group or float attribute that multiplies the volume of the rims: 1 leaves "
        "it as set, 0 raises no rim",
        default="softground_rim_factor",
        search=_paintable,
    )
