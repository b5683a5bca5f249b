"""The ground under a moving playhead: the same as in a bake, in whatever order frames are shown."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.composers.playhead import Playhead, footprints_of
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.record.footprints import recompose
from tests.core.walkers import walk

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
CELL = 0.02


@pytest.fixture
def loads():
    return walk()


def state(ground):
    return {place: tile.tobytes() for place, tile in sorted(ground.tiles.items()) if tile.any()}


def baked(loads, frames):
    """State of a bake at each of the frames."""
    states = {}
    for result in simulate([loads], SoftGround(FlatTerrain(), SNOW), CELL):
        if result.frame in frames:
            states[result.frame] = state(result.ground)
    return states


def test_frames_in_any_order_show_the_ground_of_a_bake_bit_for_bit(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    first, last = loads.motion.frames[[0, -1]]
    order = np.random.default_rng(1).integers(first, last + 1, 30).astype(float)
    expected = baked(loads, set(order))
    assert len({frozenset(states.items()) for states in expected.values()}) > 5
    for frame in order:
        playhead.go_to(frame)
        assert playhead.frame == frame
        assert state(playhead.ground) == expected[frame]


def test_before_the_shot_the_ground_is_undisturbed_and_after_it_stays(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    last = loads.motion.frames[-1]
    playhead.go_to(last + 100)
    assert playhead.frame == last
    playhead.go_to(-1e6)
    assert state(playhead.ground) == {}


def test_a_frame_between_two_shows_the_earlier_one(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    playhead.go_to(20.7)
    assert playhead.frame == 20.0


SOFT = replace(SNOW, youngs_modulus=SNOW.youngs_modulus / 3)


def test_the_newest_steps_are_pressed_anew_onto_what_lies_there(loads):
    """As deep as in a bake on the other ground; those before them stay as they are, and so does the playhead."""
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    playhead.go_to(loads.motion.frames[-1])
    before, since = state(playhead.ground), playhead.before_newest()
    assert playhead.first_frame < since < playhead.frame - 10
    newest = playhead.pressed_anew(since, [loads], SoftGround(FlatTerrain(), SOFT))
    newest.go_to(playhead.frame)
    assert state(playhead.ground) == before
    assert newest.frame == playhead.frame
    soft = Playhead([loads], SoftGround(FlatTerrain(), SOFT), CELL)
    soft.go_to(playhead.frame)
    for footprint in footprints_of(soft, soft.loads_by_now()):
        x, y = footprint.position[:2]
        depths = [each.ground.nearest(x, y)[0] for each in (newest, soft, playhead)]
        if footprint.start_frame > since:
            assert depths[0] == pytest.approx(depths[1], rel=1e-6)
            assert depths[0] > 1.5 * depths[2]
        elif footprint.end_frame < since:
            assert depths[0] == depths[2]


def test_the_ground_differs_from_an_earlier_frame_only_where_it_is_said_to(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    first, last = loads.motion.frames[[0, -1]]
    for frame in (first, (first + last) / 2, last):
        playhead.go_to(frame)
        earlier = playhead.ground.copy()
        playhead.go_to(last)
        for window in playhead.changed_since(frame):
            earlier.write(window, playhead.ground.read(window))
        assert state(earlier) == state(playhead.ground)
    assert playhead.changed_since(last) == []


def test_newest_steps_begin_where_the_last_two_feet_came_down(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    playhead.go_to(80.0)
    starts = sorted(footprint.start_frame for footprint in footprints_of(playhead, playhead.loads_by_now()))
    assert playhead.before_newest() == pytest.approx(starts[-2] - 1, abs=1.0)
    playhead.go_to(playhead.first_frame)
    assert playhead.before_newest() == playhead.first_frame


def test_its_footprints_put_together_are_the_ground_that_it_shows(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    for frame in (35.0, 90.0, 50.0):
        playhead.go_to(frame)
        ground = recompose(footprints_of(playhead, playhead.loads_by_now()), cell_size=CELL)
        for place, tile in playhead.ground.tiles.items():
            assert ground.tiles.get(place, np.zeros_like(tile)) == pytest.approx(tile, abs=2e-9)
