"""Settings of characters: what prints, how heavy it is, where its joints are."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ...core.ground import surfaces
from .. import settings
from ..animation_layer.constraint_layer import LayerKind, set_strength
from ..translation import CONTEXT
from .fields import is_mesh, share

DEFAULT_MASS = 77.5
"""Body mass of the paper's character [kg]."""


def _is_armature(_group: bpy.types.PropertyGroup, candidate: bpy.types.Object) -> bool:
    return candidate.type == "ARMATURE"


def _strength(kind: LayerKind, name: str, description: str) -> Any:
    """A slider that scales a layer of the character."""

    def show(character: SoftGroundCharacter, _context: bpy.types.Context) -> None:
        if character.armature:
            set_strength(character.armature, kind, settings.typed(getattr(character, kind.strength)))

    return FloatProperty(
        name=name, description=description, default=1.0, min=0.0, max=2.0, subtype="FACTOR", update=show
    )


class SoftGroundJoint(bpy.types.PropertyGroup):
    """Which bone carries one joint of the body; `name` is the joint."""

    bone: StringProperty(name="Bone", description="Bone that carries this joint")
    end: EnumProperty(
        name="End",
        translation_context=CONTEXT,
        description="Which end of the bone is the joint",
        items=[
            ("HEAD", "Head", "The joint is at the bone's head"),
            ("TAIL", "Tail", "The joint is at the bone's tail"),
        ],
    )


class SoftGroundPart(bpy.types.PropertyGroup):
    """A bone whose skin belongs to a contact; `name` is the bone."""


class SoftGroundSole(bpy.types.PropertyGroup):
    """One contact shape; `name` is what the report calls it."""

    side: EnumProperty(
        name="Side",
        translation_context=CONTEXT,
        description="Side of the body",
        items=[("LEFT", "Left", ""), ("RIGHT", "Right", ""), ("NONE", "None", "Neither left nor right")],
        default="NONE",
    )
    kind: EnumProperty(
        name="Kind",
        description="How the bone prints",
        items=[
            ("FOOT", "Foot", "With a sole from heel to toes: feet, paws and hooves"),
            ("LIMB", "Limb", "With whichever side faces down: hands, knees, elbows, backs"),
        ],
        default="FOOT",
    )
    bone: StringProperty(name="Bone", description="Bone that carries the sole; of a foot, from heel to ball")
    parts: CollectionProperty(name="Parts", type=SoftGroundPart)
    toe_bone: StringProperty(name="Toes", description="Bone that carries the toes; leave empty if the foot has none")
    object: PointerProperty(
        name="Object",
        description="Object that prints in place of a bone, with whichever side of its mesh faces "
        "down: a snowshoe, a cane, a ball, a wheel",
        type=bpy.types.Object,
        poll=is_mesh,
    )


class SoftGroundHold(bpy.types.PropertyGroup):
    """Hold of Clean Feet on one contact; see `core.response.foot_holds`."""

    foot: StringProperty(name="Foot", description="Foot whose contact this is")
    frame: IntProperty(name="Frame", description="Any frame in which the foot is planted")
    mode: EnumProperty(
        name="Lock",
        translation_context=CONTEXT,
        description="What stays in its place during this contact",
        items=[
            ("ROLL", "Roll", "Whatever bears the weight: the foot rolls over heel, ball and toes"),
            ("HEEL", "Heel", "The heel: the rest of the foot moves around it"),
            ("BALL", "Ball", "The ball of the foot: the heel moves around it"),
            ("FLAT", "Flat", "The foot lies flat on the floor all the time"),
            ("FULL", "Full", "The whole foot, as it is where it moves least"),
        ],
        default="FLAT",
    )
    strength: share("Strength", "0 leaves this contact as animated, 1 locks it", default=1.0)
    ease_in: IntProperty(
        name="Ease In",
        description="Frames over which the foot comes to rest after it lands",
        translation_context=CONTEXT,
        min=0,
        soft_max=20,
    )
    ease_out: IntProperty(
        name="Ease Out",
        description="Frames over which the foot starts to leave before it lifts",
        translation_context=CONTEXT,
        min=0,
        soft_max=20,
    )


class SoftGroundCharacter(bpy.types.PropertyGroup):
    """A rig that walks on the ground."""

    armature: PointerProperty(
        name="Armature",
        description="Animated armature that leaves the prints; empty for props that fall, roll and slide",
        type=bpy.types.Object,
        poll=_is_armature,
    )
    body: PointerProperty(
        name="Body",
        description="Mesh that moves its own parts, or empty above rigid ones, where no armature does",
        type=bpy.types.Object,
    )
    mass: FloatProperty(
        name="Mass (kg)",
        description="Mass in kilograms, with clothes and load. Heavier characters leave deeper prints",
        default=DEFAULT_MASS,
        min=0.0,
        soft_min=0.1,
        soft_max=500.0,
        precision=1,
    )
    dirty_soles: share(
        "Dirty Soles",
        "How much is on its soles as the shot starts: 1 is all that they carry",
    )
    dirty_with: EnumProperty(
        name="Dirty With",
        description="What is on its soles as the shot starts",
        items=[
            ("GROUND", "Ground", "What the ground is made of"),
            *(
                (of.name.upper(), of.label, "")
                for of in (*surfaces.SURFACES.values(), *surfaces.LIQUIDS.values())
                if of.carried
            ),
        ],
    )
    size: FloatProperty(
        name="Size", description="Size of the rig, which shows whether its scale is wrong", options={"HIDDEN"}
    )
    skin_mass: FloatProperty(
        name="Mass of the Skin",
        description="Mass estimated from the volume of the skin; 0 if unknown",
        options={"HIDDEN"},
    )
    force_model: EnumProperty(
        name="Force Model",
        translation_context=CONTEXT,
        description="How the force under each foot is estimated from the animation",
        items=[
            ("WHOLE_BODY", "Accurate", "From the acceleration of the body's centre of mass"),
            (
                "IMPULSE",
                "Fast",
                "Weight plus the momentum of the landing foot; needs no look-ahead",
            ),
        ],
        default="WHOLE_BODY",
    )
    root_motion_strength: _strength(
        LayerKind.ROOT_MOTION, "Root Motion", "How fast the character travels: 1 is the speed at which its feet rest"
    )
    clean_feet_strength: _strength(
        LayerKind.CLEAN_FEET, "Clean Feet", "How much of the cleaning shows: 0 is the original animation"
    )
    response_strength: _strength(
        LayerKind.RESPONSE,
        "Response",
        "How much of the baked response shows: 0 is the original animation, 1 the response as baked. Needs no new bake",
    )
    joints: CollectionProperty(name="Joints", type=SoftGroundJoint)
    active_joint: IntProperty(name="Active Joint", options={"HIDDEN"})
    soles: CollectionProperty(name="Soles", type=SoftGroundSole)
    active_sole: IntProperty(name="Active Sole", options={"HIDDEN"})
    holds: CollectionProperty(name="Foot Locks", type=SoftGroundHold)
    active_hold: IntProperty(name="Active Foot Lock", options={"HIDDEN"})
    sole_length: FloatProperty(
        name="Sole Length", description="Length of the shortest sole [m], which sets the cell size", options={"HIDDEN"}
    )
