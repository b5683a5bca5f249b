"""The README's moving picture: short, small, and put together from frames as they are."""

import re
from pathlib import Path

from PIL import Image

from sample_scenes.moving_picture import LARGEST, LAST_HOLD, PICTURE, SHOWN, animate

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
