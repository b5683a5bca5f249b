"""Presets: JSON in, validated materials out, and nothing else."""

import dataclasses
import json
import os
import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.core.errors import InputError
from softground_addon.core.ground import presets
from softground_addon.core.ground.field_tests import boot_depth
from softground_addon.core.ground.material import GroundMaterial

SHIPPED = sorted(presets.FOLDER.glob("*.json"))

PAPER_RANGES = {
    "snow": ((0.25e6, 0.5e6), 0.2, 0.05, 0.005),
    "dry_sand": ((1.5e6, 3e6), 0.05, 0.5, 0.01),
    "mud": ((0.5e6, 0.75e6), 0.15, 0.35, 0.01),
    "soil": ((1e6, 1.5e6), 0.05, 0.35, 0.005),
}


def test_the_presets_are_listed_by_section_and_softness():
    shown = [presets.load(path) for path in SHIPPED]
    sections = {
        section: [each.name for each in presets.soft_to_firm(each for each in shown if each.section == section)]
        for section in presets.SECTIONS
    }
    assert sum(map(len, sections.values())) == len(SHIPPED) == 34
    assert sections["EVERYDAY"][:3] == ["Powder", "Crust over Powder", "Fresh Fallen Snow"]
    assert sections["PAPER"] == ["Paper Snow", "Paper Mud", "Paper Soil", "Paper Dry Sand"]
    assert sections["MEASURED"][0] == "Fresh Snow (field)"


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_preset_of_the_measured_law_says_what_is_measured_and_what_is_placed(path):
    preset = presets.load(path)
    if not preset.material.linear:
        assert re.match("(Measured|Placed)", preset.source)


def test_presets_that_shots_refer_to_by_name_hold_what_they_held():
    assert presets.find("Snow").material == GroundMaterial(375e3, 0.05, 0.2)
    assert presets.find("Fresh Snow").material == GroundMaterial(74e3, 0.05, 0.2, layer_depth=0.6)
    assert presets.find("wet_sand").material == GroundMaterial(3.75e6, 0.5, 0.05, rim_bias=0.4)


@pytest.mark.parametrize(
    ("name", "boot"),
    [("powder", 50), ("settled_snow", 30), ("wet_snow", 20), ("wind_packed_snow", 15), ("piste", 2.8), ("dune", 3.0)],
)
def test_a_boot_sinks_as_deep_in_a_preset_as_its_source_says(name, boot):
    assert boot_depth(presets.find(name).material) * 100 == pytest.approx(boot, rel=0.02)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_preset_is_valid_names_its_source_and_survives_a_round_trip(path):
    preset = presets.load(path)
    assert preset.source
    assert presets.parse(presets.dump(preset), "copy") == preset
    assert presets.find(path.stem) == preset


@pytest.mark.parametrize("name", PAPER_RANGES)
def test_the_papers_presets_hold_the_middle_of_its_table(name):
    (low, high), tau, nu, blur = PAPER_RANGES[name]
    preset = presets.find(f"paper_{name}")
    assert (preset.pressure, preset.tread) == ("UNIFORM", 0.0)
    assert preset.material == GroundMaterial(
        (low + high) / 2, nu, tau, layer_depth=0.3, rim_reach=0.04, blur_sigma=blur
    )


def test_what_goes_beyond_the_paper_is_off_where_a_preset_does_not_say_so():
    text = (presets.FOLDER / "paper_mud.json").read_text(encoding="utf-8")
    beyond = ("rim_bias", "repose_angle", "shortest_time", "hardening", "crust_stress", "firm_depth")
    assert not any(name in text for name in beyond)
    assert not any(getattr(presets.parse(text, "mud").material, name) for name in beyond)
    changed = text.replace('"blur_sigma"', '"repose_angle": 0.6, "hardening": 10, "blur_sigma"')
    assert presets.parse(changed, "mud").material.hardening == 10.0
    with pytest.raises(InputError, match=r"'repose_angle' is 32.* 0 to 1\.4"):
        presets.parse(text.replace('"blur_sigma"', '"repose_angle": 32, "blur_sigma"'), "mud")


def test_every_field_of_a_material_has_a_range():
    assert set(presets.MATERIAL_RANGES) == {field.name for field in fields(GroundMaterial)}


