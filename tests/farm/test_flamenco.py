"""The Flamenco job type: compiled under Node to the expected tasks, whose commands bake and render a shot."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
SCRIPT = HERE.parents[1] / "farm/flamenco/softground-bake-render.js"
NODE = shutil.which("node")

pytestmark = pytest.mark.skipif(NODE is None, reason="needs Node")

SETTINGS = {
    "blendfile": "/shows/a/010.blend",
    "frames": "1-25, 30",
    "render_output_root": "/renders",
    "format": "PNG",
}


def compile_job(**settings):
    done = subprocess.run(
        [NODE, HERE / "flamenco_manager.js", SCRIPT],
        input=json.dumps(settings), capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def command_line(task, blender="blender"):
    """The program that a Flamenco Worker runs for a task, as Flamenco documents it."""
    (command,) = task["commands"]
    assert command["name"] == "blender-render"
    given = command["parameters"]
    assert given["exe"] == "{blender}"
    assert given["exeArgs"] == "{blenderArgs}"
    return [str(blender), "-b", "-y", *given["argsBefore"], given["blendfile"], *given["args"]]


def test_each_render_depends_on_the_bake_of_its_shot():
    tasks = compile_job(**SETTINGS, further_shots="/shows/a/020.blend; /shows/b/010.blend;")["tasks"]
    assert [(task["name"], task["type"], task["dependencies"]) for task in tasks] == [
        (f"{kind}{shot}{chunk}", "blender", needs)
        for shot in ("010", "020", "010-2")
        for kind, chunk, needs in (
            ("bake-", "", []),
            ("render-", "-1-10", [f"bake-{shot}"]),
            ("render-", "-11-20", [f"bake-{shot}"]),
            ("render-", "-21-25,30", [f"bake-{shot}"]),
        )
    ]


def test_a_bake_saves_beside_its_shot_and_a_render_reads_that():
    bake, first, *_ = compile_job(**SETTINGS, preset="snow")["tasks"]
    assert command_line(bake) == [
        "blender", "-b", "-y", "/shows/a/010.blend", "--command", "softground", "bake",
        "--save=/shows/a/010-baked.blend", "--progress=plain", "--preset=snow",
    ]  # fmt: skip
    assert command_line(first) == [
        "blender", "-b", "-y", "/shows/a/010-baked.blend", "--render-output", "/renders/010/######",
        "--render-format", "PNG", "--render-frame", "1..10",
    ]  # fmt: skip


def test_without_renders_there_are_only_bakes():
    tasks = compile_job(**SETTINGS, further_shots="/b.blend", render=False)["tasks"]
    assert [task["name"] for task in tasks] == ["bake-010", "bake-b"]


def test_the_settings_are_those_that_flamenco_knows():
    for setting in compile_job(**SETTINGS)["settings"]:
        assert setting["type"] in ("string", "int32", "float", "bool")
        assert setting.get("subtype", "file_path") in ("file_path", "dir_path", "hashed_file_path")
        assert setting.get("visible", "visible") in ("visible", "hidden", "submission", "web")
        assert set(setting) <= {
            "key", "type", "subtype", "choices", "propargs", "description", "default", "eval", "evalInfo", "visible",
            "required", "editable",
        }  # fmt: skip


@pytest.mark.slow
def test_the_compiled_commands_bake_and_render(shot, blender):
    renders = shot.parent / "renders"
    settings = SETTINGS | {"blendfile": str(shot), "frames": "23-24", "render_output_root": str(renders)}
    for task in compile_job(**settings)["tasks"]:
        done = subprocess.run(command_line(task, blender), capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode == 0, done.stderr
    assert shot.with_name("shot-baked.blend").is_file()
    assert sorted(path.name for path in (renders / "shot").iterdir()) == ["000023.png", "000024.png"]
