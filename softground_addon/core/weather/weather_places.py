"""Data of the places of a bake that weather needs, from its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..ground.display_blur import CUT_OFF, blurred, blurred_window
from ..ground.heightfield import HeightField
from ..ground.sparse_grid import PLACES_AT_ONCE, TILE, SparseGrid, Window, overlaps, side_by_side
from ..numerics.arrays import Array, Mask
from ..numerics.cell_keys import among, keys_at, keys_of
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint, recompose
from . import hollows
from .weather import SEALING

SIGMAS = (0.01, 0.03, 0.09)
"""Standard deviations at which the relief is known besides its own [m]; in between, linear in the variance."""
BOUNDS = (0.0, *(sigma**2 for sigma in SIGMAS))
POWERS = 3
"""Degree of a hollow's water level as a polynomial of the root of its filling: within 2 % of its depth in a walk."""
NEAR = 4.0
"""Factor of the contact share within `SIGMAS[-1]`, up to 1, for sand that turns pale: 1 along the edges of a foot."""
LEAST_RANGE = 1e-6
"""Shares of soaking that differ by less are one."""
COVERED = 0.01
"""New snow that hides the ground below [m]."""
NOT_YET = 1e9
"""Frame of events that never come."""
LEAST_SHARE = 1e-6
"""Contact that is blurred to less than this counts for nothing."""


@dataclass(frozen=True)
class WeatherPlaces:
    """Results of a bake at K places, as far as weather needs them.

    Attributes
    ----------
    blur : (K, 3) float array
        Changes of the final relief from its own blur to each of `SIGMAS`, one after the other [m].
    trodden : (K, 3) float array
        Share of ground in contact at the first of them, and its changes to the next.
    times : (K, 3) float array
        First frame of the first contact there, and last frame at which something happened, both from the contacts
        around where there was none; compression by steps, at the first of the sigmas [m].
    pool : (K, 3) float array
        Capacity of the hollow there as a depth of water on it [m], 0 where there is none; height of the undisturbed
        ground above its bottom [m]; remaining share of its soaking.
    levels : (K, 4) float array
        Coefficients of the water level for each of the powers [m], and the frame from which on the hollow is there.
    blur_before : (K, 3) float array
        As `blur`, of the relief before the last step into an earlier print; 0 elsewhere.
    again : (K, 2) float array
        First frame of that step, long ago elsewhere; last frame of the contacts before it.
    """

    blur: Array
    trodden: Array
    times: Array
    pool: Array
    levels: Array
    blur_before: Array
    again: Array

    def without_prints(self, where: Mask) -> WeatherPlaces:
        """The same, but that some of the places are open ground."""
        bare = {
            each.name: np.where(where[:, None], OPEN_GROUND.get(each.name, 0.0), getattr(self, each.name))
            for each in fields(self)
        }
        return WeatherPlaces(**bare)


OPEN_GROUND: Mapping[str, Sequence[float]] = {"times": (NOT_YET, NOT_YET, 0.0), "again": (-NOT_YET, NOT_YET)}
"""Values of ground that nobody ever stepped on; all others are 0."""


def section_of(footprints: Sequence[Footprint]) -> float:
    """Mean volume of a print over its width [m²], as wind fills it: the width is that of a square of its area."""
    each = [footprint.compressed_m3 / np.sqrt(footprint.area_m2) for footprint in footprints if footprint.area_m2 > 0]
    return float(np.mean(each)) if each else 0.0


