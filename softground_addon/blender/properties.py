"""What the user sets: `scene.softground`, saved with the .blend. Lengths are metres whatever the scene's units."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.presets import MATERIAL_RANGES, SURFACES
from . import nla_layer, settings

DEFAULT_MASS = 77.5
"""Body mass of the paper's character [kg]."""

DEFAULT_CELL_SIZE = 0.01
"""Fine enough for the edge of a human print [m]."""


def _is_armature(_group: bpy.types.PropertyGroup, candidate: bpy.types.Object) -> bool:
    return candidate.type == "ARMATURE"


def _is_mesh(_group: bpy.types.PropertyGroup, candidate: bpy.types.Object) -> bool:
    return candidate.type == "MESH"


def _limits(field: str) -> dict[str, float]:
    low, high = MATERIAL_RANGES[field]
    return {"min": low, "max": high}


def _in_unit(field: str, unit: float) -> dict[str, Any]:
    """What shows a field in another unit, given in the field's own: the same number, kept once."""

    def shown(group: Any) -> float:
        return float(getattr(group, field)) / unit

    def set_to(group: Any, value: float) -> None:
        setattr(group, field, value * unit)

    return {"get": shown, "set": set_to, "options": {"SKIP_SAVE"}}


def _show_response(character: SoftGroundCharacter, _context: bpy.types.Context) -> None:
    if character.armature:
        nla_layer.set_strength(character.armature, settings.typed(character.response_strength))


class SoftGroundJoint(bpy.types.PropertyGroup):
    """Which bone carries one joint of the body; `name` is the joint."""

    bone: StringProperty(name="Bone", description="Bone that carries this joint")
    end: EnumProperty(
        name="End",
        description="Which end of the bone is the joint",
        items=[
            ("HEAD", "Head", "The joint is at the bone's head"),
            ("TAIL", "Tail", "The joint is at the bone's tail"),
        ],
    )


class SoftGroundSole(bpy.types.PropertyGroup):
    """One thing that prints; `name` is what the report calls it."""

    side: EnumProperty(
        name="Side",
        description="Side of the body",
        items=[("LEFT", "Left", ""), ("RIGHT", "Right", ""), ("NONE", "None", "Neither left nor right")],
        default="NONE",
    )
    kind: EnumProperty(
        name="Kind",
        description="How the bone prints",
        items=[
            ("FOOT", "Foot", "With a sole from heel to toes: feet, paws and hooves"),
            ("LIMB", "Limb", "With whatever side of it faces down: hands, knees, elbows, backs"),
        ],
        default="FOOT",
    )
    bone: StringProperty(name="Bone", description="Bone that carries the sole; of a foot, from heel to ball")
    toe_bone: StringProperty(name="Toes", description="Bone that carries the toes; leave empty where the foot has none")
    object: PointerProperty(
        name="Object",
        description="Object that prints in place of a bone, with whatever side of its mesh faces down: a snowshoe, a "
        "cane, a ball, a wheel",
        type=bpy.types.Object,
        poll=_is_mesh,
    )


class SoftGroundCharacter(bpy.types.PropertyGroup):
    """A rig that walks on the ground."""

    armature: PointerProperty(
        name="Armature",
        description="Animated armature that leaves the prints; empty for things that fall, roll and slide",
        type=bpy.types.Object,
        poll=_is_armature,
    )
    mass: FloatProperty(
        name="Mass (kg)",
        description="Mass in kilograms; of a character, with clothes and load. The depth of the prints grows with it",
        default=DEFAULT_MASS,
        min=0.0,
        soft_min=0.1,
        soft_max=500.0,
        precision=1,
    )
    force_model: EnumProperty(
        name="Forces",
        description="How the force under each foot is estimated from the animation",
        items=[
            ("WHOLE_BODY", "Whole Body", "From the acceleration of the body's centre of mass: best for baking"),
            (
                "IMPULSE",
                "Impulse",
                "Weight plus the momentum of the landing foot, as in the paper; needs no look-ahead",
            ),
        ],
        default="WHOLE_BODY",
    )
    response_strength: FloatProperty(
        name="Response",
        description="How much of the baked response shows: 0 is the animation as it was made, 1 the response as baked. "
        "Needs no new bake",
        default=1.0,
        min=0.0,
        max=2.0,
        subtype="FACTOR",
        update=_show_response,
    )
    joints: CollectionProperty(name="Joints", type=SoftGroundJoint)
    soles: CollectionProperty(name="Soles", type=SoftGroundSole)
    active_sole: IntProperty(name="Active Sole", options={"HIDDEN"})


