"""What a bake takes follows the number of steps, and not the size of the ground: each bake in a process of its own."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.benchmark

ROOT = Path(__file__).parents[2]


def bake(tmp_path, *, steps, size, cell_size, radius=0.0, runs=1):
    """What a walk took; of several runs, the least time and memory."""
    results = []
    for _ in range(runs):
        command = [sys.executable, "-m", "tests.benchmarks.one_bake"]
        command += [str(value) for value in (steps, size, cell_size, radius, tmp_path / "walk.blend")]
        output = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, timeout=900).stdout
        results.append(json.loads(next(line for line in output.splitlines() if line.startswith("RESULT"))[6:]))
    best = results[0] | {key: min(result[key] for result in results) for key in ("seconds", "memory")}
    print(f"\n{steps} steps on {size:g} m at {cell_size * 1e3:g} mm: {best}")
    return best


def test_the_size_of_the_ground_changes_neither_time_nor_memory(tmp_path):
    small, large = (bake(tmp_path, steps=50, size=size, cell_size=0.005, radius=4.2, runs=4) for size in (10.0, 1000.0))
    assert small["steps"] == large["steps"] >= 45
    assert large["seconds"] == pytest.approx(small["seconds"], rel=0.10)
    assert large["memory"] == pytest.approx(small["memory"], rel=0.10)


def test_a_walk_of_a_thousand_steps_takes_twenty_times_what_fifty_take(tmp_path):
    few = bake(tmp_path, steps=50, size=2000.0, cell_size=0.01, runs=3)
    many = bake(tmp_path, steps=1000, size=2000.0, cell_size=0.01)
    more = many["steps"] - few["steps"]
    assert more > 900
    assert many["seconds"] / many["steps"] < 1.2 * few["seconds"] / few["steps"]
    assert (many["memory"] - few["memory"]) / more < 100e3
    assert many["record"] / many["steps"] < 40e3
    assert many["blend"] / many["steps"] < 150e3
