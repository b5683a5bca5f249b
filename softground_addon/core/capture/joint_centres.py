"""Centres of the joints from markers on the skin, upright: Z up, metres.

References
----------
Harrington, Zavatsky, Lawson, Yuan, Theologis, "Prediction of the hip joint centre in adults, children, and patients
with cerebral palsy based on magnetic resonance imaging", J. Biomechanics 40 (2007), 10.1016/j.jbiomech.2006.02.003.
de Leva, "Joint center longitudinal positions computed from a selected subset of Chandler's data", J. Biomechanics 29
(1996), 10.1016/0021-9290(96)00021-8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..numerics.arrays import Array
from ..numerics.rigid import unit
from .captured import Capture, Plate, bridged
from .marker_sets import places_of

_HALF_WIDTHS = {"knee": 0.065, "ankle": 0.046, "elbow": 0.045, "wrist": 0.032}
"""Distance of a marker on a joint's outer side from its centre, in leg lengths: 58, 41, 41 and 29 mm for an adult."""
_BELOW_ACROMION = 0.104
"""The shoulder's centre on the way from acromion to elbow (de Leva 1996)."""
_TOE_BEYOND_BALL = 0.37
"""Distance from the ball to the tip of the toes without a marker, over that from heel to ball."""
_TIP_BEYOND_FIFTH = 1.25
"""A marker called "toe" is at the tip when it is so many times as far from the heel as the joints of the toes are."""

UPWARD = {
    "X": np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "-X": np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    "Y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "-Y": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "Z": np.eye(3),
    "-Z": np.diag([1.0, -1, -1]),
}
"""Rotations that bring each axis of a laboratory up."""


@dataclass(frozen=True)
class CapturedBody:
    """A body in motion as a laboratory recorded it, Z up.

    Attributes
    ----------
    joints : dict of str to (F, 3) float array
        Centres by the names of `motion.JOINTS`, with `heel_l` and `heel_r` on the skin [m].
    rate : float
        Frames per second [Hz].
    plates : tuple of Plate
        Their forces are those on the feet.
    """

    joints: dict[str, Array]
    rate: float
    plates: tuple[Plate, ...] = ()


def captured_body(capture: Capture, up: str | None = None) -> CapturedBody:
    """The joint centres of a capture, its gaps bridged by straight lines.

    Parameters
    ----------
    up : str, optional
        The laboratory's upward axis, one of `UPWARD`; by default the one along which the pelvis is above the feet.

    Raises
    ------
    InputError
        If no legs are found among the markers.
    """
    points = _Places(capture)
    joints: dict[str, Array] = {}
    for side in "lr":
        joints |= {f"{joint}_{side}": path for joint, path in _leg(points, side).items()}
    missing = [
        f"{joint}_{side}"
        for side in "lr"
        for joint in ("hip", "knee", "ankle", "heel", "ball")
        if f"{joint}_{side}" not in joints
    ]
    if missing:
        raise InputError(
            f"no markers for {', '.join(missing)} among {', '.join(capture.labels[:12])}...: name them as Plug-in "
            "Gait, OpenSim, OpenCap or Qualisys do, or export joint centres",
            "missing_markers",
            missing=missing,
            labels=capture.labels,
        )
    for side in "lr":
        joints |= {f"{joint}_{side}": path for joint, path in _arm(points, side, _leg_length(joints)).items()}
    joints |= _trunk(points, joints)
    # The hips are above the heels most of the time.
    turn = UPWARD[up or axis_along(joints["hips"] - (joints["heel_l"] + joints["heel_r"]) / 2)]
    # `@` with small matrices on the right, so that nothing wakes the threads of the BLAS library.
    upright = {name: path @ turn.T for name, path in joints.items()}
    plates = tuple(_pushing_up(turned(plate, turn)) for plate in capture.plates)
    return CapturedBody(upright, capture.rate, plates)


class _Places:
    """Paths of the places that carry markers; several markers on one place stand for their mean."""

    def __init__(self, capture: Capture) -> None:
        self._points = capture.points
        self._indices = places_of(capture.labels)

    def each(self, place: str) -> list[Array]:
        paths = [self._points[:, index] for index in self._indices.get(place, [])]
        return [bridged(path) for path in paths if np.isfinite(path).all(axis=1).any()]

    def get(self, place: str) -> Array | None:
        paths = self.each(place)
        return np.mean(paths, axis=0) if paths else None


def _leg(points: _Places, side: str) -> dict[str, Array]:
    leg: dict[str, Array] = {}
    hip = points.get(f"hip.{side}")
    if hip is None:
        hip = _hip_by_regression(points, side)
    across = _outward(points, side)
    length = _rough_leg(points, side)
    for joint, path in (
        ("hip", hip),
        ("knee", _hinge(points, "knee", side, across, length)),
        ("ankle", _hinge(points, "ankle", side, across, length)),
        ("heel", points.get(f"heel.{side}")),
    ):
        if path is not None:
            leg[joint] = path
    return leg | (_forefoot(points, side, leg["heel"]) if "heel" in leg else {})


