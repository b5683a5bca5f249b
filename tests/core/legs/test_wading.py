"""Feet that plough through deep ground, and hips that keep the depth of a stride; nothing of it down to the ankle."""

import numpy as np
import pytest

from softground_addon.core.legs.foot_placement import posed_points
from softground_addon.core.legs.hips import hips_follow
from softground_addon.core.legs.wading import PLOUGH, depth_of_contacts, ploughed
from softground_addon.core.soles import deep_ground
from tests.core.legs.test_grounding import Ground, grounded, placed, walk
from tests.core.walkers import FOOT_LENGTH

FLAT = Ground(lambda x, y, t: 0.0)
STEPPED = np.arange(-1, 10) * 0.6
"""Where the walk's feet stand."""


def holes(depth):
    """Level ground with a print of this depth wherever a foot of the walk stands, as long as a foot and 2 cm more."""
    middle = FOOT_LENGTH / 2 - 0.07

    def height(x, y, t):
        inside = np.abs(x[..., None] - middle - STEPPED).min(axis=-1) < FOOT_LENGTH / 2 + 0.02
        return np.where(inside, -depth, 0.0)

    return Ground(height)


def swings(depth):
    """How far below the surface the feet of the walk swing half way between two prints, (F,) each [m]."""
    motion, touching = walk()
    _, moved = grounded(motion, touching, holes(depth), FLAT)
    for index, sole in enumerate(moved.soles):
        points = posed_points(sole)
        between = ~touching[:, index] & (holes(depth).heights(points[..., 0], points[..., 1]) == 0.0).all(axis=1)
        yield -points[between, :, 2].min(axis=1)


def deepest_swing(depth):
    return max(below.max() for below in swings(depth))


def test_a_foot_ploughs_through_deep_ground_no_deeper_than_it_may_and_lifts_over_shallow_ground():
    shallow, deep = deepest_swing(0.06), deepest_swing(0.35)
    assert shallow < -0.02, "it stays above the surface"
    assert 0.05 < deep < ploughed(0.35, FOOT_LENGTH) + 0.03


def test_a_foot_is_dragged_through_a_layer_as_deep_as_its_ankle_and_a_half_all_the_way():
    for below in swings(0.15):
        assert below == pytest.approx(np.full(len(below), ploughed(0.15, FOOT_LENGTH)), abs=0.01)


def test_a_deeper_layer_is_ploughed_deeper_but_in_a_lesser_part_and_no_shallow_one_is():
    depths = np.linspace(0.0, 2.0, 201)
    plough = ploughed(depths, FOOT_LENGTH)
    assert not plough[depths <= deep_ground.ANKLE * FOOT_LENGTH].any()
    assert (np.diff(plough) >= 0).all()
    assert plough.max() < PLOUGH * FOOT_LENGTH
    wades = depths >= deep_ground.WADES * FOOT_LENGTH
    assert (np.diff(plough[wades] / depths[wades]) < 0).all()


def test_the_depth_of_a_contact_is_that_of_its_middle_and_changes_evenly_between_two():
    touching = np.repeat([True, False, True], [5, 4, 5])
    sinkage = np.where(touching, 0.1, 0.0)
    sinkage[2], sinkage[11] = 0.3, 0.5
    depth = depth_of_contacts(sinkage, touching)
    assert depth[[0, 2, 11, 13]] == pytest.approx([0.3, 0.3, 0.5, 0.5])
    assert np.diff(depth[2:12]) == pytest.approx(np.full(9, 0.2 / 9))


def test_hips_of_a_body_that_wades_keep_their_height_although_each_foot_sinks_in_its_contact(monkeypatch):
    motion, touching = walk()
    period = 1.1 * 30 / 2  # in frames, from step to step
    sinking = Ground(lambda x, y, t: -0.35 * np.clip((t % period) / (0.5 * period), 0.3, 1.0))
    depths = dict(placed(motion, touching, sinking, FLAT).values())
    wading = hips_follow(motion, depths, touching)[20:-20]
    monkeypatch.setattr(deep_ground, "ANKLE", 1e9)
    monkeypatch.setattr(deep_ground, "WADES", 2e9)
    without = hips_follow(motion, depths, touching)[20:-20]
    assert np.ptp(wading) < 0.5 * np.ptp(without)


@pytest.mark.parametrize("depth", [0.03, 0.09])
def test_above_the_ankle_the_response_is_bit_for_bit_that_of_a_body_that_never_wades(depth, monkeypatch):
    assert depth < deep_ground.ANKLE * FOOT_LENGTH
    motion, touching = walk()
    response, _ = grounded(motion, touching, holes(depth), FLAT)
    monkeypatch.setattr(deep_ground, "ANKLE", 1e9)
    monkeypatch.setattr(deep_ground, "WADES", 2e9)
    plain, _ = grounded(motion, touching, holes(depth), FLAT)
    assert response.body.tobytes() == plain.body.tobytes()
    for side, leg in response.legs.items():
        for part in ("thigh", "shank", "foot"):
            assert getattr(leg, part).tobytes() == getattr(plain.legs[side], part).tobytes()
