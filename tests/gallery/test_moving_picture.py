"""The README's moving picture: short, small, and put together from frames as they are."""

import re
from pathlib import Path

import bpy
import pytest
from PIL import Image

from gallery import through_meadow
from gallery.moving_picture import LARGEST, LAST_HOLD, PICTURE, SHOWN, animate, build
from sample_scenes import production
from softground_addon.blender import settings

ROOT = Path(__file__).parents[2]


def test_frames_follow_each_other_and_the_last_one_stays(tmp_path):
    frames = [tmp_path / f"{level}.png" for level in (0, 120, 240)]
    for frame in frames:
        Image.new("RGB", (16, 9), (int(frame.stem),) * 3).save(frame)
    with Image.open(animate(frames, 83, tmp_path / "moving.webp")) as moving:
        durations, levels = [], []
        for number in range(moving.n_frames):
            moving.seek(number)
            moving.load()
            durations.append(moving.info["duration"])
            levels.append(moving.convert("L").getpixel((8, 4)))
    assert durations == [83, 83, LAST_HOLD]
    assert all(abs(level - int(frame.stem)) < 8 for level, frame in zip(levels, frames, strict=True))


def test_the_readme_begins_with_a_short_small_moving_picture():
    first = re.search(r"!\[.+\]\((.+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))[1]
    assert (ROOT / first).stat().st_size < LARGEST
    with Image.open(ROOT / first) as moving:
        assert (moving.size, moving.n_frames) == (PICTURE, len(SHOWN))
    assert 3.0 <= (len(SHOWN) - 1) / 12 + LAST_HOLD / 1000 <= 5.0


def test_the_moving_picture_of_the_meadow_is_whole_and_small():
    path = ROOT / "docs" / "images" / "through_meadow.webp"
    with Image.open(path) as moving:
        assert (moving.size, moving.n_frames) == (through_meadow.PICTURE, len(through_meadow.SHOWN))
    assert path.stat().st_size <= through_meadow.LARGEST


class BakeAskedError(Exception):
    """What a bake would have been done with."""


@pytest.mark.slow
def test_two_clicks_bake_the_ground_of_the_readme_s_picture(addon, scene, monkeypatch):
    def ask(scene, write):
        raise BakeAskedError(settings.snapshot(scene).inputs())

    bpy.ops.softground.add_sample_scene()
    bpy.ops.softground.add_character()
    clicked = settings.snapshot(scene).inputs()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    monkeypatch.setattr(production.bake_job, "bake", ask)
    with pytest.raises(BakeAskedError) as asked:
        build(bpy.context.scene)
    (shown,) = asked.value.args
    assert shown["cell_size_m"] == pytest.approx(clicked["cell_size_m"], rel=0.1)  # it fits the soles of each
    of_the_shot = {"file", "camera", "scene", "ground", "characters", "frames", "cell_size_m"}
    differ = {key for key in shown if shown[key] != clicked[key]} - of_the_shot
    assert differ == {"relief", "relief_vertices", "shape_keys"}  # how fine the picture is; the ground is the same
