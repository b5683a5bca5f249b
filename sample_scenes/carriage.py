"""How a walker or runner carries the body above the legs: pelvis, trunk, head and arms over the phase of a stride.

Phases are fractions of a stride, 0 at the heel strike of the left foot; the right foot does the same half a stride
later.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from sample_scenes.body import SIDES, Array, Body
from sample_scenes.motion import rotation

_HANG = 9.0  # degrees of a hanging arm off the body


@dataclass(frozen=True, kw_only=True)
class Carriage:
    """Movements of pelvis, trunk and arms.

    Attributes
    ----------
    hip_yaw, hip_list, chest_yaw, lean : float
        Pelvis rotation and drop, counter-rotation of the chest, lean of the trunk [degrees].
    arm_swing, elbow_bend : float
        Swing of the upper arm to either side and mean bend of the elbow [degrees].
    arm_forward : float
        Mean place of the upper arm before the trunk [degrees].
    elbow_swing : float
        Change of the elbow's bend with the swing, relative to the mean.
    arm_inward : float
        Turn of the forearms toward the middle of the body [degrees].
    """

    hip_yaw: float = 6.0
    hip_list: float = 3.5
    chest_yaw: float = 6.0
    lean: float = 3.0
    arm_swing: float = 20.0
    elbow_bend: float = 22.0
    arm_forward: float = -6.0
    elbow_swing: float = 0.45
    arm_inward: float = 14.0

    def pelvis(self, phase: Array) -> Array:
        """Rotation of the pelvis, (F, 3, 3)."""
        yaw = -np.radians(self.hip_yaw) * np.cos(2 * pi * phase)
        lean = np.full_like(phase, np.radians(self.lean))
        return rotation("z", yaw) @ rotation("x", self._drop(phase)) @ rotation("y", lean)

    def trunk(self, phase: Array, mid_stance: float) -> dict[str, Array]:
        """Rotations of spine, chest, neck, head and shoulders; the trunk nods with the steps."""
        lean = np.radians(self.lean)
        yaw = np.radians(self.chest_yaw) * np.cos(2 * pi * phase)
        tilt = self._drop(phase)
        nod = np.radians(1.0) * np.cos(4 * pi * (phase - mid_stance))

        def turn(yaw_share: float, tilt_share: float, pitch: Array) -> Array:
            return rotation("z", yaw_share * yaw) @ rotation("x", tilt_share * tilt) @ rotation("y", pitch)

        chest = turn(1.0, -0.35, lean + nod)
        turns = {
            "spine": turn(0.2, 0.1, lean + 0.5 * nod),
            "chest": chest,
            "neck": turn(0.5, -0.15, 0.9 * lean + nod),
            "head": turn(0.1, 0.0, np.full_like(phase, 0.3 * lean)),
        }
        return turns | {f"shoulder.{side}": chest for side in SIDES}

    def arm(self, body: Body, side: str, phase: Array, chest: Array) -> dict[str, Array]:
        """Rotations of an arm, which swings against the leg of its side."""
        cycle = phase + (0.0 if SIDES[side] > 0 else 0.5)
        swing = np.radians(self.arm_forward + self.arm_swing * np.cos(2 * pi * (cycle - 0.02)))
        elbow = np.radians(self.elbow_bend * (1 - self.elbow_swing * np.cos(2 * pi * (cycle - 0.07))))
        return hang_arm(body, side, chest, -swing, elbow, np.full_like(phase, np.radians(self.arm_inward)))

    def _drop(self, phase: Array) -> Array:
        return np.radians(self.hip_list) * np.sin(2 * pi * (phase - 0.03))


def hang_arm(
    body: Body, side: str, chest: Array, forward: Array, elbow: Array, inward: Array, spread: Array | float = 0.0
) -> dict[str, Array]:
    """Rotations of an arm from the angles of its joints.

    Parameters
    ----------
    body : Body
    side : str
    chest : (F, 3, 3) float array
        Rotation of the chest.
    forward, elbow, inward, spread : (F,) float array
        Upper arm ahead of hanging, bend of the elbow, turn of the forearm inward, upper arm away from the body [rad].
    """
    sign = SIDES[side]
    droop = np.radians(90.0 - body.arm_droop - _HANG)  # from the rest pose down to nearly hanging
    hang = rotation("x", np.full_like(elbow, -sign * droop))
    upper = chest @ rotation("x", sign * np.asarray(spread, float)) @ rotation("y", -forward)
    fore = upper @ rotation("z", -sign * inward) @ rotation("y", -elbow)
    wrist = fore @ rotation("y", np.full_like(elbow, np.radians(4.0)))
    return {f"upper_arm.{side}": upper @ hang, f"forearm.{side}": fore @ hang, f"hand.{side}": wrist @ hang}
