"""Proportions of a person: joint places in the rest pose, from stature and a few ratios.

All places are in the body's own frame: x forward, y left, z up, the sole of the feet at z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, radians, sin

import numpy as np

from sample_scenes.motion import Array, Bones

SIDES = {"L": 1.0, "R": -1.0}
"""Suffix of a side's bones, and the sign of y on that side."""

TRUNK: Bones = {
    "hips": ("hips", "spine", None),
    "spine": ("spine", "chest", "hips"),
    "chest": ("chest", "neck", "spine"),
    "neck": ("neck", "head", "chest"),
}
"""What people and animals have in common, without the head."""

ARM: Bones = {"upper_arm": ("shoulder", "elbow", "shoulder"), "forearm": ("elbow", "wrist", "upper_arm")}
"""The same of a limb."""


def on_both_sides(limbs: Bones) -> Bones:
    """Limbs on the left and on the right: their bones and joints with the side as suffix, hung on the trunk."""
    return {
        f"{bone}.{side}": (f"{head}.{side}", f"{tail}.{side}", parent if parent in TRUNK else f"{parent}.{side}")
        for side in SIDES
        for bone, (head, tail, parent) in limbs.items()
    }


BONES: Bones = (
    TRUNK
    | {"head": ("head", "crown", "neck")}
    | on_both_sides(
        {"shoulder": ("collar", "shoulder", "chest")}
        | ARM
        | {
            "hand": ("wrist", "fingertips", "forearm"),
            "thigh": ("hip", "knee", "hips"),
            "shin": ("knee", "ankle", "thigh"),
            "foot": ("ankle", "ball", "shin"),
            "toe": ("ball", "toe", "foot"),
        }
    )
)
"""Bone name -> (joint at its head, joint at its tail, parent bone); parents come before children."""


@dataclass(frozen=True)
class Foot:
    """A foot, shod or bare, in its side's frame: x forward from the point below the ankle, z up from the ground.

    Attributes
    ----------
    length : float
        From the back of the heel to the tip of the toes [m].
    width : float
        Widest place, at the ball [m].
    bare : bool
        Without a shoe.
    """

    length: float = 0.28
    width: float = 0.098
    bare: bool = False

    @property
    def back(self) -> float:
        """Back of the heel [m]."""
        return -0.235 * self.length

    @property
    def front(self) -> float:
        """Tip of the toes [m]."""
        return self.back + self.length

    @property
    def heel(self) -> float:
        """Rear edge of the flat of the heel, on which the foot pivots after heel strike [m]."""
        return self.back + 0.055 * self.length

    @property
    def ball(self) -> float:
        """The joint of the toes, on which the foot pivots after heel-off [m]."""
        return self.back + 0.70 * self.length

    @property
    def toe(self) -> float:
        """Front edge of the flat of the toes, on which the foot pivots before toe-off [m]."""
        return self.back + 0.91 * self.length

    @property
    def ankle_height(self) -> float:
        """Ankle above the ground [m]."""
        return 0.32 * self.length

    @property
    def ball_height(self) -> float:
        """Joint of the toes above the ground [m]; low, so that a bending sole keeps its length."""
        return 0.06 * self.length


_DRAWN_STATURE, _DRAWN_MASS = 1.78, 77.5
"""Stature [m] and mass [kg] of the adult that the figure is drawn as."""


@dataclass(frozen=True)
class Body:
    """A person. Segment lengths are fractions of stature (Drillis & Contini 1966; Winter 2009, Fig. 4.1).

    Attributes
    ----------
    stature : float
        Standing height in shoes [m].
    mass : float
        Body mass [kg].
    foot : Foot
    arm_droop : float
        Angle of the arms below the horizontal in the rest pose [degrees].
    """

    stature: float = 1.78
    mass: float = 77.5
    foot: Foot = Foot()
    arm_droop: float = 58.0

    @property
    def girth(self) -> float:
        """Thickness of limbs and trunk relative to the drawn adult's: mass goes with length times girth²."""
        size = self.stature / _DRAWN_STATURE
        return float(np.sqrt(self.mass / _DRAWN_MASS / size**3))

    @property
    def thigh(self) -> float:
        """Hip to knee [m]."""
        return 0.245 * self.stature

    @property
    def shin(self) -> float:
        """Knee to ankle [m]."""
        return 0.246 * self.stature

    @property
    def leg_length(self) -> float:
        """Hip to sole [m]."""
        return self.thigh + self.shin + self.foot.ankle_height

    @property
    def hip_half_width(self) -> float:
        """Middle of the pelvis to a hip joint [m]."""
        return 0.049 * self.stature * max(self.girth, 1.0) ** 0.5

    @property
    def bones(self) -> Bones:
        """The bones and how they hang together: `BONES`."""
        return BONES

    @cached_property
    def joints(self) -> dict[str, Array]:
        """Joint places in the rest pose, (3,) each [m]."""
        H = self.stature
        hip = self.leg_length
        trunk = H - hip  # from the hip joints to the crown
        places = {
            "hips": (0.0, 0.0, hip),
            "spine": (-0.005 * H, 0.0, hip + 0.13 * trunk),
            "chest": (-0.010 * H, 0.0, hip + 0.33 * trunk),
            "neck": (-0.008 * H, 0.0, hip + 0.645 * trunk),
            "head": (0.004 * H, 0.0, hip + 0.755 * trunk),
            "crown": (0.004 * H, 0.0, H),
        }
        droop = radians(self.arm_droop)
        foot = self.foot
        for side, sign in SIDES.items():
            arm = np.array((0.0, sign * cos(droop), -sin(droop)))
            shoulder = np.array((-0.008 * H, sign * 0.102 * H, hip + 0.572 * trunk))
            elbow = shoulder + 0.176 * H * arm
            wrist = elbow + 0.148 * H * arm
            y = sign * self.hip_half_width
            places |= {
                f"collar.{side}": (-0.004 * H, sign * 0.018 * H, hip + 0.585 * trunk),
                f"shoulder.{side}": shoulder,
                f"elbow.{side}": elbow,
                f"wrist.{side}": wrist,
                f"fingertips.{side}": wrist + 0.10 * H * arm,
                f"hip.{side}": (0.0, y, hip),
                f"knee.{side}": (0.0, y, hip - self.thigh),
                f"ankle.{side}": (0.0, y, foot.ankle_height),
                f"ball.{side}": (foot.ball, y, foot.ball_height),
                f"toe.{side}": (foot.front, y, foot.ball_height),
            }
        return {name: np.asarray(place, dtype=float) for name, place in places.items()}