@sliced
def weather_places(
    footprints: Sequence[Footprint],
    position: Array,
    relief: Array,
    started: Array,
    ended: Array,
    *,
    cell_size: float,
    blur_sigma: float,
    layer_depth: Array | float,
    time_stretch: float = 1.0,
    felt: bool = False,
    puddles: bool = True,
) -> Slices[WeatherPlaces]:
    """Data of places that weather needs.

    Parameters
    ----------
    position : (K, 3) float array
        Their undisturbed world positions [m].
    relief : (K,) float array
        Relief that the finished bake shows there [m].
    started, ended : (K,) float arrays
        Frames of the animation from which on something happens there, and nothing any more; where nothing ever does,
        far in the future and far in the past.
    cell_size, blur_sigma : float
        [m].
    layer_depth : (K,) float array or float
        How far the loose layer can be pressed [m].
    time_stretch : float
        Frames of the animation for each frame of the footprints.
    felt : bool
        True if steps felt the weather: their record then contains the height of the open ground.
    puddles : bool
        True if water stands in hollows.
    """
    # Places out of reach are all alike: those within it and one beyond it are worked out.
    reach = int(np.ceil(CUT_OFF * np.hypot(SIGMAS[-1], blur_sigma) / cell_size)) + 1
    near = _near(footprints, reach, position, cell_size) | (relief != 0) | (started < NOT_YET) | (ended > -NOT_YET)
    each = np.append(np.flatnonzero(near), np.flatnonzero(~near)[:1])
    alike = np.full(len(near), len(each) - 1)
    alike[each] = np.arange(len(each))
    yield
    position, relief, started, ended = position[each], relief[each], started[each], ended[each]
    places = position[:, :2].T
    ground, trodden = recompose(footprints, cell_size=cell_size), _contacts(footprints, cell_size, time_stretch)
    # The displayed relief is blurred already.
    widths = [float(np.hypot(sigma, blur_sigma)) for sigma in SIGMAS]
    at_sigma = yield from _sampled(ground, widths, *places)
    # The record's level of open ground ends where its display does.
    narrowest = blur_sigma if felt else SIGMAS[0]
    bounds = yield from _sampled(trodden, (narrowest, *SIGMAS[1:]), *places)
    inside = [share for share, *_ in bounds]
    first, last = (_mean_frame(bounds, number) for number in (1, 2))
    last, compression = np.maximum(last, ended), at_sigma[0][0]
    if felt:
        started = started + 0.5 * time_stretch  # over a frame, of which the end is recorded
        ((compression,),) = yield from _sampled(_pressed(footprints, cell_size), widths[:1], *places)
    filling, layers = footprints if puddles else (), np.broadcast_to(layer_depth, alike.shape)[each]
    pool, levels = yield from _pools(filling, ground, position, blur_sigma, layers, time_stretch)
    blur_before, again = yield from _before_the_last(footprints, position, cell_size, blur_sigma, time_stretch)
    return WeatherPlaces(
        blur=_steps_of_blur(relief, at_sigma)[alike],
        trodden=np.stack([inside[0], inside[1] - inside[0], inside[2] - inside[1]], axis=-1)[alike],
        times=np.stack([np.minimum(first, started), last, compression], axis=-1)[alike],
        pool=pool[alike],
        levels=levels[alike],
        blur_before=blur_before[alike],
        again=again[alike],
    )


def _near(footprints: Sequence[Footprint], reach: int, position: Array, cell_size: float) -> NDArray[np.bool_]:
    """True for places (K, 3) in tiles that the windows of footprints reach into, with so many cells around them."""
    tiles = {tile for footprint in footprints for tile, *_ in overlaps(footprint.window.expanded(reach))}
    keys = np.unique(keys_of(np.array(list(tiles), dtype=np.int64).reshape(-1, 2)))
    return among(keys, keys_at(position[:, :2], TILE * cell_size))


def shares(variance: Array) -> Array:
    """Progress of a variance (K,) [m²] through each of the spans between `BOUNDS`, (K, 3), 0 to 1."""
    low, high = np.array(BOUNDS[:-1]), np.array(BOUNDS[1:])
    return np.asarray(np.clip((np.asarray(variance)[..., None] - low) / (high - low), 0.0, 1.0))


def soaking_shares(places: WeatherPlaces, where: Mask | slice = slice(None)) -> tuple[float, float]:
    """Least and largest remaining share of the soaking of hollows, all or some; in between, puddles are interpolated.

    The water of a hollow is linear in this share once all ground there takes up less than falls.
    """
    capacity, _, soaking = places.pool[where].T
    known = soaking[capacity > 0]
    return (float(known.min()), float(known.max())) if len(known) else (1.0, 1.0)


