"""The notebooks of the library run as they stand, and show what they say."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from library import softground
from tests.validation.test_forces_of_gait import DATA

pytest.importorskip("matplotlib").use("Agg")

NOTEBOOKS = Path(__file__).parents[2] / "docs" / "notebooks"


def cells(name):
    notebook = json.loads((NOTEBOOKS / f"{name}.ipynb").read_text(encoding="utf-8"))
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]


@pytest.fixture
def run(monkeypatch):
    """Runs a notebook in its folder and gives its names; as if the library were installed."""
    monkeypatch.chdir(NOTEBOOKS)
    monkeypatch.syspath_prepend(Path(softground.__file__).parents[1])

    def running(name):
        names: dict[str, object] = {}
        for cell in cells(name):
            exec(compile(cell, name, "exec"), names)
        names["plt"].close("all")
        return names

    return running


@pytest.mark.skipif(not DATA.exists(), reason=f"needs the reference data in {DATA}")
def test_forces_of_a_walk_are_near_the_plates_in_twelve_lines(run):
    (cell,) = cells("forces_of_a_walk")
    assert len([line for line in cell.splitlines() if line]) <= 12
    names = run("forces_of_a_walk")
    assert np.sqrt(np.mean(np.square(names["errors"]))) < 0.04 * 75.2 * 9.81


@pytest.mark.slow
def test_a_boot_sinks_less_in_harder_snow_and_about_as_deep_as_boots_do(run):
    """The medians of docs/ground_law.md are for 33 kPa: this boot has about as much."""
    depths = run("a_boot_in_five_snows")["depths"]
    assert depths == sorted(depths, reverse=True)
    assert depths[0] == pytest.approx(0.5, abs=0.15)
    assert depths[-1] < 0.05
