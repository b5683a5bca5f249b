"""The ground at any place and frame is the one that the record recomposes."""

import numpy as np
import pytest

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.record import ground_history
from softground_addon.core.record.footprints import recompose
from softground_addon.core.record.ground_history import GroundHistory
from tests.core.legs.test_grounding import walk

SAND = GroundMaterial(youngs_modulus=1e6, poisson_ratio=0.4, characteristic_time=0.1)


@pytest.fixture(scope="module")
def footprints():
    motion, _ = walk(60)
    loads = estimate_loads(motion, FlatTerrain(0.0), force_model="WHOLE_BODY", material=SAND)
    return [f for result in simulate([loads], SoftGround(FlatTerrain(0.0), SAND), 0.01) for f in result.footprints]


@pytest.mark.parametrize("frame", [0.0, 1.0, 7.0, 23.0, 60.0, 500.0])
def test_it_is_the_recomposed_ground_at_whole_frames(footprints, frame):
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.3, 2.5, 4000), rng.uniform(-0.3, 0.3, 4000)
    ground = recompose(footprints, frame)
    compression, rim = ground.sample(x, y)
    history = GroundHistory(FlatTerrain(0.7), footprints)
    assert history.heights(x, y, np.full(4000, frame)) == pytest.approx(0.7 + rim - compression, abs=1e-6)
    if frame >= 60:
        assert compression.max() > 0.005


def test_an_empty_record_is_the_undisturbed_ground():
    assert GroundHistory(FlatTerrain(0.3)).heights(np.zeros(3), np.zeros(3), np.arange(3.0)) == pytest.approx(0.3)


def test_every_place_may_be_asked_for_its_own_frame(footprints):
    history = GroundHistory(FlatTerrain(), footprints)
    place = footprints[0].position
    frames = np.array([[0.0, 30.0], [60.0, 500.0]])
    together = history.change(np.full((2, 2), place[0]), np.full((2, 2), place[1]), frames)
    single = [history.change(place[:1], place[1:2], np.array([frame]))[0] for frame in frames.ravel()]
    assert together.ravel() == pytest.approx(single)
    assert together[0, 0] == 0.0 > together[1, 1]


def test_how_many_footprints_are_kept_laid_out_changes_nothing(footprints, monkeypatch):
    rng = np.random.default_rng(2)
    x, y, frame = rng.uniform(-0.3, 2.5, 500), rng.uniform(-0.3, 0.3, 500), rng.uniform(0, 60, 500)
    of_all = GroundHistory(FlatTerrain(), footprints).change(x, y, frame)
    monkeypatch.setattr(ground_history, "PRINTS_REMEMBERED", 1)
    np.testing.assert_array_equal(GroundHistory(FlatTerrain(), footprints).change(x, y, frame), of_all)
