"""Where the prints of a sole that slides begin and end."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.loads.tracks import LONGEST_SLIDE, SHORTEST_SLIDE, tracks
from softground_addon.core.motion.motion import LowSkin
from softground_addon.core.soles.soles import prop_sole
from tests.core.prop_bodies import sphere
from tests.core.walkers import box_sole, loads_of, pose

HEIGHT = 1.8


def sliding(distance, heading, seconds=1.0, sole=None):
    """A foot of a body of 1.8 m that slides for a while."""
    sole = sole or box_sole(0.3, 0.1)
    count = round(seconds * 120) + 1
    path = np.linspace(0, distance, count)[:, None] * (np.cos(heading), np.sin(heading), 0.0)
    touching = np.ones((count, 1), dtype=bool)
    loads = loads_of([sole], [pose(path, heading)[:, None]], 100.0 * touching, touching, 30.0)
    up = np.ones((count, 1, 3))
    skin = LowSkin(loads.motion.frames, up, up[..., 0], 0.3, HEIGHT)
    return replace(loads, motion=replace(loads.motion, skin=skin))


@pytest.mark.parametrize("heading", np.radians([0, 30, 45, 90, 200]))
@pytest.mark.parametrize(("slides", "prints"), [(0.0, 1), (0.95, 1), (1.2, 2), (2.5, 3)])
def test_a_foot_that_slides_prints_as_often_whichever_way_it_goes(slides, prints, heading):
    pieces = list(tracks(sliding(slides * LONGEST_SLIDE * HEIGHT, heading), 0))
    assert len(pieces) == prints
    lengths = [piece.stop - piece.start for piece in pieces]
    assert max(lengths) - min(lengths) <= 0.1 * max(lengths) + 2


def test_a_foot_that_slides_fast_prints_no_shorter_than_it_may():
    pieces = list(tracks(sliding(3.0, 0.5, seconds=0.3), 0))
    assert len(pieces) == int(0.3 / SHORTEST_SLIDE)


@pytest.mark.parametrize(("give", "prints"), [(0.04, 3), (0.0, 1)], ids=["limb", "ball"])
def test_a_limb_that_slides_prints_as_a_foot_does_and_what_rolls_one_track(give, prints):
    ball = prop_sole(*sphere(0.1), name="ball", give=give)
    assert len(list(tracks(sliding(2.5 * LONGEST_SLIDE * HEIGHT, 0.0, sole=ball), 0))) == prints


@pytest.mark.parametrize(("length", "prints"), [(0.3, 4), (0.6, 3), (1.7, 1)])
def test_what_lies_long_on_the_ground_prints_again_no_sooner_than_its_length(length, prints):
    """A snake is low: a quarter of its height is next to nothing."""
    assert len(list(tracks(sliding(1.65, 0.0, sole=box_sole(length, 0.1)), 0))) == prints