def _hip_by_regression(points: _Places, side: str) -> Array | None:
    """Hip centre from the pelvis (Harrington et al. 2007, simple regression on its width and depth)."""
    left, right = points.get("asis.l"), points.get("asis.r")
    back = [path for each in ("l", "r") for path in points.each(f"psis.{each}")] or points.each("sacrum")
    if left is None or right is None or not back:
        return None
    front, behind = (left + right) / 2, np.mean(back, axis=0)
    width = float(np.median(np.linalg.norm(left - right, axis=1)))
    depth = float(np.median(np.linalg.norm(front - behind, axis=1)))
    across = unit(right - left)
    forward = front - behind
    forward = unit(forward - (forward * across).sum(axis=1, keepdims=True) * across)
    up = np.cross(across, forward)
    outward = {"r": 1.0, "l": -1.0}[side] * (0.33 * width + 0.0073)
    return front + outward * across - (0.24 * depth + 0.0099) * forward - (0.30 * width + 0.0109) * up


def _outward(points: _Places, side: str) -> Array | None:
    """Direction from the other side of the pelvis to this one, (F, 3)."""
    for place in ("asis", "hip", "psis"):
        left, right = points.get(f"{place}.l"), points.get(f"{place}.r")
        if left is not None and right is not None:
            return unit(right - left) if side == "r" else unit(left - right)
    return None


def _rough_leg(points: _Places, side: str) -> float:
    """Length of the leg from the outer side of knee and ankle alone [m]: the shank is 0.46 of it."""
    knee, ankle = (points.get(f"{joint} outer.{side}") for joint in ("knee", "ankle"))
    if knee is None or ankle is None:
        return 0.0
    return float(np.median(np.linalg.norm(knee - ankle, axis=1))) / 0.46


def _hinge(points: _Places, joint: str, side: str, across: Array | None, length: float) -> Array | None:
    """Centre of a joint: as recorded, midway between its sides, or inward from the outer one."""
    centre, outer, inner = (points.get(f"{joint}{part}.{side}") for part in ("", " outer", " inner"))
    if centre is not None:
        return centre
    if outer is not None and inner is not None:
        return (outer + inner) / 2
    if outer is not None and across is not None:
        return outer - _HALF_WIDTHS[joint] * length * across
    return outer


def _forefoot(points: _Places, side: str, heel: Array) -> dict[str, Array]:
    """Ball and tip of the toes."""
    ball, tip, unclear = (points.get(f"{place}.{side}") for place in ("ball", "toe", "toe or ball"))
    if unclear is not None:
        far = np.median(np.linalg.norm(unclear - heel, axis=1))
        if ball is not None and far > _TIP_BEYOND_FIFTH * np.median(np.linalg.norm(ball - heel, axis=1)):
            tip = unclear if tip is None else tip
        elif ball is None:
            ball = unclear
    if ball is None and tip is not None:
        ball = heel + (tip - heel) / (1 + _TOE_BEYOND_BALL)
    if ball is None:
        return {}
    return {"ball": ball, "toe": ball + _TOE_BEYOND_BALL * (ball - heel) if tip is None else tip}


def _arm(points: _Places, side: str, leg: float) -> dict[str, Array]:
    across = _outward(points, side)
    arm = {joint: _hinge(points, joint, side, across, leg) for joint in ("elbow", "wrist")}
    shoulder, acromion = points.get(f"shoulder.{side}"), points.get(f"acromion.{side}")
    if shoulder is None and acromion is not None:
        elbow = arm["elbow"]
        shoulder = acromion if elbow is None else acromion + _BELOW_ACROMION * (elbow - acromion)
    arm["shoulder"] = shoulder
    return {joint: path for joint, path in arm.items() if path is not None}


def _trunk(points: _Places, joints: dict[str, Array]) -> dict[str, Array]:
    trunk = {"hips": (joints["hip_l"] + joints["hip_r"]) / 2}
    above = [path for place in ("c7", "sternum") for path in points.each(place)]
    shoulders = [joints[f"shoulder_{side}"] for side in "lr" if f"shoulder_{side}" in joints]
    neck = points.get("neck")
    if neck is None and above:
        neck = np.mean(above, axis=0)
    if neck is None and len(shoulders) == 2:
        neck = np.mean(shoulders, axis=0)
    if neck is not None:
        trunk["neck"] = neck
    head = points.each("head") or [path for side in "lr" for path in points.each(f"head side.{side}")]
    return trunk | ({"head": np.mean(head, axis=0)} if head and neck is not None else {})


def _leg_length(joints: dict[str, Array]) -> float:
    """Thigh and shank, the mean of both sides [m]."""
    pairs = [
        (f"{upper}_{side}", f"{lower}_{side}") for side in "lr" for upper, lower in (("hip", "knee"), ("knee", "ankle"))
    ]
    return sum(float(np.median(np.linalg.norm(joints[a] - joints[b], axis=1))) for a, b in pairs) / 2


def axis_along(vectors: Array) -> str:
    """The axis, one of `UPWARD`, along which vectors (F, 3) point most of the time.

    Examples
    --------
    >>> axis_along(np.array([[0.1, -2.0, 0.0], [0.0, -1.0, 0.5], [3.0, 0.0, 0.0]]))
    '-Y'
    """
    median = np.median(vectors, axis=0)
    axis = int(np.argmax(np.abs(median)))
    return ("" if median[axis] > 0 else "-") + "XYZ"[axis]


def turned(plate: Plate, turn: Array) -> Plate:
    """The plate under a rotation (3, 3)."""
    return Plate(plate.corners @ turn.T, plate.rate, plate.force @ turn.T, plate.moment @ turn.T)


def _pushing_up(plate: Plate) -> Plate:
    """The plate with its forces as those on the foot: makers differ in the sign that they write."""
    if plate.force[:, 2].sum() >= 0:
        return plate
    return Plate(plate.corners, plate.rate, -plate.force, -plate.moment)
