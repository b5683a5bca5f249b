"""Fissures run out from the outline, across the ring that is stretched along it."""

import numpy as np

from softground_addon.core.relief.layers import Around, Fissures

RADIUS = 0.08


def test_fissures_run_straight_out_of_a_round_print_as_deep_as_asked_and_no_further_than_their_reach():
    angle, out = np.meshgrid(np.linspace(0, 2 * np.pi, 2000), np.linspace(-0.02, 0.06, 81), indexing="ij")
    x, y = ((RADIUS + out) * part(angle) for part in (np.cos, np.sin))
    rim = [RADIUS * part(angle) for part in (np.cos, np.sin)]
    flat = [each.ravel() for each in (x, y, *rim, -out, (out < 0).astype(float))]
    seen = (Fissures(30.0, 38.0, 1.6, 8.0, patches=1e4).heights(Around(seed, *flat, 0.0005, 1.0)) for seed in range(99))
    heights = next(each for each in seen if each.min() < -0.004).reshape(angle.shape)  # it is in one patch, or in none
    assert heights.max() <= 0
    assert not heights[out < 0].any()
    assert not heights[out > 0.038].any()
    near, further = heights[:, 25], heights[:, 34]  # 5 and 14 mm out
    assert -0.0081 < near.min() < -0.006
    is_open = near < -0.003
    count = (np.diff(is_open.astype(int)) == 1).sum()
    assert 5 <= count <= 40
    beside = np.convolve(is_open, np.ones(25), "same") > 0  # fissures meander by some millimetres
    assert beside.mean() < 0.6
    assert beside[further < -0.003].mean() > 0.9
