"""What the user sets of the ground's material. Lengths are metres whatever the scene's units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import bpy
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ...core.ground.material import MATERIAL_RANGES
from ...core.ground.presets import SURFACES
from .fields import in_unit


def _limits(field: str) -> dict[str, float]:
    low, high = MATERIAL_RANGES[field]
    return {"min": low, "max": high}


_STIFFNESS = (
    "Stiffness of the loose layer: twice the value makes prints half as deep. An effective modulus "
    "for compaction, far below the elastic modulus in textbooks"
)
_LAYER = "Thickness of the loose layer. No print can be deeper"
_RIM_REACH = "How far around the foot the displaced ground rises"
_SMOOTHING = "How much the displayed ground is blurred. Forces and depths are not affected"
_CRUST = (
    "Pressure that breaks the crust on untouched ground; less leaves no print. A person exerts about "
    "20 kPa standing, 40 walking. 0 is no crust"
)
_FIRM_BELOW = "Compressed further than this, the ground is ten times stiffer. 0 is loose all the way down"


look_followers: list[Callable[[bpy.types.Scene], None]] = []
"""What is told when the look of a scene's ground is another: by what knows the ground."""


def _look_changed(material: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    for follow in look_followers:
        follow(cast("bpy.types.Scene", material.id_data))


class SoftGroundMaterial(bpy.types.PropertyGroup):
    """The ground's physics; see `core.ground.material.GroundMaterial`."""

    preset: StringProperty(name="Preset", description="Last preset loaded", default="Snow")
    surface: EnumProperty(
        name="Look",
        description="Render material of the ground. It replaces SoftGround's own material, never yours",
        update=_look_changed,
        items=[(name, name.replace("_", " ").title(), "") for name in SURFACES],
        default="snow",
    )
    youngs_modulus: FloatProperty(
        name="Young's Modulus (Pa)",
        description=_STIFFNESS,
        default=375e3,
        precision=0,
        step=1000000,
        **_limits("youngs_modulus"),
    )
    poisson_ratio: FloatProperty(
        name="Rim Volume",
        description="How much of the displaced volume rises around the foot: none at 0, all of it at "
        "0.5 (sand). Poisson's ratio",
        default=0.05,
        precision=3,
        **_limits("poisson_ratio"),
    )
    characteristic_time: FloatProperty(
        name="Settling Time",
        description="How long the ground takes to give way under a steady load",
        default=0.2,
        precision=3,
        unit="TIME_ABSOLUTE",
        **_limits("characteristic_time"),
    )
    layer_depth: FloatProperty(
        name="Layer Depth (m)",
        description=_LAYER,
        default=0.3,
        precision=3,
        soft_max=2.0,
        **_limits("layer_depth"),
    )
    rim_reach: FloatProperty(
        name="Rim Reach (m)",
        description=_RIM_REACH,
        default=0.04,
        precision=3,
        soft_max=0.5,
        **_limits("rim_reach"),
    )
    blur_sigma: FloatProperty(
        name="Smoothing (m)",
        description=_SMOOTHING,
        default=0.005,
        precision=4,
        soft_max=0.05,
        **_limits("blur_sigma"),
    )
    rim_bias: FloatProperty(
        name="Forward Push",
        description="How much more of the rim rises ahead of a moving foot than behind it: at 0 the "
        "rim is even, at 1 nothing rises right behind",
        default=0.0,
        subtype="FACTOR",
        **_limits("rim_bias"),
    )
    repose_angle: FloatProperty(
        name="Angle of Repose",
        description="Steepest slope that loose ground can hold: steeper rims and walls slide down. 0 "
        "leaves them as pressed; dry sand holds 32°",
        default=0.0,
        subtype="ANGLE",
        **_limits("repose_angle"),
    )
    shortest_time: FloatProperty(
        name="Shortest Time",
        description="Lower limit of the settling time under a fast landing, where the ground gives "
        "way as fast as the foot stops. 0 always uses the full Settling Time",
        default=0.0,
        precision=3,
        soft_max=0.2,
        unit="TIME_ABSOLUTE",
        **_limits("shortest_time"),
    )
    hardening: FloatProperty(
        name="Hardening",
        description="How much stiffer trodden ground is under the next foot: at 10, a second "
        "identical step adds less than a third of the depth. 0 is off",
        default=0.0,
        precision=1,
        soft_max=50.0,
        **_limits("hardening"),
    )
    crust_stress: FloatProperty(
        name="Crust (Pa)",
        description=_CRUST,
        default=0.0,
        precision=0,
        soft_max=100e3,
        step=100000,
        **_limits("crust_stress"),
    )
    firm_depth: FloatProperty(
        name="Firm Below (m)",
        description=_FIRM_BELOW,
        default=0.0,
        precision=3,
        soft_max=0.3,
        **_limits("firm_depth"),
    )

    stiffness_mpa: in_unit(
        "youngs_modulus", 1e6, "Stiffness (MPa)", _STIFFNESS, min=1e-3, soft_min=0.02, soft_max=5.0, precision=3, step=1
    )
    layer_depth_cm: in_unit("layer_depth", 0.01, "Layer (cm)", _LAYER, min=0.1, soft_max=100.0, precision=1)
    rim_reach_cm: in_unit("rim_reach", 0.01, "Rim Reach (cm)", _RIM_REACH, min=0.0, soft_max=20.0, precision=1)
    blur_sigma_cm: in_unit("blur_sigma", 0.01, "Smoothing (cm)", _SMOOTHING, min=0.0, soft_max=5.0, precision=2)
    crust_stress_kpa: in_unit("crust_stress", 1e3, "Crust (kPa)", _CRUST, min=0.0, soft_max=100.0, precision=1)
    firm_depth_cm: in_unit("firm_depth", 0.01, "Firm Below (cm)", _FIRM_BELOW, min=0.0, soft_max=30.0, precision=1)


def _paintable(painted: SoftGroundPainted, _context: bpy.types.Context, _typed: str) -> list[str]:
    """What the scene's ground could be painted with."""
    ground = cast("Any", painted.id_data).softground.ground
    if ground is None:
        return []
    floats = {one.name for one in ground.data.attributes if (one.domain, one.data_type) == ("POINT", "FLOAT")}
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
        description="Vertex group or float attribute that multiplies the volume of the rims: 1 leaves "
        "it as set, 0 raises no rim",
        default="softground_rim_factor",
        search=_paintable,
    )
