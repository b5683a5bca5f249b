"""What the simulation of a walk costs per scene frame, printed for the log and held to its limit."""

from time import thread_time

import pytest

from softground_addon.core.ground.display_blur import blurred
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.record.footprints import recompose
from tests.core.walkers import memory_of, pressed, walk

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
LIMIT = 0.6e-3
"""Most that a frame of a two-footed walk may cost at 1 cm cells and 30 fps [s]."""
REPEATS = 8


def best_time(function, *arguments):
    """The shortest of several calls [s of this thread]: what others do on the machine only ever adds."""
    times = []
    for _ in range(REPEATS):
        start = thread_time()
        function(*arguments)
        times.append(thread_time() - start)
    return min(times)


def frames_of(loads):
    return round(loads.motion.frames[-1] - loads.motion.frames[0])


@pytest.mark.benchmark
@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_a_two_footed_walk_at_one_centimetre_is_simulated_in_time(heading, capsys):
    loads = walk(steps=20, heading=heading)
    cost = best_time(pressed, loads, SNOW) / frames_of(loads)
    with capsys.disabled():
        print(f"\nsimulate, two feet, 1 cm cells, 30 fps, heading {heading}: {cost * 1e3:.2f} ms per frame")
    assert cost < LIMIT


@pytest.mark.benchmark
def test_the_cost_of_a_frame_follows_the_cell_size_the_frame_rate_and_not_the_length(capsys):
    lines = []
    for cell in (0.02, 0.01, 0.005):
        loads = walk(steps=10, heading=0.3)
        lines.append(
            f"{cell * 100:.1f} cm cells: {best_time(pressed, loads, SNOW, cell) / frames_of(loads) * 1e3:.2f} ms"
        )
    for rate in (24.0, 60.0, 120.0):
        loads = walk(steps=10, heading=0.3, frame_rate=rate)
        lines.append(f"{rate:.0f} fps: {best_time(pressed, loads, SNOW) / frames_of(loads) * 1e3:.2f} ms")
    cost = {}
    for steps in (20, 100):
        loads = walk(steps=steps, heading=0.3)
        cost[steps] = best_time(pressed, loads, SNOW) / steps
        lines.append(f"{steps} steps: {cost[steps] * 1e3:.1f} ms per step")
    ground, footprints = pressed(loads, SNOW)
    lines.append(f"recompose {len(footprints)} footprints: {best_time(recompose, footprints) * 1e3:.1f} ms")
    lines.append(f"blur their ground: {best_time(blurred, ground, 0.01) * 1e3:.1f} ms")
    lines.append(f"memory: {memory_of(ground) / len(footprints) / 1024:.0f} KB of cells per step")
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert cost[100] < 1.3 * cost[20]
