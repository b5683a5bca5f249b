"""The demo as its users run it: a process of its own that exits cleanly and leaves a shot with four baked grounds."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sample_scenes.body import Body
from sample_scenes.gait import Gait, walk

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PRESETS = ("Snow", "Dry Sand", "Mud", "Soil")
PICTURES = ("overview", "snow", "dry_sand", "mud", "soil")
FRAMES, RATE = 84, 24


def run_demo(output, *options, timeout=600):
    pytest.importorskip("bpy", reason="the demo needs the bpy module: pip install bpy==4.5.15")
    command = [sys.executable, "-m", "sample_scenes.demo", "--output", str(output), *options]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=timeout, check=False)


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """Output folder and terminal text of a quick, coarse demo without pictures."""
    folder = tmp_path_factory.mktemp("demo")
    done = run_demo(folder, "--no-pictures", "--cell-size", "0.02")
    assert done.returncode == 0, done.stdout + done.stderr
    return folder, done.stdout


@pytest.fixture
def lanes(demo, scene):
    """Footprints of each ground of the saved shot, and where its walker stands."""
    import bpy

    from softground_addon.core.record import record

    bpy.ops.wm.open_mainfile(filepath=str(demo[0] / "demo.blend"))
    heights = {}
    for preset in PRESETS:
        ground = bpy.data.objects[f"{preset} Ground"]
        footprints = record.load(ground.data["softground_record"]).footprints
        walker = bpy.data.objects[footprints[0].character]
        heights[preset] = (footprints, np.array(walker.location))
    return heights


def footfalls():
    """Contacts of the walk that are seen for more than a moment."""
    end = (FRAMES - 1) / RATE
    return [
        fall
        for fall in walk(Body(), Gait(), FRAMES, RATE).footfalls
        if min(fall.leave, end) - max(fall.strike, 0) > 0.1
    ]


def test_the_table_has_a_line_for_each_ground_with_the_steps_of_the_walk(demo):
    for preset in PRESETS:
        line = re.search(rf"^{preset}\s+(\d+)\s+\d+ N\s+[\d.]+ cm", demo[1], re.MULTILINE)
        assert line, demo[1]
        assert int(line[1]) == len(footfalls())


def test_every_print_lies_where_the_walk_planted_a_foot(lanes):
    expected = sorted(footfalls(), key=lambda fall: fall.strike)
    for footprints, place in lanes.values():
        for step, fall in zip(footprints, expected, strict=True):
            ahead, aside = fall.place[:2]
            ankle = place[:2] + np.array((aside, -ahead))  # the walker's forward is -Y
            middle_of_sole = ankle - np.array((0.0, (Body().foot.back + Body().foot.front) / 2))
            assert step.position[:2] == pytest.approx(middle_of_sole, abs=0.08)  # it rolls from heel to toes
            assert step.sole.endswith(fall.side)


def test_softer_ground_takes_deeper_prints_and_snow_raises_hardly_any_rim(lanes):
    depth = {preset: max(step.max_depth_m for step in footprints) for preset, (footprints, _) in lanes.items()}
    assert depth["Snow"] > depth["Mud"] > depth["Dry Sand"] > depth["Soil"]
    assert 0.02 < depth["Dry Sand"] < 0.03
    raised = {
        preset: sum(step.rim_m3 for step in footprints) / sum(step.compressed_m3 for step in footprints)
        for preset, (footprints, _) in lanes.items()
    }
    assert raised["Snow"] == pytest.approx(0.1, rel=1e-3)  # what is thrown of it is told beside
    assert raised["Dry Sand"] == pytest.approx(1.0, rel=1e-3)


def test_each_ground_wears_the_material_of_its_preset(lanes):
    import bpy

    surfaces = [bpy.data.objects[f"{preset} Ground"].data.materials[0]["softground_surface"] for preset in lanes]
    assert surfaces == ["snow", "sand", "mud", "soil"]


def test_a_missing_motion_file_is_named_and_nothing_is_written(tmp_path):
    done = run_demo(tmp_path / "out", "--motion", str(tmp_path / "none.bvh"))
    assert done.returncode == 2
    assert "none.bvh" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_motion_file_without_feet_is_refused_in_words(tmp_path):
    stick = tmp_path / "stick.bvh"
    stick.write_text(
        "HIERARCHY\nROOT Stick\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
        "End Site\n{\nOFFSET 0 100 0\n}\n}\nMOTION\nFrames: 3\nFrame Time: 0.04\n0 0 0\n1 0 0\n2 0 0\n"
    )
    done = run_demo(tmp_path / "out", "--motion", str(stick))
    assert done.returncode == 2
    assert done.stderr.startswith("demo: ")
    assert "feet" in done.stderr.lower() or "foot" in done.stderr.lower()
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "scale"), [("gait/walk_subject01.bvh", "0.01"), ("bvh/zombie.bvh", "0.04"), ("bvh/jumping.bvh", "0.04")]
)
def test_any_motion_file_walks_on_the_four_grounds(tmp_path, file, scale):
    motion = ROOT.parent / "shared" / "data" / file
    if not motion.is_file():
        pytest.skip(f"the reference data is not here: {motion}")
    done = run_demo(tmp_path, "--motion", str(motion), "--scale", scale, "--no-pictures", "--cell-size", "0.02")
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "demo.blend").is_file()


@pytest.mark.slow
def test_the_pictures_show_four_different_grounds_with_a_print_in_each(tmp_path, scene):
    import bpy

    done = run_demo(tmp_path, "--samples", "2")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Fra:" not in done.stdout
    means = []
    for name in PICTURES:
        picture = bpy.data.images.load(str(tmp_path / f"{name}.png"))
        width, height = picture.size
        pixels = np.empty(width * height * 4, dtype=np.float32)
        picture.pixels.foreach_get(pixels)
        rgb = pixels.reshape(height, width, 4)[..., :3]
        corner = rgb[: height // 8, : width // 8].mean(axis=(0, 1))
        middle = rgb[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3]
        assert rgb.std() > 0.02
        if name != "overview":
            assert np.abs(middle - corner).max(axis=2).mean() > 0.03  # there is a print in the middle
            means.append(corner)
    assert min(np.abs(a - b).max() for i, a in enumerate(means) for b in means[:i]) > 0.005
