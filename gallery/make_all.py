"""`make heroes`: builds every scene out of doors with its pictures, each in a process of its own, into build/scenes.

python -m gallery.make_all [options of the scenes]
"""

from __future__ import annotations

import sys

from sample_scenes.make_all import build_all

HEROES = (
    "snow_at_dusk",
    "meadow",
    "through_meadow",
    "autumn_leaves",
    "scatters",
    "path_after_rain",
    "tyre_and_boot",
    "dune_runner",
    "powder_runner",
    "bare_feet",
    "fox_in_powder",
    "wading",
    "fox_in_deep_snow",
    "wind_crust",
    "before_after",
    "time_lapse",
)
"""Modules of this package that `production.run` knows how to run; their pictures take minutes."""

if __name__ == "__main__":
    sys.exit(build_all("gallery", HEROES, sys.argv[1:]))
