"""The moving picture of SoftGround in use: of ten to fifteen seconds, small, with the pointer where it was."""

import json
from pathlib import Path

import pytest
from PIL import Image

from gallery.in_use import LARGEST, MIXED, flowing, window

ROOT = Path(__file__).parents[2]


def grey(path: Path, level: int) -> Path:
    Image.new("RGB", (40, 30), (level,) * 3).save(path)
    return path


def test_every_second_frame_of_what_was_played_is_shown_and_all_of_what_was_dragged(tmp_path):
    taken = [["played", 7, 5, 5], ["played", 8, 5, 5], ["dragged", 0, 20, 10], ["dragged", 1, 22, 10]]
    for part, moment, *_ in taken:
        grey(tmp_path / f"{part}_{moment:03d}.png", 100)
    (tmp_path / "facts.json").write_text(json.dumps({"pictures": taken}))
    shown = window(tmp_path)
    assert len(shown) == 3
    assert shown[1].getpixel((21, 14)) == (0, 0, 0)  # within the pointer
    assert shown[1].getpixel((35, 25)) == (100, 100, 100)


def test_moments_fade_into_each_other(tmp_path):
    mixed = flowing([grey(tmp_path / f"{level}.png", level) for level in (0, 100, 200)], (80, 60))
    assert {picture.size for picture in mixed} == {(80, 60)}
    levels = [picture.getpixel((0, 0))[0] for picture in mixed]
    assert len(levels) == 2 * MIXED + 1
    assert levels == pytest.approx([100 * part / MIXED for part in range(2 * MIXED + 1)], abs=1)


def test_the_gallery_shows_it_small_and_for_ten_to_fifteen_seconds():
    path = ROOT / "docs" / "images" / "in_use.webp"
    assert path.stat().st_size < LARGEST
    lasts = 0
    with Image.open(path) as moving:
        for number in range(moving.n_frames):
            moving.seek(number)
            moving.load()
            lasts += moving.info["duration"]
    assert 10_000 <= lasts <= 15_000
