"""Plates: pressed ground seen from straight above, its height in colours under a low light, with a scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from softground_addon.core.record.footprints import Footprint, recompose

mpl.use("Agg")
from matplotlib import colors, pyplot

_STOPS = ((0.0, "#16324f"), (0.2, "#35618e"), (0.4, "#8fb3cf"), (0.5, "#f1eee8"), (0.6, "#e3b87f"), (1.0, "#9c4a1a"))
COLOURS = colors.LinearSegmentedColormap.from_list("plate", _STOPS)
"""Blue below the undisturbed ground, brown above it."""

Array = NDArray[np.float64]

_MARGIN = 0.15  # m around what was pressed
_PIXEL = 0.004  # m
_WIDTH, _BESIDE = 8.4, 0.8  # inches: of the ground, and of the colours beside it
_LIGHT = colors.LightSource(azdeg=315.0, altdeg=32.0)
_INK = "#2b2b2b"
_GAP = 0.06  # m between a first print and the name below it
_BELOW = 0.05  # of the width, for the scale
_FULL = 99.5  # percentile of the depth that has the full colour


def draw_plate(tracks: Mapping[str, Sequence[Footprint]], path: Path) -> Path:
    """Draw the ground at the end, its longer side across, and each name below the first print of its track.

    Parameters
    ----------
    tracks : mapping
        Footprints by what is written beside them.
    path : Path
        A PNG file, which is returned.
    """
    prints = [step for track in tracks.values() for step in track]
    corners = np.array([_corners(step) for step in prints])
    low, high = corners[:, 0].min(axis=0) - _MARGIN, corners[:, 1].max(axis=0) + _MARGIN
    turned = bool(np.ptp([low, high], axis=0)[1] > np.ptp([low, high], axis=0)[0])
    if turned:  # by a quarter: +y is to the right, +x down
        low, high = _turned(low, high)
    low = low - (0.0, _BELOW * (high - low)[0])
    across, up = np.meshgrid(*(np.arange(low[axis], high[axis], _PIXEL) for axis in (0, 1)))
    depth, rim = recompose(prints).sample(*((-up, across) if turned else (across, up)))
    height = rim - depth
    most = float(np.percentile(np.abs(height[height != 0]), _FULL))
    shaded = _LIGHT.shade(height, COLOURS, vmin=-most, vmax=most, blend_mode="soft", vert_exag=3, dx=_PIXEL, dy=_PIXEL)
    wide, tall = high - low
    size = np.array((_WIDTH, _WIDTH * tall / wide))
    figure = pyplot.figure(figsize=(size[0] + _BESIDE, size[1]))
    share = float(size[0] / (size[0] + _BESIDE))
    axes = figure.add_axes((0.0, 0.0, share, 1.0))
    axes.imshow(shaded, origin="lower", extent=(low[0], high[0], low[1], high[1]), interpolation="bilinear")
    axes.set_axis_off()
    _draw_scale(axes, low + 0.02 * wide, wide)
    for name, track in tracks.items():
        first = _corners(min(track, key=lambda step: step.start_frame))
        first = _turned(*first) if turned else first
        axes.text(first[:, 0].mean(), first[0, 1] - _GAP, name, fontsize=9, color=_INK, ha="center", va="top")
    legend = figure.add_axes((share + 0.012, 0.12, 0.012, 0.76))
    heights = pyplot.cm.ScalarMappable(colors.Normalize(-100 * most, 100 * most), COLOURS)
    figure.colorbar(heights, cax=legend).set_label("height [cm]", fontsize=8)
    legend.tick_params(labelsize=8)
    legend.locator_params(nbins=5)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    return path


def _turned(low: Array, high: Array) -> Array:
    """Lowest and highest corner after the quarter turn, (2, 2) [m]."""
    return np.array(((low[1], -high[0]), (high[1], -low[0])))


def _corners(step: Footprint) -> Array:
    """Lowest and highest corner of what a print touched, (2, 2) [m]."""
    row, column = np.divmod(step.contact_cells, step.window.columns)
    cells = np.column_stack([column + step.window.column, row + step.window.row])
    ends: Array = np.array([cells.min(axis=0), cells.max(axis=0) + 1]) * step.cell_size
    return ends


def _draw_scale(axes: pyplot.Axes, corner: Array, wide: float) -> None:
    """Half a metre in fields of ten centimetres, above a corner of a plate of a width [m]."""
    thickness = 0.005 * wide
    for field in range(5):
        place = (corner[0] + 0.1 * field, corner[1])
        colour = ("white", _INK)[field % 2]
        axes.add_patch(pyplot.Rectangle(place, 0.1, thickness, facecolor=colour, edgecolor=_INK, linewidth=0.6))
    axes.text(corner[0] + 0.25, corner[1] + 2 * thickness, "50 cm", fontsize=8, ha="center", va="bottom", color=_INK)
