"""The ground under a moving playhead: the same as in a bake, in whatever order frames are shown."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.playhead import Playhead
from softground_addon.core.record.footprints import recompose
from softground_addon.core.simulation import Simulation, simulate
from tests.core.pressing.test_prop_prints import rolling
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


def test_a_new_material_acts_on_what_follows_only(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    middle = float(np.floor(loads.motion.frames.mean()))
    playhead.go_to(loads.motion.frames[-1])
    playhead.go_to(middle)
    before = state(playhead.ground)
    playhead.material = replace(SNOW, youngs_modulus=SNOW.youngs_modulus / 3)
    playhead.go_to(middle)
    assert state(playhead.ground) == before
    playhead.go_to(loads.motion.frames[-1])
    softer = [f.max_depth_m for f in playhead.footprints() if f.start_frame > middle + 1]
    before_change = [f.max_depth_m for f in playhead.footprints() if f.end_frame < middle]
    stiff = {
        f.start_frame: f.max_depth_m
        for r in simulate([loads], SoftGround(FlatTerrain(), SNOW), CELL)
        for f in r.footprints
    }
    assert softer
    assert before_change
    whole = [depth for start, depth in stiff.items() if start > middle + 1]
    assert np.median(softer) == pytest.approx(3 * np.median(whole), rel=0.25)
    assert before_change == [depth for start, depth in stiff.items()][: len(before_change)]
    playhead.go_to(middle)
    assert state(playhead.ground) == before


def test_its_footprints_put_together_are_the_ground_that_it_shows(loads):
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    for frame in (35.0, 90.0, 50.0):
        playhead.go_to(frame)
        ground = recompose(playhead.footprints(), cell_size=CELL)
        for place, tile in playhead.ground.tiles.items():
            assert ground.tiles.get(place, np.zeros_like(tile)) == pytest.approx(tile, abs=2e-9)


def recorded(playhead):
    """What the record says of each contact, beside its cells."""
    return [
        (*f.position.tolist(), f.heading, f.area_m2, f.peak_force_n, f.compressed_m3, f.rim_m3, f.unplaced_rim_m3)
        for f in playhead.footprints()
    ]


def test_another_display_blur_changes_no_record_and_presses_nothing_anew(loads, monkeypatch):
    undisturbed = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    undisturbed.go_to(loads.motion.frames[-1])
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    for frame in loads.motion.frames[::3]:
        playhead.material = replace(SNOW, blur_sigma=0.001 * (1 + frame % 7))
        playhead.go_to(frame)
    playhead.go_to(loads.motion.frames[-1])
    assert recorded(playhead) == recorded(undisturbed)
    assert state(playhead.ground) == state(undisturbed.ground)
    playhead.go_to(20.0)
    playhead.material = replace(SNOW, blur_sigma=0.02)
    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "run", lambda *_: pytest.fail("pressed anew"))
        playhead.go_to(loads.motion.frames[-1])


@pytest.mark.parametrize("bodies", ["feet", "wheel"])
def test_what_is_laid_out_twice_is_counted_once(loads, bodies):
    """A stiffness that changes by a millionth back and forth has every step laid out anew, and the same record."""
    if bodies == "wheel":
        loads = rolling(30.0, seconds=0.7)
    frames = np.unique(np.floor(loads.motion.frames))
    playhead = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    for number, frame in enumerate(frames):
        playhead.material = replace(SNOW, youngs_modulus=SNOW.youngs_modulus * (1 + 1e-6 * (number % 2)))
        playhead.go_to(frame)
    steady = Playhead([loads], SoftGround(FlatTerrain(), SNOW), CELL)
    steady.go_to(frames[-1])
    assert len(recorded(steady)) >= 1
    for one, other in zip(recorded(playhead), recorded(steady), strict=True):
        assert one == pytest.approx(other, rel=1e-5, abs=1e-6)
