"""`make scenes`: builds every sample scene with its pictures, each in a process of its own, into build/scenes.

python -m sample_scenes.make_all [heroes] [options of the scenes]
"""

from __future__ import annotations

import subprocess
import sys
import time

SCENES = (
    "landscape",
    "force_arrows",
    "walk_forces",
    "craters",
    "four_grounds",
    "relief",
    "response_hill",
    "crossing",
    "four_legs",
    "bicycle",
    "stunts",
    "things",
)
"""Modules of this package that `production.run` knows how to run, in the order of the paper's figures."""

HEROES = (
    "snow_at_dusk",
    "path_after_rain",
    "tyre_and_boot",
    "dune_runner",
    "powder_runner",
    "bare_feet",
    "fox_in_powder",
    "before_after",
    "time_lapse",
)
"""Scenes out of doors, whose pictures take minutes."""


def main(arguments: list[str]) -> int:
    """Run all scenes, or all heroes, also those after one that failed; returns the number of failures."""
    results = {}
    heroes = arguments[:1] == ["heroes"]
    for name in HEROES if heroes else SCENES:
        print(f"--- {name}", flush=True)
        started = time.perf_counter()
        done = subprocess.run([sys.executable, "-m", f"sample_scenes.{name}", *arguments[heroes:]], check=False)
        results[name] = done.returncode, time.perf_counter() - started
    print(f"\n{'scene':<20}{'time':>8}")
    for name, (code, seconds) in results.items():
        print(f"{name:<20}{seconds:>6.0f} s  {'ok' if code == 0 else f'FAILED ({code})'}")
    return sum(code != 0 for code, _ in results.values())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
