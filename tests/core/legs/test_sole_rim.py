"""The rim of a sole whose toes bend: skin near the crease moves as both pieces in part."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from softground_addon.core.legs.foot_lock import Underside, lock, slides, turned_level
from softground_addon.core.legs.foot_placement import posed_points
from softground_addon.core.legs.sole_rim import along, posed_rim, rim, rim_pieces
from softground_addon.core.motion.sole_motion import SoleMotion
from softground_addon.core.numerics.rigid import carried, displacement, rotation
from tests.core.walkers import foot_sole, pose

HINGE = 0.02
"""Of the toes, above the sole [m]."""
HEEL_RISE = np.radians(15.0)
FRAMES = 12


@pytest.fixture(scope="module")
def sole():
    flat = foot_sole("foot.L", "L")
    return replace(flat, bend=0.3 * flat.length)


def crease_of(sole):
    (_, foot), (_, toes) = rim(sole)
    return (foot[:, 0].max() + toes[:, 0].min()) / 2


def rolling(sole, toes=0.0):
    """A foot whose heel rises, and whose toes do so many times as much, about a hinge over its crease."""
    flat, angle = pose(np.zeros((FRAMES, 3))), np.linspace(0.0, HEEL_RISE, FRAMES)[:, None]
    hinge = np.tile((crease_of(sole), 0.0, HINGE), (FRAMES, 1))
    up = [displacement(rotation(part * angle * (0.0, 1.0, 0.0)), hinge, hinge) @ flat for part in (1.0, -toes)]
    return SoleMotion(sole, np.stack(up, axis=1))


def test_a_flat_sole_is_as_its_pieces_are(sole):
    flat = SoleMotion(sole, np.repeat(pose(np.zeros((2, 3)))[:, None], 2, axis=1))
    np.testing.assert_allclose(posed_rim(flat), posed_points(flat, rim(sole)), atol=1e-9)


def test_away_from_the_crease_it_is_rigid_and_at_the_crease_halfway(sole):
    motion, x = rolling(sole), np.concatenate([places[:, 0] for _, places in rim(sole)])
    bent, rigid = posed_rim(motion), posed_points(motion, rim(sole))
    away = np.abs(x - crease_of(sole)) > sole.bend
    np.testing.assert_allclose(bent[:, away], rigid[:, away], atol=1e-12)
    gone = bent[-1, np.abs(x - crease_of(sole)).argmin()] - bent[0, np.abs(x - crease_of(sole)).argmin()]
    assert gone[0] == pytest.approx(-HINGE * np.sin(HEEL_RISE) / 2, rel=0.15)


def test_what_lies_side_by_side_at_the_crease_stays_side_by_side(sole):
    bent, rigid = posed_rim(rolling(sole)), posed_points(rolling(sole), rim(sole))
    (_, foot), (_, toes) = rim(sole)
    front, back = (
        int(foot[:, 0].argmax()),
        len(foot) + int(np.hypot(*(toes - foot[foot[:, 0].argmax()])[:, :2].T).argmin()),
    )
    apart = [np.ptp(np.linalg.norm(points[:, front] - points[:, back], axis=1)) for points in (bent, rigid)]
    assert apart[0] < 0.3 * apart[1]


def test_a_sole_that_bends_up_at_both_ends_slides_less_than_rigid_pieces_would(sole):
    motion = rolling(sole, toes=1.0)
    touching, worst = np.ones(FRAMES, bool), []
    for points in (posed_rim(motion), posed_points(motion, rim(sole))):
        heights = points[..., 2] - points[..., 2].min(axis=1, keepdims=True)
        under = Underside(points, heights, rim_pieces(sole), sole.length, along(sole))
        held = carried(lock(under, touching)[:, None], points)
        worst.append(slides(replace(under, points=held), touching).max())
    assert worst[0] < 1e-3
    assert worst[0] < 0.2 * worst[1]


def planted_slides(under, placement):
    """Distances of planted points from where they were planted (N, 2), of frames turned and shifted (3 F,) as told."""
    turn, shift = placement.reshape(-1, 3)[:, 0], placement.reshape(-1, 3)[:, 1:]
    points = turned_level(turn[:, None], under.points[..., :2]) + shift[:, None]
    planted, slides, first = under.planted(), [], np.zeros_like(points[0])
    for frame, bears in enumerate(planted):
        new = bears & ~planted[frame - 1] if frame else bears
        first[new] = points[frame][new]
        slides.append((points[frame] - first)[bears])
    return np.concatenate(slides)


@pytest.mark.parametrize("toes", [0.5, -0.3], ids=["toes bend up", "toes follow the heel"])
def test_no_other_level_way_of_a_bending_sole_would_slide_less(sole, toes):
    """Against a general least-squares solver."""
    motion, touching = rolling(sole, toes), np.ones(FRAMES, bool)
    points = posed_rim(motion)
    under = Underside(
        points, points[..., 2] - points[..., 2].min(axis=1, keepdims=True), rim_pieces(sole), sole.length, along(sole)
    )
    held = replace(under, points=carried(lock(under, touching)[:, None], points))
    still = np.zeros(3 * FRAMES)
    best = least_squares(lambda placement: planted_slides(under, placement).ravel(), still, max_nfev=30)
    ours, least = (np.sqrt((slid**2).mean()) for slid in (planted_slides(held, still), best.fun))
    assert ours < 1.01 * least
