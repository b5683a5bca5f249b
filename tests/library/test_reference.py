"""The reference of the library: it shows every public name, builds without a warning, and its examples hold."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from library import softground

API = Path(__file__).parents[2] / "docs" / "api"


def test_it_shows_every_public_name():
    shown = re.findall(r"auto\w+:: softground\.(\w+)", (API / "index.rst").read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(softground.__all__)


@pytest.mark.slow
@pytest.mark.parametrize("builder", ["html", "doctest"])
def test_it_builds_without_a_warning_and_its_examples_hold(builder, tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("pydata_sphinx_theme")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-b",
        builder,
        str(API),
        str(tmp_path / "built"),
    ]
    done = subprocess.run([*command, "-d", str(tmp_path / "trees")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    if builder == "doctest":
        assert re.search(r"\b[1-9]\d* tests", (tmp_path / "built" / "output.txt").read_text())
