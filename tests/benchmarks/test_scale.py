"""What a bake takes follows the number of steps, and not the size of the ground: each bake in a process of its own."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.benchmarks.bars import below

pytestmark = pytest.mark.benchmark

ROOT = Path(__file__).parents[2]


ON_NEW_GROUND, IN_CIRCLES = 0.0, 4.2


def bake(*, steps, size, cell_size, radius):
    """What a walk took."""
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "tests.benchmarks.one_bake"]
        command += [str(value) for value in (steps, size, cell_size, radius, Path(folder) / "walk.blend")]
        output = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, timeout=900).stdout
    return json.loads(next(line for line in output.splitlines() if line.startswith("RESULT"))[6:])


def best(results):
    """One of several runs of a bake, with the least time and memory of all."""
    return results[0] | {key: min(result[key] for result in results) for key in ("seconds", "memory")}


@cache
def on_small_and_large_ground():
    """The same walk on 10 m and on 1 km, in turns."""
    rounds = [
        [bake(steps=50, size=size, cell_size=0.01, radius=IN_CIRCLES) for size in (10.0, 1000.0)] for _ in range(2)
    ]
    return tuple(best(results) for results in zip(*rounds, strict=True))


@cache
def few_steps(radius=ON_NEW_GROUND):
    return best([bake(steps=50, size=2000.0, cell_size=0.01, radius=radius) for _ in range(2)])


@cache
def many_steps(radius=ON_NEW_GROUND):
    return bake(steps=1000, size=2000.0, cell_size=0.01, radius=radius)


def memory_per_step(radius):
    """By how much the largest memory of a bake grows with each further step [bytes]."""
    few, large = few_steps(radius), many_steps(radius)
    return (large["memory"] - few["memory"]) / (large["steps"] - few["steps"])


def test_the_size_of_the_ground_does_not_change_the_time_of_a_bake():
    small, large = on_small_and_large_ground()
    assert small["steps"] == large["steps"] >= 45
    below("difference of time on 1 km from that on 10 m", 100 * abs(large["seconds"] / small["seconds"] - 1), 10, "%")


def test_the_size_of_the_ground_does_not_change_the_memory_of_a_bake():
    small, large = on_small_and_large_ground()
    below("difference of memory on 1 km from that on 10 m", 100 * abs(large["memory"] / small["memory"] - 1), 10, "%")


def test_each_of_a_thousand_steps_takes_the_time_of_one_of_fifty():
    few, many = few_steps(), many_steps()
    assert many["steps"] > 950
    per_step, of_few = many["seconds"] / many["steps"], few["seconds"] / few["steps"]
    below("time of a step of a thousand over one of fifty", per_step / of_few, 1.2)


def test_the_record_and_the_file_grow_by_little_with_each_step():
    many = many_steps()
    below("record for each of a thousand steps", many["record"] / many["steps"] / 1e3, 40, "KB")
    below("file for each of a thousand steps", many["blend"] / many["steps"] / 1e3, 150, "KB")


def test_memory_grows_by_little_with_each_step_on_new_ground():
    below("memory for each step on new ground", memory_per_step(ON_NEW_GROUND) / 1e6, 0.5, "MB")


def test_memory_grows_by_little_with_each_step_on_trodden_ground():
    below("memory for each step on trodden ground", memory_per_step(IN_CIRCLES) / 1e6, 0.2, "MB")
