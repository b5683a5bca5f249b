"""What another material costs where a depth is predicted while a slider moves, printed and held to its limit."""

from time import thread_time

import numpy as np
import pytest

from softground_addon.core.composers.prediction import matching_modulus, pressed_contacts, typical_depth
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from tests.benchmarks.bars import below
from tests.core.walkers import walk

SLICE = 25e-3
"""Most that a slice of a prediction may cost [s]: a frame in which the panel stays alive."""
VALUES = {10: 0.12, 200: 0.12}
"""Most that a value may cost [s], by the number of contacts: of many, a sample is pressed."""
TYPED = 0.15
"""Most that a typed depth may cost [s]."""
SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
REPEATS = 5


def slices_of(work):
    """Duration of each slice of a computation [s]."""
    times = [thread_time()]
    for _ in work:
        times.append(thread_time())
    return np.diff([*times, thread_time()])


@pytest.mark.benchmark
@pytest.mark.alone
@pytest.mark.parametrize("count", VALUES)
@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
def test_a_depth_is_predicted_while_a_slider_moves(count, pressure):
    loads = [walk(steps=count - 2, heading=0.3)]
    ground = SoftGround(FlatTerrain(), SNOW, pressure)
    contacts = pressed_contacts(loads, ground, 0.005)
    typed = np.sum(slices_of(matching_modulus.slices(contacts, SNOW, 0.6 * contacts.typical, pressure)))
    materials = [GroundMaterial(0.25e6 * (1 + number / 10), 0.05, 0.2) for number in range(REPEATS)]
    values = [slices_of(typical_depth.slices(contacts, material, pressure)) for material in materials]
    value, slowest = (min(measure(value) for value in values) for measure in (np.sum, np.max))
    of = f"of {count} contacts, {pressure.replace('_', ' ').lower()}"
    below(f"a predicted depth {of}", 1e3 * value, 1e3 * VALUES[count], "ms")
    below(f"a typed depth {of}", 1e3 * typed, 1e3 * TYPED, "ms")
    below(f"longest slice {of}", 1e3 * slowest, 1e3 * SLICE, "ms")