def _contacts(footprints: Sequence[Footprint], cell_size: float, time_stretch: float) -> SparseGrid:
    """Contact of cells, 1 or 0, and its products with their first and last frame in contact.

    Frames are those of the animation.
    """
    grid = SparseGrid(cell_size, channels=3)
    for footprint in footprints:
        touched, first, last = values = grid.read(footprint.window)
        cells = footprint.contact_cells[:]
        start, end = time_stretch * footprint.contact_start[:], time_stretch * footprint.contact_end[:]
        known = touched.reshape(-1)[cells] > 0
        first.reshape(-1)[cells] = np.where(known, np.minimum(first.reshape(-1)[cells], start), start)
        last.reshape(-1)[cells] = np.where(known, np.maximum(last.reshape(-1)[cells], end), end)
        touched.reshape(-1)[cells] = 1.0
        grid.write(footprint.window, values)
    return grid


def _sampled(grid: SparseGrid, sigmas: Sequence[float], x: Array, y: Array) -> Slices[list[Array]]:
    """Values of a grid at places (N,), blurred with each standard deviation [m]: (channels, N) each."""
    blurs = []
    for sigma in sigmas:
        yield
        blurs.append(blurred(grid, sigma))
    together = side_by_side(blurs)
    values = np.empty((together.channels, len(x)))
    for start in range(0, len(x), PLACES_AT_ONCE):
        yield
        part = slice(start, start + PLACES_AT_ONCE)
        values[:, part] = together.sample(x[part], y[part])
    return np.split(values, len(sigmas))


def _steps_of_blur(relief: Array, at_sigma: Sequence[Array]) -> Array:
    """See `WeatherPlaces.blur`, of a relief (K,) and compression and rim (2, K) at each of the sigmas."""
    return np.diff([relief, *(rim - compression for compression, rim in at_sigma)], axis=0).T


def _before_the_last(
    footprints: Sequence[Footprint], position: Array, cell_size: float, blur_sigma: float, time_stretch: float
) -> Slices[tuple[Array, Array]]:
    """See `WeatherPlaces.blur_before` and `again`."""
    blur, again = np.zeros((len(position), 3)), np.tile([-NOT_YET, NOT_YET], (len(position), 1))
    edge, around = (int(np.ceil(CUT_OFF * sigma / cell_size)) + 1 for sigma in SIGMAS[1:])
    trodden, so_far = SparseGrid(cell_size, channels=1), list[Footprint]()
    column, row = (np.floor(position[:, axis] / cell_size).astype(np.intp) for axis in (0, 1))
    for footprint in sorted(footprints, key=lambda each: each.start_frame):
        yield
        touched, near = trodden.read(footprint.window), footprint.window.expanded(edge)
        if touched.reshape(-1)[footprint.contact_cells[:]].any():
            inside = np.flatnonzero(near.holds(row, column))
            x, y = position[inside, :2].T
            before = [each for each in so_far if each.window.intersects(near.expanded(around))]
            latest, old = (
                [_blurred_at(_contacts(which, cell_size, time_stretch), sigma, near, x, y) for sigma in SIGMAS[:2]]
                for which in ([footprint], before)
            )
            start, last = _mean_frame(latest, 1), _mean_frame(old, 2)
            now = _mean_frame([new + earlier for new, earlier in zip(latest, old, strict=True)], 2)
            restarts = (last + 1.0 < now) & (now < NOT_YET)
            inside, x, y = inside[restarts], x[restarts], y[restarts]
            ground = recompose(before, cell_size=cell_size)
            shown, *at_sigma = (
                _blurred_at(ground, float(np.hypot(sigma, blur_sigma)), near, x, y) for sigma in (0.0, *SIGMAS)
            )
            blur[inside] = _steps_of_blur(shown[1] - shown[0], at_sigma)
            again[inside] = np.stack([start[restarts], last[restarts]], axis=-1)
        touched.reshape(-1)[footprint.contact_cells[:]] = 1.0
        trodden.write(footprint.window, touched)
        so_far.append(footprint)
    return blur, again


