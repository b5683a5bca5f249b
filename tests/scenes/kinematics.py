"""What a generated motion does, in numbers: points of the soles, joint angles, what the forces ask for."""

from __future__ import annotations

import numpy as np

from sample_scenes.body import SIDES
from sample_scenes.motion import joint_paths


def sole_points(body, motion):
    """Flat of the heel, ball and toes over time: (F, 3) each, by side."""
    paths, foot = joint_paths(body, motion), body.foot
    points = {}
    for side in SIDES:
        heel = (foot.heel, 0.0, -foot.ankle_height)
        toe = (foot.toe - foot.ball, 0.0, -foot.ball_height)
        points[side] = {
            "heel": paths[f"ankle.{side}"] + motion.turns[f"foot.{side}"] @ heel,
            "ball": paths[f"ball.{side}"] + motion.turns[f"toe.{side}"] @ (0.0, 0.0, -foot.ball_height),
            "toe": paths[f"ball.{side}"] + motion.turns[f"toe.{side}"] @ toe,
        }
    return points


def knee_flexion(motion, side):
    """Shin turned backward against the thigh, (F,) [degrees]."""
    relative = np.swapaxes(motion.turns[f"thigh.{side}"], 1, 2) @ motion.turns[f"shin.{side}"]
    return np.degrees(np.arctan2(relative[:, 0, 2], relative[:, 0, 0]))


def largest_slide(body, motion, ground=None):
    """Longest way in the plane of any sole point that is on the ground during one footfall [m]."""
    times = np.arange(len(motion.hips)) / motion.frame_rate
    points = sole_points(body, motion)
    slides = [0.0]
    for fall in motion.footfalls:
        stance = (times > fall.strike) & (times < fall.leave)
        for path in points[fall.side].values():
            height = path[:, 2] - (0.0 if ground is None else ground(path[:, 0], path[:, 1]))
            down = path[stance & (height < 1e-5)]
            if len(down):
                slides.append(np.ptp(down[:, :2], axis=0).max())
    return max(slides)
