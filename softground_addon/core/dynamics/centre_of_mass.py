"""Mass of a body: segments from the joints that are mapped, their centre of mass, and what free fall tells.

Mass fractions and segment centres are those of de Leva (1996), "Adjustments to Zatsiorsky-Seluyanov's segment inertia
parameters", J. Biomechanics 29(9), table 4, male; four-legged animals have their own.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..motion.motion import CENTRE, CharacterMotion
from ..numerics.arrays import Array
from ..numerics.rigid import unit


@dataclass(frozen=True)
class _MassTable:
    """Mass fractions and centres of a kind of body.

    Attributes
    ----------
    trunk, trunk_centre : float
        Fraction, and centre from the upper end (0) to the hips (1).
    head, head_centre : float
        Fraction of head and neck, and their centre above the neck joint in trunk lengths. Where rigs put their head
        joint varies too much to measure along it.
    limbs : tuple of (float, str, str, float)
        Fraction of one side, joints, and centre on the line from the first joint (0) to the second (1).
    """

    trunk: float
    trunk_centre: float
    head: float
    head_centre: float
    limbs: tuple[tuple[float, str, str, float], ...]


_HUMAN = _MassTable(
    trunk=0.4346,
    # As de Leva gives it from the neck joint. Half of the upper end is between the shoulders, from which he gives less:
    # his trunk is stiff, one that bends takes its belly along with the hips (docs/forces.md, "Where the constants").
    trunk_centre=0.5138,
    head=0.0694,
    head_centre=0.20,  # 0.5·243 mm of 603 mm
    limbs=(
        (0.0271, "shoulder", "elbow", 0.5772),
        (0.0162, "elbow", "wrist", 0.4574),
        (0.0061, "elbow", "wrist", 1.25),  # the hand: 0.79·86 mm beyond the wrist of a 269 mm forearm
        (0.1416, "hip", "knee", 0.4095),
        (0.0433, "knee", "ankle", 0.4395),
        (0.0137, "ankle", "ball", 0.35),  # 44 % from heel to toe tip, seen from the ankle
    ),
)

_FOUR_LEGGED = _MassTable(
    trunk=0.66,
    # So that the front legs of a standing animal bear 0.6 of its weight, as those of dogs do (Roush & McLaughlin 1994).
    trunk_centre=0.458,
    head=0.11,
    head_centre=0.20,
    limbs=(
        (0.028, "shoulder", "elbow", 0.45),
        (0.018, "elbow", "wrist", 0.45),
        (0.009, "elbow", "wrist", 1.2),
        (0.035, "hip", "knee", 0.42),
        (0.017, "knee", "ankle", 0.42),
        (0.008, "ankle", "ball", 0.35),
    ),
)
"""Of animals with legs much lighter than a man's: two thirds of the mass are trunk, a ninth head and neck."""

_TOWARD_HIPS = {
    "spine": "hips",
    "neck": "spine",
    "head": "neck",
    "shoulder": "neck",
    "elbow": "shoulder",
    "wrist": "elbow",
    "hip": "hips",
    "knee": "hip",
    "ankle": "knee",
    "ball": "ankle",
}
"""The joint that carries the mass of one that is not mapped."""

_LEG_JOINTS = ("hip", "knee", "ankle")

_FRACTION_DEVIATION = 0.2
"""Standard deviation of a body part's mass fraction about de Leva's, relative: people differ, and markers and bones
slide against the flesh that they stand for."""
_FALL_DEVIATION = 0.03
"""Standard deviation of an independent measurement of the acceleration in free fall, in gravities."""