def _blurred_at(grid: SparseGrid, sigma: float, window: Window, x: Array, y: Array) -> Array:
    """Blurred values at positions in a window, (channels, N)."""
    part, around = SparseGrid(grid.cell_size, channels=grid.channels), window.expanded(1)
    part.write(around, blurred_window(grid, around, sigma))
    return part.sample(x, y)


def _pressed(footprints: Sequence[Footprint], cell_size: float) -> SparseGrid:
    """Compression of each cell by all steps, without the weather's [m]."""
    grid = SparseGrid(cell_size, channels=1)
    for footprint in footprints:
        grid.write(footprint.window, grid.read(footprint.window) + footprint.tile(footprint.pressing))
    return grid


def _mean_frame(blurs: Sequence[Array], number: int) -> Array:
    """Mean frame of the contacts around, by the narrowest blur that reaches any; never, where none does.

    The first or the second of the frames of `_contacts`, by its number.
    """
    frame = np.full(blurs[0].shape[1], NOT_YET)
    for blur in reversed(blurs):
        near = blur[0] > LEAST_SHARE
        frame[near] = blur[number, near] / blur[0, near]
    return frame


def _pools(
    footprints: Sequence[Footprint],
    ground: HeightField,
    position: Array,
    blur_sigma: float,
    layer_depth: Array,
    time_stretch: float,
) -> Slices[tuple[Array, Array]]:
    """`WeatherPlaces.pool` and `levels`: of the latest print whose hollow each place lies in."""
    pool, levels = np.zeros((len(position), 3)), np.zeros((len(position), POWERS + 1))
    cell_size = ground.cell_size
    row, column = (np.floor(position[:, axis] / cell_size).astype(np.intp) for axis in (1, 0))
    for footprint in sorted(footprints, key=lambda each: each.end_frame):
        yield
        window = footprint.window.expanded(1)
        inside = np.flatnonzero(window.holds(row, column))
        if not len(inside):
            continue
        x, y = np.meshgrid(*window.centres(cell_size))
        rest = _plane_through(position[inside], x, y)
        compression, rim = blurred_window(ground, window, blur_sigma)
        within = (row[inside] - window.row) * window.columns + column[inside] - window.column
        for hollow in hollows.hollows(rest + rim - compression, cell_size**2):
            wet = inside[np.isin(within, hollow.cells)]
            pressed = compression.ravel()[hollow.cells].mean() / layer_depth[wet]
            pool[wet, 0] = hollow.capacity / hollow.catchment
            pool[wet, 1] = position[wet, 2] - hollow.bottom
            pool[wet, 2] = np.exp(-SEALING * pressed)
            levels[wet] = [*rise_of(hollow), footprint.end_frame * time_stretch]
    return pool, levels


def rise_of(hollow: hollows.Hollow) -> Array:
    """Coefficients of a hollow's water level, exact where it is full."""
    root = (1.0 - np.cos(np.linspace(0.0, np.pi, 17))) / 2.0
    level = hollow.level(hollow.capacity * root**2) - hollow.bottom
    first, second, third = root ** np.arange(1, POWERS + 1)[:, None]
    lower, *_ = np.linalg.lstsq(
        np.stack([first - third, second - third], axis=-1), level - level[-1] * third, rcond=None
    )
    return np.append(lower, level[-1] - lower.sum())


def _plane_through(points: Array, x: Array, y: Array) -> Array:
    """Heights at x and y of the plane that is nearest to points (N, 3)."""
    middle = points.mean(axis=0)
    rise = np.linalg.lstsq(points[:, :2] - middle[:2], points[:, 2] - middle[2], rcond=None)[0]
    return np.asarray(middle[2] + rise[0] * (x - middle[0]) + rise[1] * (y - middle[1]))
