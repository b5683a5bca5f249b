"""A shoe with a real sole: outline with heel, arch, ball and toes; heel and toe spring; a tread."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sample_scenes.body import Array, Foot
from sample_scenes.curves import monotone_cubic

# The outline of a right or left shoe as fractions of length (x from the back) and of the ball's width, from the
# centre line of the heel: the inner side hardly leaves its line, the outer bulges at the little toe's joint.
_STATIONS = np.array((0.0, 0.01, 0.04, 0.10, 0.18, 0.30, 0.45, 0.58, 0.70, 0.80, 0.88, 0.94, 0.98, 1.0))
_INNER = np.array((0.0, 0.13, 0.25, 0.335, 0.355, 0.31, 0.30, 0.38, 0.445, 0.435, 0.37, 0.27, 0.15, 0.07))
_OUTER = np.array((0.0, 0.13, 0.25, 0.335, 0.36, 0.385, 0.44, 0.515, 0.555, 0.50, 0.37, 0.21, 0.06, -0.07))

TREAD_DEPTH = 0.0022
"""Depth of the grooves between the bars of the tread [m]."""

_BAR_PITCH = 0.017  # m from bar to bar
_GROOVE = 0.0045  # m
_TREAD_MARGIN = 0.008  # m of plain sole along the edge
_SOLE_THICKNESS = 0.022  # m
_ACROSS = 25  # vertices across the underside
_OVER = 15  # vertices over the upper, from welt to welt
_SPACING = 0.0035  # m between stations


def outline_width(foot: Foot, x: Array) -> tuple[Array, Array]:
    """Inner and outer edge of the sole beside the centre line at stations x, (N,) each [m]; y is positive inward."""
    u = np.clip((x - foot.back) / foot.length, 0.0, 1.0)
    # The square root turns the blunt ends, where width grows like sqrt, into something a smooth curve can follow.
    warp = np.sqrt(_STATIONS), np.sqrt(u)
    return tuple(foot.width * monotone_cubic(warp[1], warp[0], edge) for edge in (_INNER, -_OUTER))


def shoe_mesh(foot: Foot) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """A closed shoe whose inner side faces +y, its sole at z = 0.

    Returns
    -------
    vertices : (V, 3) float array
        [m], in the frame of `Foot`.
    quads : (Q, 4) int array
        Outward; triangles at the tips of heel and toe repeat their last vertex.
    parts : (Q,) int array
        0 upper, 1 sole.
    """
    count = round(foot.length / _SPACING)
    # Stations close up toward both ends, where the outline turns.
    x = foot.back + foot.length * (0.5 - 0.5 * np.cos(np.pi * np.linspace(0.004, 0.996, count)))
    inner, outer = outline_width(foot, x)
    across = np.linspace(0.0, 1.0, _ACROSS)
    over = np.linspace(0.0, 1.0, _OVER)

    bottom_y = outer[:, None] + (inner - outer)[:, None] * across
    bottom_x = np.broadcast_to(x[:, None], bottom_y.shape)
    spring = _spring(foot, x)[:, None]
    edge = np.minimum(across, 1 - across) * (inner - outer)[:, None]
    bevel = 0.004 * np.clip(1 - edge / 0.005, 0.0, 1.0) ** 2
    bottom_z = spring + bevel + _tread(foot, bottom_x, bottom_y, edge)

    over_y, over_z = upper(foot, x[:, None], over)
    wall = _wall(foot, x)[:, None]
    welt_in = np.concatenate([inner[:, None], wall], axis=1)
    welt_out = np.concatenate([outer[:, None], wall], axis=1)

    y = np.concatenate([bottom_y, welt_in[:, :1], over_y, welt_out[:, :1]], axis=1)
    z = np.concatenate([bottom_z, welt_in[:, 1:], over_z, welt_out[:, 1:]], axis=1)
    rings = np.stack([np.broadcast_to(x[:, None], y.shape), y, z], axis=-1)
    n, m = y.shape
    ends = rings[[0, -1]].mean(axis=1)
    ends[:, 0] = foot.back, foot.front
    vertices = np.concatenate([rings.reshape(-1, 3), ends])

    i, j = np.meshgrid(np.arange(n - 1), np.arange(m), indexing="ij")
    a, b = i * m + j, i * m + (j + 1) % m
    quads = np.stack([a, a + m, b + m, b], axis=-1)
    is_sole = (j <= _ACROSS) | (j == m - 1)
    column = np.arange(m)
    heel = np.stack([column, (column + 1) % m, *[np.full(m, n * m)] * 2], axis=-1)
    tip = np.stack([(n - 1) * m + (column + 1) % m, (n - 1) * m + column, *[np.full(m, n * m + 1)] * 2], axis=-1)
    parts = np.concatenate([is_sole.ravel(), *[(column <= _ACROSS) | (column == m - 1)] * 2]).astype(int)
    return vertices, np.concatenate([quads.reshape(-1, 4), heel, tip]), parts


def upper(foot: Foot, x: Array, over: Array) -> tuple[Array, Array]:
    """Across and height of the upper at stations x, `over` it from the inner welt (0) to the outer (1) [m].

    Both broadcast against each other.
    """
    inner, outer = outline_width(foot, x)
    wall = _wall(foot, x)
    top = np.maximum(_upper_height(foot, x), wall + 0.006)
    angle = np.pi * over
    middle, half = (inner + outer) / 2, (inner - outer) / 2
    lean = 0.12 * half * np.sin(angle) * (x > 0)  # the instep is highest on the inner side
    squareness = 0.72
    y = middle + lean + 0.93 * half * np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** squareness
    narrowing = 1 - 0.30 * np.clip((top - 0.05) / 0.07, 0, 1) * np.sin(angle) ** 2
    return middle + (y - middle) * narrowing, wall + (top - wall) * np.sin(angle) ** squareness


def _wall(foot: Foot, x: Array) -> Array:
    """Height at which the upper begins."""
    return np.maximum(_SOLE_THICKNESS, _spring(foot, x) + 0.012)


def _spring(foot: Foot, x: Array) -> Array:
    """Height of the bare sole: flat from heel to ball, rounded up behind the heel and toward the tip of the toes."""
    behind = np.clip((foot.heel - x) / (foot.heel - foot.back), 0.0, 1.0)
    ahead = np.clip((x - foot.toe) / (foot.front - foot.toe), 0.0, 1.0)
    return 0.009 * behind**1.5 + 0.010 * ahead**1.5


def _tread(foot: Foot, x: Array, y: Array, edge: Array) -> Array:
    """Height of the grooves between bars, which bow across the sole; a wider gap sets off the heel block."""
    bow = 0.25 * np.abs(y)
    phase = np.mod(x - foot.back - bow, _BAR_PITCH)
    groove = np.clip(1 - np.abs(phase - _BAR_PITCH / 2) / _GROOVE * 2, 0.0, 1.0) ** 0.5
    u = (x - foot.back) / foot.length
    arch = np.clip(1 - np.abs(u - 0.40) / 0.055, 0.0, 1.0) ** 0.5  # between the heel block and the ball
    inset = np.clip((edge - _TREAD_MARGIN) / 0.003, 0.0, 1.0)
    return np.maximum(TREAD_DEPTH * groove * inset, 1.5 * TREAD_DEPTH * arch)


def _upper_height(foot: Foot, x: Array) -> Array:
    """Top of the upper along the centre line: toe box, instep, collar around the ankle, heel counter."""
    u = (x - foot.back) / foot.length
    stations = np.array((0.0, 0.03, 0.10, 0.22, 0.36, 0.46, 0.60, 0.75, 0.90, 0.97, 1.0))
    heights = np.array((0.22, 0.38, 0.46, 0.47, 0.44, 0.35, 0.27, 0.22, 0.185, 0.14, 0.09))
    return foot.length * monotone_cubic(u, stations, heights)