class SoftGroundMaterial(bpy.types.PropertyGroup):
    """The ground's physics; see `core.deformation.GroundMaterial`."""

    preset: StringProperty(name="Preset", description="Preset that was loaded last", default="Snow")
    surface: EnumProperty(
        name="Look",
        description="Render material that a created ground gets",
        items=[(name, name.replace("_", " ").title(), "") for name in SURFACES],
        default="snow",
    )
    youngs_modulus: FloatProperty(
        name="Young's Modulus (Pa)",
        description=(
            "Stiffness of the loose layer, in pascals: prints are half as deep at twice the value. An effective "
            "modulus for compaction, far below the elastic one from textbooks"
        ),
        default=375e3,
        precision=0,
        step=1000000,
        **_limits("youngs_modulus"),
    )
    poisson_ratio: FloatProperty(
        name="Poisson's Ratio",
        description="How much of the pressed-down volume rises around the foot: none at 0, all of it at 0.5 (sand)",
        default=0.05,
        precision=3,
        **_limits("poisson_ratio"),
    )
    characteristic_time: FloatProperty(
        name="Time",
        description="How long the ground takes to give way under a steady load",
        default=0.2,
        precision=3,
        unit="TIME_ABSOLUTE",
        **_limits("characteristic_time"),
    )
    layer_depth: FloatProperty(
        name="Layer Depth (m)",
        description="Thickness of the loose layer, in metres. No print is deeper",
        default=0.3,
        precision=3,
        soft_max=2.0,
        **_limits("layer_depth"),
    )
    rim_reach: FloatProperty(
        name="Rim Reach (m)",
        description="How far around the foot the displaced ground rises, in metres",
        default=0.04,
        precision=3,
        soft_max=0.5,
        **_limits("rim_reach"),
    )
    blur_sigma: FloatProperty(
        name="Smoothing (m)",
        description="Width of the blur that the shown ground gets, in metres. Forces and depths do not see it",
        default=0.005,
        precision=4,
        soft_max=0.05,
        **_limits("blur_sigma"),
    )
    rim_bias: FloatProperty(
        name="Rim Ahead",
        description="How much more of the rim rises ahead of a moving foot than behind it: 0 none, 1 all of it",
        default=0.0,
        subtype="FACTOR",
        **_limits("rim_bias"),
    )
    repose_angle: FloatProperty(
        name="Angle of Repose",
        description="Steepest slope that loose ground keeps: rims and walls slide down to it. 0 keeps them as pressed; "
        "dry sand has 32°",
        default=0.0,
        subtype="ANGLE",
        **_limits("repose_angle"),
    )
    shortest_time: FloatProperty(
        name="Shortest Time",
        description="Under a fast landing the ground gives way within the time that the foot takes to stop, down to "
        "this. 0 always takes the full time",
        default=0.0,
        precision=3,
        soft_max=0.2,
        unit="TIME_ABSOLUTE",
        **_limits("shortest_time"),
    )
    hardening: FloatProperty(
        name="Hardening",
        description="How much stiffer trodden ground is under the next foot: at 10, a second step like the first adds "
        "less than a third of it. 0 turns it off",
        default=0.0,
        precision=1,
        soft_max=50.0,
        **_limits("hardening"),
    )
    crust_stress: FloatProperty(
        name="Crust (Pa)",
        description="Pressure at which the crust on untouched ground breaks, in pascals; what presses less leaves no "
        "print. A person stands with about 20 kPa, walks with 40. 0 is no crust",
        default=0.0,
        precision=0,
        soft_max=100e3,
        step=100000,
        **_limits("crust_stress"),
    )
    firm_depth: FloatProperty(
        name="Firm Below (m)",
        description="Depth of compression below which the ground is ten times stiffer, in metres. 0 is loose all "
        "through",
        default=0.0,
        precision=3,
        soft_max=0.3,
        **_limits("firm_depth"),
    )

    stiffness_mpa: FloatProperty(
        name="Stiffness (MPa)",
        description=(
            "Young's modulus of the loose layer, in megapascals: prints are half as deep at twice the value. An "
            "effective modulus for compaction, far below the elastic one from textbooks"
        ),
        min=1e-3,
        soft_min=0.02,
        soft_max=5.0,
        precision=3,
        step=1,
        **_in_unit("youngs_modulus", 1e6),
    )
    layer_depth_cm: FloatProperty(
        name="Layer Depth (cm)",
        description="Thickness of the loose layer, in centimetres. No print is deeper",
        min=0.1,
        soft_max=100.0,
        precision=1,
        **_in_unit("layer_depth", 0.01),
    )
    rim_reach_cm: FloatProperty(
        name="Rim Reach (cm)",
        description="How far around the foot the displaced ground rises, in centimetres",
        min=0.0,
        soft_max=20.0,
        precision=1,
        **_in_unit("rim_reach", 0.01),
    )
    blur_sigma_cm: FloatProperty(
        name="Smoothing (cm)",
        description="Width of the blur that the shown ground gets, in centimetres. Forces and depths do not see it",
        min=0.0,
        soft_max=5.0,
        precision=2,
        **_in_unit("blur_sigma", 0.01),
    )