@dataclass(frozen=True)
class MassPoints:
    """A body as point masses.

    Attributes
    ----------
    positions : (N, K, 3) float array [m]
    fractions : (K,) float array
        Of the body mass; they sum to 1.
    parts : (K,) int array
        Index of the body part that each point belongs to; left and right limbs are one part.
    legs : (K,) bool array
        The points on limbs that stand, as far as their joints are mapped.
    """

    positions: Array
    fractions: Array
    parts: NDArray[np.intp]
    legs: NDArray[np.bool_]

    @cached_property
    def centre(self) -> Array:
        """Centre of mass, (N, 3) [m]."""
        return self.fractions @ self.positions

    def legs_moment(self) -> Array:
        """Share of the legs in `centre`, (N, 3) [m]."""
        return (self.fractions * self.legs) @ self.positions

    def legs_of_parts(self) -> NDArray[np.bool_]:
        """Mask of the parts that are legs, (parts,)."""
        legs = np.zeros(self.parts.max() + 1, dtype=bool)
        legs[self.parts] = self.legs
        return legs

    def part_centres(self) -> Array:
        """Centre of mass of each part, (N, parts, 3) [m]."""
        membership = np.eye(self.parts.max() + 1)[self.parts] * self.fractions[:, None]
        return (membership / membership.sum(axis=0)).T @ self.positions


def centre_of_mass(motion: CharacterMotion) -> Array:
    """Path of the centre of mass, (N, 3) [m]; see `mass_points`."""
    return mass_points(motion).centre


def mass_points(motion: CharacterMotion) -> MassPoints:
    """The body's segments as point masses at their centres.

    A neck that is not mapped is taken between the shoulders. Any other joint that is not mapped is replaced by the next
    mapped one toward the hips, so that with only the hips mapped the whole mass moves with them (the paper's choice).
    Without any joint, the mean of the soles stands in. Where the middle of the body's volume is known instead, all mass
    is there.
    """
    if CENTRE in motion.joints:
        whole = motion.joints[CENTRE][:, None]
        return MassPoints(whole, np.ones(1), np.zeros(1, dtype=np.intp), np.zeros(1, dtype=bool))
    table = _FOUR_LEGGED if motion.four_legged else _HUMAN
    joints = _Joints(motion)
    neck, hips = joints["neck"], joints["hips"]
    shoulders = (joints["shoulder_l"] + joints["shoulder_r"]) / 2
    trunk_length = np.median(np.linalg.norm(neck - hips, axis=-1))
    points = [
        (table.trunk * table.trunk_centre, hips),
        (table.trunk * (1 - table.trunk_centre) / 2, neck),
        (table.trunk * (1 - table.trunk_centre) / 2, shoulders),
        (table.head, neck + table.head_centre * trunk_length * unit(joints["head"] - neck)),
    ]
    parts, legs = list(range(len(points))), [False] * len(points)
    for part, (fraction, start, end, centre) in enumerate(table.limbs, start=len(points)):
        for side in "lr":
            proximal, distal = joints[f"{start}_{side}"], joints[f"{end}_{side}"]
            points.append((fraction, proximal + centre * (distal - proximal)))
            parts.append(part)
            legs.append((motion.four_legged or start in _LEG_JOINTS) and f"{end}_{side}" in motion.joints)
    fractions = np.array([fraction for fraction, _ in points])
    positions = np.stack([position for _, position in points], axis=1)
    return MassPoints(positions, fractions / fractions.sum(), np.array(parts), np.array(legs))


def trunk_spin(motion: CharacterMotion) -> Array:
    """Angular momentum of the trunk about its own length per body mass, (N, 1) [m²/s], upward.

    Its point masses lie on a line; half of the mass at the hips and at the shoulders is on each side of it instead.
    """
    table = _FOUR_LEGGED if motion.four_legged else _HUMAN
    joints = _Joints(motion)
    spin = np.zeros((len(motion.frames), 1))
    if len(spin) > 1:
        for fraction, joint in ((table.trunk_centre, "hip"), ((1 - table.trunk_centre) / 2, "shoulder")):
            (x, y), (u, v) = _half_across(joints, joint, motion.time_step)
            spin[:, 0] += table.trunk * fraction * (x * v - y * u)
    return spin


def _half_across(joints: _Joints, joint: str, step: float) -> tuple[Array, Array]:
    """Horizontal vector from the middle of two joints to the left one, and its rate of change, (2, N) each."""
    across = (joints[f"{joint}_l"] - joints[f"{joint}_r"])[:, :2].T / 2
    return across, np.gradient(across, step, axis=1)


