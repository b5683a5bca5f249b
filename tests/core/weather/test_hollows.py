"""Hollows of a surface, and water in them against the integral of their volume curve."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from softground_addon.core.weather.hollows import filled, hollows

CELL = 0.01


def bowl(depth=0.05, radius=0.12, rim=0.01, tilt=0.0):
    """A paraboloid with a raised brim, on a slope."""
    x, y = np.meshgrid(*(np.arange(-0.2, 0.2, CELL) + CELL / 2,) * 2)
    away = np.hypot(x, y)
    bowl = np.where(away < radius, (away / radius) ** 2 * (depth + rim) - depth, 0.0)
    return bowl + np.where((away >= radius) & (away < radius + 0.03), rim, 0.0) + tilt * x


def test_a_bowl_fills_to_its_brim():
    (hollow,) = hollows(bowl(), CELL**2)
    assert hollow.spill == pytest.approx(0.01)
    assert hollow.bottom == pytest.approx(-0.05, abs=2e-3)
    assert hollow.capacity == pytest.approx(np.pi * 0.12**2 * 0.06 / 2, rel=0.03)  # half its cylinder


def test_the_level_is_where_the_volume_curve_has_the_volume():
    (hollow,) = hollows(bowl(), CELL**2)
    for share in (0.02, 0.3, 0.77, 1.0):
        volume = share * hollow.capacity
        level = brentq(lambda z, wanted=volume: hollow.volume(z) - wanted, hollow.bottom, hollow.spill)
        assert hollow.level(volume) == pytest.approx(level, abs=1e-9)
        # and V(z) is the integral of the wet area below
        area = lambda z: np.count_nonzero(hollow.heights < z) * CELL**2  # noqa: E731
        below, _ = quad(area, hollow.bottom, level, limit=500)
        assert below == pytest.approx(volume, rel=0.01)


def test_a_slope_lets_it_out_at_the_low_side():
    (level,) = hollows(bowl(), CELL**2)
    (tilted,) = hollows(bowl(tilt=0.1), CELL**2)
    assert tilted.capacity < level.capacity
    assert tilted.spill < level.spill
    assert hollows(bowl(tilt=2.0), CELL**2) == []


def test_flat_ground_holds_nothing():
    assert hollows(np.zeros((8, 8)), CELL**2) == []
    assert (filled(np.zeros((8, 8))) == 0).all()


def test_two_bowls_are_two_hollows():
    both = np.concatenate([bowl(), bowl(depth=0.03)], axis=1)
    assert sorted(round(hollow.bottom, 2) for hollow in hollows(both, CELL**2)) == [-0.05, -0.03]