class SoftGroundPainted(bpy.types.PropertyGroup):
    """Vertex groups or float attributes of the ground's mesh that scale its material; see `core.variation`."""

    stiffness: StringProperty(
        name="Stiffness",
        description="Vertex group or float attribute of the ground by which its stiffness is multiplied: 1 is as the "
        "material says, 0.5 half as stiff. Vertices outside the group are as the material says",
        default="softground_stiffness",
    )
    layer_depth: StringProperty(
        name="Layer Depth",
        description="Vertex group or float attribute of the ground by which the depth of its loose layer is "
        "multiplied: 1 is as the material says, 0 takes no print",
        default="softground_layer_depth",
    )
    rim: StringProperty(
        name="Rim",
        description="Vertex group or float attribute of the ground by which the volume of its rims is multiplied: 1 is "
        "as the material says, 0 raises no rim",
        default="softground_rim_factor",
    )


class SoftGroundTilt(bpy.types.PropertyGroup):
    """How bodies lean on sloping and yielding ground; see `core.tilt`."""

    use: BoolProperty(
        name="Tilt",
        description="Let the body lean into slopes and sway over the ground that gives way, as a layer of keys above "
        "the animation",
        default=False,
    )
    frequency: FloatProperty(
        name="Frequency (Hz)",
        description="How fast the body swings back to balance, in swings per second",
        default=0.6,
        min=0.02,
        max=5.0,
        soft_min=0.2,
        soft_max=2.0,
        precision=2,
    )
    damping: FloatProperty(
        name="Damping",
        description="1 comes to rest without swinging past, less swings on, more is sluggish",
        default=0.85,
        min=0.0,
        max=5.0,
        soft_min=0.1,
        soft_max=1.5,
        precision=2,
    )
    strength: FloatProperty(
        name="Strength",
        description="How much of a slope the body leans by: 1 by as much as the ground rises",
        default=0.5,
        min=0.0,
        max=2.0,
        subtype="FACTOR",
    )
    lateral: FloatProperty(
        name="Sideways",
        description="How much of that it also leans on slopes across its way",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )


class SoftGroundGrounding(bpy.types.PropertyGroup):
    """How feet, legs and hips follow the pressed ground; see `core.grounding`."""

    use: BoolProperty(
        name="Grounding",
        description="Let the feet sink with the ground they press and stand on its slopes, with hips and knees to "
        "match, as a layer of keys above the animation",
        default=False,
    )
    align: FloatProperty(
        name="Align Feet",
        description="How much of the ground's slope the feet take on, within what an ankle can bend",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    lock: FloatProperty(
        name="Lock Slides",
        description="How much of the animation's sliding is taken out of feet that stand",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    knee_lift: FloatProperty(
        name="Lift Knees",
        description="Lift swinging feet higher, at 1 by as much as they had sunk",
        default=0.0,
        min=0.0,
        max=2.0,
        subtype="FACTOR",
    )
    hold: FloatProperty(
        name="Hold Feet",
        description="Let feet stay longer in deep ground and catch up in their swing",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    crouch: FloatProperty(
        name="Bend Knees",
        description="Bring the hips down in deep ground, at 1 by half the sinkage",
        default=0.0,
        min=0.0,
        max=2.0,
        subtype="FACTOR",
    )
    arms: FloatProperty(
        name="Arms Out",
        description="Raise the arms sideways for balance in deep ground",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )


class SoftGroundSettings(bpy.types.PropertyGroup):
    """Everything that a bake reads."""

    ground: PointerProperty(
        name="Ground", description="Mesh that gives way under the characters", type=bpy.types.Object, poll=_is_mesh
    )
    characters: CollectionProperty(name="Characters", type=SoftGroundCharacter)
    active_character: IntProperty(name="Active Character", options={"HIDDEN"})
    material: PointerProperty(name="Material", type=SoftGroundMaterial)
    cell_size: FloatProperty(
        name="Cell Size (m)",
        description="Size of the cells in which the ground is computed, in metres",
        default=DEFAULT_CELL_SIZE,
        min=1e-4,
        max=1.0,
        soft_min=0.002,
        soft_max=0.05,
        precision=4,
    )
    cell_size_cm: FloatProperty(
        name="Cell Size (cm)",
        description="Size of the cells in which the ground is computed, in centimetres. Half the size takes four times "
        "the memory; the depth of the prints does not depend on it",
        min=0.01,
        max=100.0,
        soft_min=0.2,
        soft_max=5.0,
        precision=2,
        **_in_unit("cell_size", 0.01),
    )
    shape_keys: BoolProperty(
        name="Shape Keys",
        description=(
            "Keep the raw and the smoothed heights as shape keys, to sculpt or blend. "
            "Without them a dense ground plays several times faster"
        ),
        default=True,
    )
    detail: EnumProperty(
        name="Detail",
        description="Whether a fine copy of the ground along the trail takes the prints, with the ground hidden",
        items=[
            ("AUTO", "Automatic", "Where the ground is too coarse to show the prints"),
            ("ALWAYS", "Always", "Fine along the trail even where the ground itself could show the prints"),
            ("NEVER", "Never", "Press the ground's own vertices"),
        ],
        default="AUTO",
    )
    output: EnumProperty(
        name="Bake",
        description="What a bake makes",
        items=[
            ("BOTH", "Prints and Response", "Footprints in the ground, and the characters' response where it is on"),
            ("PRINTS", "Prints Only", "Footprints in the ground; the characters stay as they are animated"),
            ("RESPONSE", "Response Only", "The characters' response; the ground stays as it is"),
        ],
        default="BOTH",
    )
    painted: PointerProperty(name="Painted", type=SoftGroundPainted)
    pressure: EnumProperty(
        name="Pressure",
        description="How the force on a foot spreads over its contact",
        items=[
            ("UNIFORM", "Even", "The same pressure under all of the foot that touches, as in the paper"),
            (
                "CENTRE_OF_PRESSURE",
                "Rolling",
                "Most pressure where the force acts, from the heel to the toes: steps have deep heels and toes",
            ),
        ],
        default="UNIFORM",
    )
    tilt: PointerProperty(name="Tilt", type=SoftGroundTilt)
    grounding: PointerProperty(name="Grounding", type=SoftGroundGrounding)
    frame_start: IntProperty(name="Start", description="First frame of the bake", default=1)
    frame_end: IntProperty(name="End", description="Last frame of the bake", default=250)
    keep_forces: BoolProperty(
        name="Forces in Report",
        description="Write the force under each sole at each frame into the report",
        default=False,
    )


CLASSES = (
    SoftGroundJoint,
    SoftGroundSole,
    SoftGroundCharacter,
    SoftGroundMaterial,
    SoftGroundPainted,
    SoftGroundTilt,
    SoftGroundGrounding,
    SoftGroundSettings,
)
