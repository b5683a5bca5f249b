"""Where the pixels of a UV map lie in the world."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from softground_addon.core.meshing.uv_raster import rasterise


@settings(max_examples=30)
@given(st.integers(0, 2**16), st.integers(3, 90), st.integers(3, 70))
def test_every_pixel_is_where_the_map_puts_it(seed, width, height):
    rng = np.random.default_rng(seed)
    uv = np.concatenate([rng.random((30, 2)), [[0, 0], [1, 0], [1, 1], [0, 1]]])
    triangles = Delaunay(uv).simplices
    matrix, offset = rng.normal(size=(2, 2)), rng.normal(size=2)
    pixels = rasterise(uv[triangles], (uv @ matrix + offset)[triangles], width, height)
    np.testing.assert_array_equal(pixels.index, np.arange(width * height))  # the map covers the image
    row, column = np.divmod(pixels.index, width)
    centre = np.stack([(column + 0.5) / width, (row + 0.5) / height], axis=-1)
    np.testing.assert_allclose(pixels.position, centre @ matrix + offset, atol=1e-9)


def test_pixels_outside_the_map_are_left_out_and_mirrored_faces_count():
    uv = np.array([[[0.25, 0.25], [0.25, 0.75], [0.75, 0.25]]])
    pixels = rasterise(uv, uv * 8, 8, 8)
    row, column = np.divmod(pixels.index, 8)
    inside = (column + 0.5 >= 2) & (row + 0.5 >= 2) & (row + column + 1 <= 8)
    assert inside.all()
    assert len(pixels.index) == 10


@pytest.mark.parametrize(
    "uv", [np.full((1, 3, 2), 0.5), np.array([[[1.2, 0.1], [1.9, 0.1], [1.5, 0.8]]]), np.zeros((0, 3, 2))]
)
def test_faces_without_area_or_beyond_the_image_have_no_pixels(uv):
    assert not len(rasterise(uv, uv, 16, 16).index)
