"""The OpenJD job template: accepted by OpenJD's own tool, which runs it to baked and rendered shots."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from farm import job_bundle

OPENJD = Path(sys.executable).with_name("openjd")


@pytest.fixture
def night(tmp_path):
    """A manifest of three shots of which the first names its frames."""
    for name in ("010", "020", "it's"):
        (tmp_path / f"{name}.blend").touch()
    path = tmp_path / "night.toml"
    path.write_text(
        'defaults.save = "baked/{name}.blend"\ndefaults.preset = "bog.json"\n'
        '[[shots]]\nfile = "010.blend"\nframes = [1, 24]\n'
        '[[shots]]\nfile = "020.blend"\n[[shots]]\nfile = "it\'s.blend"'
    )
    return path


def bundle(path, *options):
    folder = path.parent / "bundle"
    code = job_bundle.main([str(path), str(folder), *options])
    template = folder / "template.json"
    return code, json.loads(template.read_text()) if template.exists() else None


def openjd(*arguments):
    return subprocess.run(
        [OPENJD, *map(str, arguments)], capture_output=True, text=True, timeout=600, check=False
    )  # fmt: skip


def values(step):
    return {item["name"]: item["range"] for item in step["parameterSpace"]["taskParameterDefinitions"]}


def test_one_task_bakes_a_shot_and_its_renders_depend_on_the_bake(night):
    code, job = bundle(night, "--frames", "1-5", "--chunk", "10")
    assert code == 0
    bake, render = job["steps"]
    assert values(bake) == {"Shot": ["010", "020", "it's"]}
    assert render["dependencies"] == [{"dependsOn": "Bake"}]
    baked = [str(night.parent / "baked" / f"{name}.blend") for name in ("010", "010", "010", "020", "it's")]
    assert values(render) == {
        "Shot": ["010", "010", "010", "020", "it's"],
        "Baked": baked,
        "First": [1, 11, 21, 1, 1],
        "Last": [10, 20, 24, 5, 5],
    }
    references = json.loads((night.parent / "bundle" / "asset_references.json").read_text())["assetReferences"]
    assert references["inputs"]["filenames"] == sorted(
        str(night.parent / name) for name in ("010.blend", "020.blend", "it's.blend", "bog.json")
    )
    assert references["outputs"]["directories"] == [str(night.parent / name) for name in ("baked", "night.batch")]


@pytest.mark.slow
def test_openjd_accepts_the_template(night):
    for options in (("--frames", "1-5"), ("--chunk", "0")):
        bundle(night, *options)
        checked = openjd("check", night.parent / "bundle" / "template.json")
        assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), "'020' names no frames.*--frames A-B"),
        (("--frames", "1-100000"), "more than 1024.*larger --chunk"),
    ],
)
def test_what_cannot_be_rendered_is_named(night, capsys, options, says):
    import re

    assert bundle(night, *options) == (2, None)
    assert re.search(says, capsys.readouterr().err)


@pytest.mark.slow
def test_openjd_runs_the_job_to_baked_and_rendered_shots(shot, blender):
    night = shot.parent / "night.toml"
    night.write_text('[[shots]]\nfile = "shot.blend"\nsave = "baked/{name}.blend"\nframes = [1, 24]')
    bundle(night, "--chunk", "24")
    values = json.loads((night.parent / "bundle" / "parameter_values.json").read_text())["parameterValues"]
    assert [value["name"] for value in values] == ["Manifest", "RenderFolder"]
    given = {value["name"]: value["value"] for value in values} | {"Blender": str(blender)}
    run = ("run", night.parent / "bundle" / "template.json", "--job-param", json.dumps(given))
    ran = openjd(*run, "--step", "Render", "--run-dependencies")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    pictures = sorted(path.name for path in (night.parent / "night.render" / "shot").iterdir())
    assert pictures == [f"{frame:04}.png" for frame in range(1, 25)]
    assert (night.parent / "baked" / "shot.blend").is_file()
    assert "1 done" in ran.stdout
    again = openjd(*run, "--step", "Bake")
    assert again.returncode == 0
    assert "1 skipped" in again.stdout
    night.write_text('[[shots]]\nfile = "shot.blend"\nsave = "baked/{name}.blend"\npreset = "lava"')
    refused = openjd(*run, "--step", "Bake")
    assert refused.returncode != 0
    assert "no preset 'lava'" in refused.stdout
