"""A new look is one record, one shader function and one preset."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from softground_addon.blender.materials import surface_shaders
from softground_addon.core.ground import presets
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.relief import amounts
from tests.blender.new_look_worker import RECORD

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_a_look_added_by_one_record_is_baked_thrown_heard_weathered_and_exported(tmp_path):
    command = [sys.executable, "-m", "tests.blender.new_look_worker", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    facts = json.loads((tmp_path / "found.json").read_text())
    assert (facts["label"], facts["material"]) == ("Volcanic Ash", "SoftGround Volcanic Ash")
    assert facts["pieces"] == [pytest.approx([*RECORD.colour, 1.0])]
    assert facts["debris"] > 100
    thrown = sum(row["thrown_kg"] for row in facts["events"])
    assert thrown == pytest.approx(facts["thrown_m3"] * RECORD.density, rel=1e-3)
    assert "SoftGround Weather" in facts["modifiers"]
    notes = {note for note in range(128) if bytes((0x90, note)) in (tmp_path / "steps.mid").read_bytes()}
    assert notes == {RECORD.midi_note, RECORD.midi_note + 1}
    assert max((tmp_path / "steps.wav").read_bytes()[44:]) > 0
    assert (tmp_path / "steps.obj").stat().st_size > 10_000


@pytest.mark.parametrize("surface", SURFACES.values(), ids=list(SURFACES))
def test_what_a_record_names_is_there(surface):
    assert callable(getattr(surface_shaders, surface.shader))
    assert amounts.of_look(surface.name).surface == surface.name
    assert any(presets.load(path).surface == surface.name for path in presets.FOLDER.glob("*.json"))
