"""The contact of a step as the artist's edit leaves it: another sole, another size, another place.

Everything here is a function of what the record keeps of the contact, and of the undisturbed ground.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..ground.heightfield import Terrain
from ..motion.sole_motion import SolePatch
from ..numerics.arrays import Array
from ..numerics.rigid import inverse, rotation, turn_between, unit
from ..record.contact_steps import PressingSole, Steps
from ..record.edits import StepEdit


def edited_contact(
    sole: PressingSole, steps: Steps, other: PressingSole, edit: StepEdit, pivot: Array, terrain: Terrain
) -> tuple[PressingSole, Steps]:
    """The sole that presses a step now, and what it does.

    Parameters
    ----------
    sole : PressingSole
        That made the step.
    steps : Steps
        What it did.
    other : PressingSole
        That presses it now; the same where the sole is not swapped.
    pivot : (3,) float array
        Middle of the print on the undisturbed ground [m].
    """
    steps = swapped(steps, sole, other)
    if edit.scale != 1.0:
        other, steps = _scaled_sole(other, edit.scale), _scaled_steps(steps, edit.scale, pivot)
    return other, _placed(steps, edit, pivot, terrain, _length(other))


def swapped(steps: Steps, sole: PressingSole, other: PressingSole) -> Steps:
    """The steps of a sole in place of another, middle on middle and toes ahead, under the same force.

    Each of its patches moves as that of the sole that made the step does, counted from the toes: a sole in one piece
    lies flat until the toes leave.

    Parameters
    ----------
    steps : Steps
        What `sole` did.
    """
    if other is sole:
        return steps
    (middle, extent), (their_middle, size) = _box(sole), _box(other)
    ahead = np.eye(4)
    ahead[:2, 3] = middle - their_middle
    first = ahead @ inverse(other.flat[0])
    of_own = np.maximum(np.arange(len(other.flat)) + len(sole.flat) - len(other.flat), 0)
    carried = (
        inverse(sole.flat[of_own]) @ sole.flat[0] @ first @ other.flat
    )  # (P, 4, 4) in the frames of its own patches
    whole = steps.poses[:, 0]
    centres = np.einsum("nji,nj->ni", whole[:, :3, :3], steps.centres - whole[:, :3, 3])
    centres[:, :2] = middle + (centres[:, :2] - middle) * size / extent
    return replace(
        steps,
        poses=steps.poses[:, of_own] @ carried,
        approach=steps.approach[:, of_own] @ carried,
        centres=np.einsum("nij,nj->ni", whole[:, :3, :3], centres) + whole[:, :3, 3],
    )


def _box(pressing: PressingSole) -> tuple[Array, Array]:
    """Middle and extent (2,) of a sole's outline along and across it [m]."""
    low, high = pressing.sole.outline.min(axis=0), pressing.sole.outline.max(axis=0)
    return (low + high) / 2, high - low


def _scaled_sole(pressing: PressingSole, scale: float) -> PressingSole:
    """A sole so many times as large."""
    sole, flat = pressing.sole, pressing.flat.copy()
    flat[:, :3, 3] *= scale
    patches = tuple(
        SolePatch(patch.heights * scale, patch.signed_distance * scale, patch.origin * scale, patch.spacing * scale)
        for patch in sole.patches
    )
    prop = replace(sole.prop, vertices=sole.prop.vertices * scale) if sole.prop else None
    larger = replace(sole, patches=patches, landmarks=sole.landmarks * scale, outline=sole.outline * scale, prop=prop)
    return PressingSole(larger, flat)


def _scaled_steps(steps: Steps, scale: float, pivot: Array) -> Steps:
    """The steps of a sole so many times as large about a place (3,), with the force that gives it the same pressure."""
    if scale == 1.0:
        return steps

    def grown(poses: Array) -> Array:
        poses = poses.copy()
        poses[..., :3, 3] = pivot + scale * (poses[..., :3, 3] - pivot)
        return poses

    return replace(
        steps,
        poses=grown(steps.poses),
        approach=grown(steps.approach),
        forces=steps.forces * scale**2,
        centres=pivot + scale * (steps.centres - pivot),
    )


def _placed(steps: Steps, edit: StepEdit, pivot: Array, terrain: Terrain, length: float) -> Steps:
    """The steps of a contact that was moved and turned, following the ground's height and slope.

    Parameters
    ----------
    pivot : (3,) float array
        Middle of the print on the undisturbed ground [m].
    length : float
        Of the sole [m]: the ground's slope is that of a plane as long.
    """
    if edit.move_m == (0.0, 0.0) and edit.turn_deg == 0.0:
        return steps
    target = pivot + np.array([*edit.move_m, 0.0])
    turn = rotation(np.array([0.0, 0.0, np.radians(edit.turn_deg)]))
    if edit.move_m != (0.0, 0.0):
        (here, upright_here), (height, upright_there) = (_plane(terrain, place, length) for place in (pivot, target))
        target[2] = pivot[2] + height - here
        if (upright_here != upright_there).any():
            turn = rotation(turn_between(upright_here, upright_there)) @ turn
    shift = target - turn @ pivot
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, shift
    return replace(
        steps,
        poses=motion @ steps.poses,
        approach=motion @ steps.approach,
        forces=steps.forces @ turn.T,
        normals=steps.normals @ turn.T,
        centres=steps.centres @ turn.T + shift,
    )


def _plane(terrain: Terrain, place: Array, length: float) -> tuple[float, Array]:
    """Height and unit normal of the ground around a place; level where there is none."""
    half = length / 2
    x = place[0] + np.array([0.0, half, -half, 0.0, 0.0])
    y = place[1] + np.array([0.0, 0.0, 0.0, half, -half])
    heights = terrain.heights(x, y)
    if not np.isfinite(heights).all():
        height = float(heights[0])
        return (height if np.isfinite(height) else float(place[2])), np.array([0.0, 0.0, 1.0])
    slope = np.array([heights[1] - heights[2], heights[3] - heights[4]]) / length
    return float(heights[0]), unit(np.array([-slope[0], -slope[1], 1.0]))


def _length(pressing: PressingSole) -> float:
    return float(np.ptp(pressing.sole.outline, axis=0).max())