def test_wet_sand_is_as_stiff_under_a_plate_as_it_was_measured():
    material = presets.find("wet_sand").material
    assert 10e6 <= material.youngs_modulus / material.layer_depth <= 15e6


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_preset_carries_the_whole_ground(path):
    preset = presets.load(path)
    assert preset.pressure is not None
    assert preset.tread is not None
    assert preset.cells_along_sole is not None
    assert preset.debris == (not path.stem.startswith("paper"))


def test_a_preset_of_version_0_1_says_nothing_of_what_it_did_not_know():
    content = json.loads((presets.FOLDER / "snow.json").read_text(encoding="utf-8"))
    old = {key: content[key] for key in ("schema_version", "name", "source", "surface", "material")}
    preset = presets.parse(json.dumps(old), "mine.json")
    assert (preset.pressure, preset.tread, preset.cells_along_sole, preset.debris) == (None, None, None, None)
    assert json.loads(presets.dump(preset)) == json.loads(json.dumps(old)) | {
        "material": dataclasses.asdict(preset.material)
    }


@pytest.mark.parametrize("name", ["dry_sand", "loose_dry_sand"])
def test_dry_sand_keeps_slopes_of_32_degrees(name):
    assert presets.find(name).material.repose_angle == pytest.approx(np.radians(32.0), abs=1e-4)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_no_preset_lets_a_standing_person_through_the_layer(path):
    material = presets.load(path).material
    assert 77.5 * 9.81 / 0.02 / material.youngs_modulus < 1


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"schema_version": 99}, "schema_version 1"),
        ({"name": ""}, "no 'name'"),
        ({"surface": "lava"}, "snow, sand, wet_sand, mud, soil"),
        ({"material": None}, "no 'material'"),
        ({"material": {"youngs_modulus": -1}}, "'youngs_modulus' is -1"),
        ({"material": {"youngs_modulus": "stiff"}}, "'youngs_modulus' is 'stiff'"),
        ({"material": {"poisson_ratio": 0.6}}, "from 0 to 0.5"),
        ({"material": {"poisson_ratio": float("nan")}}, "from 0 to 0.5"),
        ({"pressure": "HEAVY"}, "'pressure' is 'HEAVY'; it must be one of UNIFORM, CENTRE_OF_PRESSURE"),
        ({"tread": -0.1}, "'tread' is -0.1"),
        ({"cells_along_sole": "many"}, "'cells_along_sole' is 'many'"),
        ({"debris": 1}, "'debris' is 1; it must be true or false"),
        ({"material": {"density": 1}}, "unknown field 'density'"),
        ({"material": {"poisson_ratio": 0.1}}, "lacks characteristic_time, youngs_modulus"),
    ],
)
def test_a_broken_preset_is_refused_with_what_is_wrong(change, says):
    content = json.loads(SHIPPED[0].read_text(encoding="utf-8")) | change
    with pytest.raises(InputError, match=says) as error:
        presets.parse(json.dumps(content), "mine.json")
    assert "mine.json" in str(error.value)


@given(
    st.text()
    | st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    ).map(json.dumps)
)
def test_no_text_makes_anything_but_a_preset_or_a_clear_error(text):
    with pytest.raises(InputError, match="fuzz"):
        presets.parse(text, "fuzz")


@pytest.mark.parametrize("name", ["Fresh Snow (field)", "fresh_snow", "FRESH-SNOW", " fresh snow field "])
def test_a_preset_is_found_by_its_file_and_by_the_name_that_users_see(name):
    assert presets.find(name).name == "Fresh Snow (field)"


def test_a_name_is_found_beside_a_broken_file(tmp_path):
    (tmp_path / "a.json").write_text("{")
    (tmp_path / "b.json").write_text(presets.dump(dataclasses.replace(presets.find("mud"), name="Bog")))
    assert presets.find("bog", (tmp_path,)).surface == "mud"


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(InputError, match=r"dry_sand.*snow"):
        presets.find("lava")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone\.json"):
        presets.load(tmp_path / "gone.json")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes and devices")
@pytest.mark.timeout(20)
def test_a_preset_that_never_ends_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "huge.json").touch()
    os.truncate(tmp_path / "huge.json", 2**40)
    for path in (tmp_path / "pipe.json", tmp_path / "huge.json", Path("/dev/zero")):
        with pytest.raises(InputError, match=r"cannot be read.*not a regular file"):
            presets.load(path)
