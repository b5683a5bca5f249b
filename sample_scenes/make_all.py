"""`make scenes`: builds every sample scene with its pictures, each in a process of its own, into build/scenes.

python -m sample_scenes.make_all [options of the scenes]
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Sequence

SCENES = (
    "landscape",
    "force_arrows",
    "walk_forces",
    "craters",
    "four_grounds",
    "response_hill",
    "crossing",
    "four_legs",
    "bicycle",
    "stunts",
    "things",
)
"""Modules of this package that `production.run` knows how to run, in the order of the paper's figures."""


def build_all(package: str, names: Sequence[str], arguments: Sequence[str]) -> int:
    """Run scenes of a package, also those after one that failed; returns the number of failures."""
    results = {}
    for name in names:
        print(f"--- {name}", flush=True)
        started = time.perf_counter()
        done = subprocess.run([sys.executable, "-m", f"{package}.{name}", *arguments], check=False)
        results[name] = done.returncode, time.perf_counter() - started
    print(f"\n{'scene':<20}{'time':>8}")
    for name, (code, seconds) in results.items():
        print(f"{name:<20}{seconds:>6.0f} s  {'ok' if code == 0 else f'FAILED ({code})'}")
    return sum(code != 0 for code, _ in results.values())


if __name__ == "__main__":
    sys.exit(build_all("sample_scenes", SCENES, sys.argv[1:]))
