"""Proportions of a dog: joint places in the rest pose, from the height at the withers.

Places are in the body's own frame: x forward, y left, z up, the paws at z = 0 and the centre of mass over the origin.
It stands on its toes: `foot` and `hand` are the paws, `hock` and `pastern` the bones above them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sample_scenes.body import ARM, SIDES, TRUNK, on_both_sides
from sample_scenes.motion import Array, Bones

DOG_BONES: Bones = (
    TRUNK
    | {
        "head": ("head", "nose", "neck"),
        "tail.1": ("tail", "tail_middle", "hips"),
        "tail.2": ("tail_middle", "tail_tip", "tail.1"),
    }
    | on_both_sides(
        {
            "thigh": ("hip", "knee", "hips"),
            "shin": ("knee", "hock", "thigh"),
            "hock": ("hock", "paw", "shin"),
            "foot": ("paw", "toe", "hock"),
            "shoulder": ("withers", "shoulder", "chest"),
        }
        | ARM
        | {"pastern": ("wrist", "forepaw", "forearm"), "hand": ("forepaw", "foretoe", "pastern")}
    )
)
"""Bone name -> (joint at its head, joint at its tail, parent bone); parents come before children."""

FRONT_SHARE = 0.60
"""Part of a standing dog's weight on its front legs (552 dogs of 123 breeds: "A 60:40 split:
Differential mass support in dogs", The Anatomical Record, 2020, 10.1002/ar.24407)."""


@dataclass(frozen=True)
class Paw:
    """A paw in its own frame, as `footwork.FootCourse` wants a foot: x forward from below its joint, z up.

    Attributes
    ----------
    length, width : float
        Of the print [m].
    """

    length: float
    width: float

    @property
    def heel(self) -> float:
        """Rear edge of the pads [m]."""
        return -0.30 * self.length

    @property
    def toe(self) -> float:
        """Front edge of the pads, over which the paw rolls off [m]."""
        return 0.55 * self.length

    @property
    def ball(self) -> float:
        """The toes do not bend: the same as `toe` [m]."""
        return self.toe

    @property
    def ankle_height(self) -> float:
        """Joint above the ground [m]."""
        return 0.42 * self.length

    @property
    def ball_height(self) -> float:
        """[m]"""
        return 0.0


@dataclass(frozen=True)
class Dog:
    """A long-legged dog of the shepherd kind.

    Attributes
    ----------
    withers : float
        Height at the shoulder blades [m].
    mass : float
        [kg].
    brush, tail, ears, snout, paws : float
        How many times thicker the tail is than a shepherd's, and longer; how many times longer the ears are, thicker
        the snout and larger the paws.
    toes_apart : bool
        True if pads and toes stand out below the paws, and print one by one.
    """

    withers: float = 0.66
    mass: float = 35.0
    brush: float = 1.0
    tail: float = 1.0
    ears: float = 1.0
    snout: float = 1.0
    paws: float = 1.0
    toes_apart: bool = False

    @property
    def bones(self) -> Bones:
        """The bones and how they hang together: `DOG_BONES`."""
        return DOG_BONES

    @property
    def girth(self) -> float:
        """Thickness relative to a shepherd of this height."""
        return float(np.sqrt(self.mass / 35.0 / (self.withers / 0.66) ** 3))

    @property
    def paw(self) -> Paw:
        """Any of the four."""
        return Paw(0.135 * self.paws * self.withers, 0.115 * self.paws * self.withers)

    @property
    def hip_height(self) -> float:
        """[m]; the leg length in Froude numbers."""
        return float(self.joints["hips"][2])

    @cached_property
    def joints(self) -> dict[str, Array]:
        """Joint places in the rest pose, (3,) each [m]."""
        W = self.withers
        paw_z = self.paw.ankle_height / W
        hip_x, shoulder_x = -0.52, 0.38
        places: dict[str, tuple[float, float, float]] = {
            "hips": (hip_x, 0.0, 0.84),
            "spine": (hip_x + 0.22, 0.0, 0.89),
            "chest": (0.08, 0.0, 0.86),
            "neck": (0.40, 0.0, 0.90),
            "head": (0.62, 0.0, 1.17),
            "nose": (0.95, 0.0, 1.09),
            "tail": (hip_x - 0.14, 0.0, 0.88),
            "tail_middle": (hip_x - 0.14 - 0.22 * self.tail, 0.0, 0.88 - 0.20 * self.tail),
            "tail_tip": (hip_x - 0.14 - 0.41 * self.tail, 0.0, 0.88 - 0.36 * self.tail),
        }
        for side, sign in SIDES.items():
            hind, front = 0.115 * sign, 0.125 * sign
            places |= {
                f"hip.{side}": (hip_x, hind, 0.82),
                f"knee.{side}": (hip_x + 0.13, hind, 0.50),
                f"hock.{side}": (hip_x - 0.12, hind, 0.245),
                f"paw.{side}": (hip_x - 0.03, hind, paw_z),
                f"toe.{side}": (hip_x - 0.03 + 0.075, hind, 0.6 * paw_z),
                f"withers.{side}": (shoulder_x - 0.13, 0.75 * front, 0.95),
                f"shoulder.{side}": (shoulder_x + 0.06, front, 0.69),
                f"elbow.{side}": (shoulder_x - 0.115, front, 0.47),
                f"wrist.{side}": (shoulder_x - 0.02, front, 0.175),
                f"forepaw.{side}": (shoulder_x + 0.03, front, paw_z),
                f"foretoe.{side}": (shoulder_x + 0.03 + 0.075, front, 0.6 * paw_z),
            }
        return {name: W * np.array(place) for name, place in places.items()}

    @property
    def centre(self) -> Array:
        """Centre of mass in the rest pose, (3,) [m]: between the paws so that the front ones bear `FRONT_SHARE`."""
        hind, front = self.joints["paw.L"][0], self.joints["forepaw.L"][0]
        return np.array((hind + FRONT_SHARE * (front - hind), 0.0, 0.74 * self.withers))
