"""Motions that do not repeat: footfalls, a path of the centre of mass, angles of trunk and arms, all keyed in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sample_scenes.balance import balanced, rest_centre
from sample_scenes.body import SIDES, Array, Body
from sample_scenes.carriage import hang_arm
from sample_scenes.curves import clamped_spline, monotone_cubic
from sample_scenes.footwork import FootCourse, FootPoses, KeyedRoll, Swing
from sample_scenes.hands import arms_with_hands_down, between
from sample_scenes.motion import BodyMotion, Footfall, joint_paths, rotation
from sample_scenes.stride import assemble, within_reach

MAX_STRETCH = 0.985
"""Longest hip-ankle distance, relative to the straight leg."""

_LOOSENING = 0.18  # s in the air until a foot hangs loose

Track = Sequence[tuple[float, float]]
"""Times [s] and angles [degrees]; level before the first and after the last."""

Via = Sequence[tuple[float, tuple[float, float, float]]]
"""Parts of a swing and where the ankle is then [m]."""


@dataclass(frozen=True)
class Score:
    """What a body does, in its own frame.

    Attributes
    ----------
    footfalls : tuple of Footfall
        In order for each side; the first strikes before the motion begins, the last leaves after it ends.
    pitch : mapping of str to Track
        Foot pitch of each side, toes up positive.
    centre : callable
        Times (F,) [s] to places of the centre of mass (F, 3) [m].
    angles : mapping of str to Track
        "yaw", "lean", "list" of the pelvis (left, forward, to the right positive); "bend", "twist", "tilt" of the chest
        against it (forward, left, to the right); "nod" of the head; "arm", "spread", "elbow" and "inward" with a side,
        as in "arm.L": upper arm ahead of hanging, away from the body, bend of the elbow, turn of the forearm inward.
        What is not keyed stays relaxed.
    swings : mapping of (str, int) to Via
        Ways of swings, by side and number; others go straight with a lift of `lift`.
    lift : float
        [m]
    hands : tuple of Footfall
        When and where hands are on the ground; free arms then point as "spread.L" and "spread.R" say.
    loose_feet : bool
        Feet in the air hang from the shin, whichever way the leg points, rather than keeping their keyed pitch.
    """

    footfalls: tuple[Footfall, ...]
    pitch: Mapping[str, Track]
    centre: Callable[[Array], Array]
    angles: Mapping[str, Track] = field(default_factory=dict)
    swings: Mapping[tuple[str, int], Via] = field(default_factory=dict)
    lift: float = 0.08
    hands: tuple[Footfall, ...] = ()
    loose_feet: bool = False


_RELAXED = {"elbow": 18.0, "inward": 14.0, "arm": 0.0, "spread": 0.0}


def perform(body: Body, score: Score, frame_count: int, frame_rate: float = 24.0) -> BodyMotion:
    """The motion of a score."""
    times = np.arange(frame_count) / frame_rate
    upper = _upper_body(body, score, times)
    feet = {side: _foot(body, score, side, times) for side in SIDES}
    centre = score.centre(times)

    def pose(hips: Array) -> BodyMotion:
        reached = {side: within_reach(body, side, hips, upper["hips"], feet[side], MAX_STRETCH) for side in SIDES}
        motion = assemble(body, frame_rate, hips, upper, reached, score.footfalls)
        if score.loose_feet:
            motion.turns.update(_loosened(score, motion.turns, times))
        if score.hands:
            paths = joint_paths(body, motion)
            shoulders = {side: paths[f"shoulder.{side}"] for side in SIDES}
            spread = {side: angle(score, f"spread.{side}", times) for side in SIDES}
            motion.turns.update(arms_with_hands_down(body, times, score.hands, upper["chest"], shoulders, spread))
        return motion

    return balanced(body, pose, centre, centre - (rest_centre(body) - body.joints["hips"]))


def angle(score: Score, name: str, times: Array) -> Array:
    """A keyed angle over time, (F,) [rad]."""
    keys = score.angles.get(name)
    if keys is None:
        return np.full(len(times), np.radians(_RELAXED.get(name.partition(".")[0], 0.0)))
    knots, values = np.transpose(keys)
    return (
        monotone_cubic(times, knots, np.radians(values))
        if len(keys) > 1
        else np.full(len(times), np.radians(values[0]))
    )


def _upper_body(body: Body, score: Score, times: Array) -> dict[str, Array]:
    def of(name: str) -> Array:
        return angle(score, name, times)

    pelvis = rotation("z", of("yaw")) @ rotation("x", of("list")) @ rotation("y", of("lean"))

    def above(share: float) -> Array:
        turn = (
            rotation("z", share * of("twist")) @ rotation("x", share * of("tilt")) @ rotation("y", share * of("bend"))
        )
        return np.asarray(pelvis @ turn)

    chest = above(1.0)
    level = chest @ rotation("x", -0.5 * of("tilt")) @ rotation("y", -0.5 * (of("bend") + of("lean")) + of("nod"))
    turns = {"hips": pelvis, "spine": above(0.5), "chest": chest, "neck": level, "head": level}
    for side in SIDES:
        turns[f"shoulder.{side}"] = chest
        joints = (of(f"{name}.{side}") for name in ("arm", "elbow", "inward", "spread"))
        turns |= hang_arm(body, side, chest, *joints)
    return turns


def _loosened(score: Score, turns: dict[str, Array], times: Array) -> dict[str, Array]:
    """Feet and toes that hang from the shin with the toes pointed, the more the longer they are in the air."""
    loose = {}
    for side in SIDES:
        falls = [fall for fall in score.footfalls if fall.side == side]
        away = np.min([np.maximum(np.maximum(f.strike - times, times - f.leave), 0.0) for f in falls], axis=0)
        free = np.clip(away / _LOOSENING, 0.0, 1.0)
        free = free**2 * (3 - 2 * free)
        pointed = turns[f"shin.{side}"] @ rotation("y", np.full(len(times), np.radians(40.0)))
        loose |= {f"{bone}.{side}": between(turns[f"{bone}.{side}"], pointed, free) for bone in ("foot", "toe")}
    return loose


def _foot(body: Body, score: Score, side: str, times: Array) -> FootPoses:
    falls = tuple(fall for fall in score.footfalls if fall.side == side)

    def swing_path(part: Array, swing: Swing) -> Array:
        number = falls.index(swing.before)
        via = score.swings.get((side, number))
        if via is None:
            via = [(0.5, tuple((swing.start + swing.end) / 2 + (0.0, 0.0, score.lift)))]
        knots = [0.0, *(knot for knot, _ in via), 1.0]
        places = [swing.start, *(np.array(place) for _, place in via), swing.end]
        return clamped_spline(part, knots, places, swing.start_slope, swing.end_slope)

    course = FootCourse(body.foot, KeyedRoll(tuple(score.pitch[side]), falls), swing_path, (0.0, 0.0, 0.0))
    return course.poses(times, [*falls, _after(falls[-1])])


def _after(last: Footfall) -> Footfall:
    """A footfall that never comes: the last one lasts."""
    return Footfall(last.side, last.leave + 1e3, last.leave + 2e3, last.place, last.heading)


def standing(side: str, start: float, end: float, x: float, y: float, heading: float = 0.0) -> Footfall:
    """A foot that stands on level ground at a place in the body's frame [m], turned by a heading [degrees]."""
    return Footfall(side, start, end, np.array((x, y, 0.0)), float(np.radians(heading)))
