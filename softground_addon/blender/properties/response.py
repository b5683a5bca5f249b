"""Settings of how characters respond to the ground."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty

from .fields import share


class SoftGroundTilt(bpy.types.PropertyGroup):
    """How bodies lean on sloping and yielding ground; see `core.response.tilt`."""

    use: BoolProperty(
        name="Tilt",
        description="Let the body lean into slopes and sway over soft ground, as a layer of keys above the animation",
        default=False,
    )
    frequency: FloatProperty(
        name="Frequency (Hz)",
        description="How fast the body sways back to balance, in swings per second",
        default=0.6,
        min=0.02,
        max=5.0,
        soft_min=0.2,
        soft_max=2.0,
        precision=2,
    )
    damping: FloatProperty(
        name="Damping",
        description="1 comes to rest without overshooting; less keeps swinging, more is sluggish",
        default=0.85,
        min=0.0,
        max=5.0,
        soft_min=0.1,
        soft_max=1.5,
        precision=2,
    )
    strength: share(
        "Strength", "How far the body leans into a slope: at 1, by the full angle of the ground", default=0.5, most=2.0
    )
    own_strength: FloatProperty(
        name="Own Strength",
        description="Strength before the preset Wading; -1 without it",
        default=-1.0,
        min=-1.0,
        options={"HIDDEN"},
    )
    lateral: share("Sideways", "How much of that lean also applies to slopes across its path", default=1.0)


class SoftGroundGrounding(bpy.types.PropertyGroup):
    """How feet, legs and hips follow the pressed ground; see `core.legs.grounding`."""

    use: BoolProperty(
        name="Grounding",
        description="Let the feet sink into the ground they press and stand on its slopes; hips and "
        "knees follow. A layer of keys above the animation",
        default=False,
    )
    by_button: BoolProperty(name="By a Button", description="Switched on by Sink Feet", options={"HIDDEN"})
    align: share(
        "Align Feet", "How much of the ground's slope the feet follow, as far as an ankle can bend", default=1.0
    )
    lock: share("Reduce Sliding", "How much of the animation's foot sliding is removed from standing feet")
    knee_lift: share("Lift Knees", "Lift swinging feet higher; at 1, by as much as they had sunk", most=2.0)
    hold: share("Hold Feet", "Keep feet in deep ground longer, and let them catch up in the swing")
    crouch: share("Bend Knees", "Lower the hips in deep ground; at 1, by half the sinkage", most=2.0)
    arms: share("Arms Out", "Raise the arms sideways for balance in deep ground")
