"""The command that holds the ground law against measured sinkage."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.validation import validate_ground

MEASURED = Path("../shared/data/ground")


def run(monkeypatch, directory, output):
    monkeypatch.setattr(sys, "argv", ["validate_ground", str(directory), "--output", str(output)])
    code = validate_ground.main()
    return code, json.loads((output / "ground_validation.json").read_text(encoding="utf-8"))


@pytest.mark.slow
@pytest.mark.skipif(not MEASURED.is_dir(), reason=f"{MEASURED} with the measured sinkage is not here")
def test_boots_skis_plates_wheels_and_the_moon_are_within_their_limits(tmp_path):
    command = [sys.executable, "-m", "tests.validation.validate_ground", str(MEASURED), "--output", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # it registers the add-on
    assert done.returncode == 0, done.stdout + done.stderr
    rows = json.loads((tmp_path / "ground_validation.json").read_text(encoding="utf-8"))
    assert len(rows) > 50
    assert (tmp_path / "ground_validation.svg").stat().st_size > 10_000


def test_a_plate_that_sinks_otherwise_than_measured_is_outside():
    law = {"name": "plate law", "kind": "parameters", "state": "clay", "kc": 13.2, "kphi": 692, "exponent": 0.5}
    plate = {"name": "plate", "kind": "plate", "state": "clay", "pressure_kpa": 40, "width_cm": 9}
    right, *_ = validate_ground.of_plates([law, plate | {"depth_median_cm": 0.227}])
    wrong, *_ = validate_ground.of_plates([law, plate | {"depth_median_cm": 0.25}])
    assert (right.right, wrong.right) == (True, False)


def test_a_folder_without_facts_is_refused(monkeypatch, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        run(monkeypatch, tmp_path, tmp_path)
    assert stopped.value.code == 2
    assert "facts.json" in capsys.readouterr().err