def fitted_to_free_fall(
    points: MassPoints, accelerations: Array, gravity: float, *, independent: float = 1.0, whole: bool = True
) -> tuple[MassPoints, float, float]:
    """The same body with the mass fractions that make it fall freely when it does, and how far it is from that still.

    In flight the centre of mass falls with g whatever the limbs do, so that what it seems to do beside tells how the
    body's mass differs from the table's. Least squares with the table as the prior. Markers and bones bounce more than
    the flesh does: the fractions may also tell what share of the body moves as they do.

    Parameters
    ----------
    accelerations : (M, parts, 3) float array
        Acceleration of each part's centre at steps of free fall [m/s²].
    gravity : float
        [m/s²]
    independent : float
        Share of the M steps that tell something new: low-passed accelerations change slowly.
    whole : bool
        True if all of the body moves as its joints do, as it also does where nothing shows the legs.

    Returns
    -------
    points : MassPoints
    moving : float
        The share of the body that moves as its joints do.
    misfit : float
        Sum of squares, in standard deviations, of what is not free fall and of the changes of the fractions.
    """
    prior = np.bincount(points.parts, weights=points.fractions)
    deviation = _FRACTION_DEVIATION * prior
    rows = np.moveaxis(accelerations / gravity, 1, -1).reshape(-1, len(prior))
    row_deviation = _FALL_DEVIATION / np.sqrt(independent)
    scaled = rows * deviation / row_deviation
    # `solve`, and `@` with a vector, would wake the threads of the BLAS library, which cost more than they save here.
    missed = (np.einsum("rp,p->r", rows, prior) + np.tile((0.0, 0.0, 1.0), len(accelerations))) / row_deviation
    pull = -np.einsum("rp,r->p", scaled, missed)
    # Least squares for the changes in deviations, the table being one more row for each of them.
    stiffness, modes = np.linalg.eigh(scaled.T @ scaled + np.eye(len(prior)))
    flexibility = (modes / stiffness) @ modes.T
    change = flexibility @ pull
    if whole or not points.legs.any():
        # The force of a constraint keeps the sum of the fractions.
        along = flexibility @ deviation
        change -= along * (deviation @ change) / (deviation @ along)
    misfit = ((missed + np.einsum("rp,p->r", scaled, change)) ** 2).sum() + (change**2).sum()
    fractions = points.fractions * (np.maximum(prior + deviation * change, 0.0) / prior)[points.parts]
    moving = float(fractions.sum())
    return dataclasses.replace(points, fractions=fractions / moving), moving, float(misfit)


class _Joints:
    """Paths of joints by name, with stand-ins for those that are not mapped."""

    def __init__(self, motion: CharacterMotion) -> None:
        self._mapped = motion.joints
        self._hips = _hips(motion)

    def __getitem__(self, name: str) -> Array:
        if name in self._mapped:
            return self._mapped[name]
        if name == "hips":
            return self._hips
        if name == "neck" and {"shoulder_l", "shoulder_r"} <= self._mapped.keys():
            return (self._mapped["shoulder_l"] + self._mapped["shoulder_r"]) / 2  # the far end of a four-legged trunk
        joint, _, side = name.partition("_")
        parent = _TOWARD_HIPS[joint]
        return self[f"{parent}_{side}" if side and parent not in ("neck", "hips") else parent]


def _hips(motion: CharacterMotion) -> Array:
    """The best stand-in for unmapped hips."""
    joints = motion.joints
    if {"hip_l", "hip_r"} <= joints.keys():
        return (joints["hip_l"] + joints["hip_r"]) / 2
    for name in ("spine", "neck"):
        if name in joints:
            return joints[name]
    if joints:
        return np.mean(list(joints.values()), axis=0)
    return np.mean([sole.landmark_positions().mean(axis=1) for sole in motion.soles], axis=0)
