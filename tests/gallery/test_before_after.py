"""The wipe between two pictures shows the first to its right, the second to its left, and goes there and back."""

import numpy as np
from PIL import Image

from gallery import before_after

EDGE = 8
"""Pixels on either side of the line whose colours a compressed picture mixes."""


def test_a_line_goes_over_both_pictures_and_back(tmp_path):
    before, after = tmp_path / "before.png", tmp_path / "after.png"
    for path, colour in ((before, (200, 0, 0)), (after, (0, 0, 200))):
        Image.new("RGB", (320, 180), colour).save(path)
    shares = []
    with Image.open(before_after.wipe(before, after, tmp_path / "wipe.webp")) as moving:
        assert moving.n_frames == before_after.MOMENTS
        for moment in range(moving.n_frames):
            moving.seek(moment)
            row = np.asarray(moving.convert("RGB"), float)[60]
            is_after = row[:, 2] > row[:, 0]
            shares.append(is_after.mean())
            line = round(shares[-1] * len(row))
            assert is_after[: max(line - EDGE, 0)].all()
            assert not is_after[line + EDGE :].any()
    half = before_after.MOMENTS // 2
    assert shares[0] == 0.0
    assert shares[half] == 1.0
    assert (np.diff(shares[: half + 1]) >= 0).all()
    assert (np.diff(shares[half:]) <= 0).all()
