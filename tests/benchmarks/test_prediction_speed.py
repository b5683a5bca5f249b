"""What another material costs where a depth is predicted while a slider moves, printed and held to its limit."""

from time import thread_time

import numpy as np
import pytest

from softground_addon.core.composers.prediction import contact_loads, typical_depth
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from tests.core.walkers import walk

LIMITS = {50: 15e-3, 1000: 15e-3}
"""Most that a slice of a prediction may cost, by the number of contacts in the shot [s]."""
REPEATS = 8


@pytest.mark.benchmark
@pytest.mark.alone
@pytest.mark.parametrize("count", LIMITS)
def test_a_depth_is_predicted_while_a_slider_moves(count, capsys):
    contacts = contact_loads([walk(steps=count - 2, heading=0.3)], FlatTerrain(), 0.01)
    cost = {}
    for pressure in ("UNIFORM", "CENTRE_OF_PRESSURE"):
        times = []
        for number in range(REPEATS):
            material = GroundMaterial(0.25e6 * (1 + number / 10), 0.05, 0.2)
            slices = [thread_time()]
            for _ in typical_depth.slices(contacts, material, pressure):
                slices.append(thread_time())
            times.append(max(np.diff([*slices, thread_time()])))
        cost[pressure] = min(times)
    with capsys.disabled():
        print(f"\n{len(contacts.soles)} contacts: " + ", ".join(f"{k} {v * 1e3:.1f} ms" for k, v in cost.items()))
    assert max(cost.values()) < LIMITS[count]
