"""The ground that fits a walk: how far it reaches, how high it lies, and where the feet come down on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ground.camera_view import FARTHEST, CameraView
from ..ground.heightfield import FlatTerrain, SlopingTerrain, Terrain
from ..loads.contacts import REST_SPEED, TOUCH_HEIGHT, detect_contacts
from ..loads.missed_steps import advice, missed_steps
from ..motion.motion import CharacterMotion
from ..motion.props import posed
from ..motion.sole_motion import SoleMotion, shortest_length
from ..numerics.arrays import Array, Indices, Mask
from ..numerics.cell_keys import Keys, cells_at, cells_of, keys_of
from ..numerics.slices import Slices, sliced
from ..soles.deep_ground import wading

MARGIN = 2.0
"""How far the ground reaches beyond the feet, in lengths of the longest sole."""

LOW_PERCENTILE = 10.0
"""A sole is on its ground for at least this share of a shot, so that its lowest points tell the ground's height."""

POINTS_ALONG_SOLE = 24
"""Points along a sole by which the ground under it is told: about 1 cm apart for a foot."""

NEAR_GROUND = 0.15
"""Parts of a sole that are higher than this above the ground do not press it at the time, in lengths of the sole."""

DEEPER = 1.5
"""Depth of deep prints, over that of the typical one."""

STEEPER_KEEPS = 0.25
"""Share of the moments of standing that an inclined ground has to keep beyond what a level one keeps: less is noise
of the animation."""

LEAST_SPREAD = 0.5
"""Standard deviation of the footholds along a direction from which its slope can be told, in leg lengths: the distance
between the feet is less."""

BLOCKS_IN_REACH = 3
"""Blocks that the reach beyond a sole is made of at least: they cover little more than what is asked for."""

SOLID_REACH = 0.3
"""Part of a body that may sink in, in its size."""

PARTS_OF_A_FRAME = 4
"""Poses of a body that are looked at in each frame: it may be fast."""

_FRAMES_AT_ONCE = 256
_ROUNDS = 20


@dataclass(frozen=True)
class GroundPlan:
    """A plane ground that fits a walk.

    Attributes
    ----------
    lower, upper : (2,) float arrays
        Corners of the area to cover, in world space [m].
    terrain : FlatTerrain or SlopingTerrain
        The ground as a function of place.
    footfalls : (N, 2) float array, optional
        Places that lie under a sole at some time of a contact [m], about `raster` apart.
    raster : float
        [m]
    warnings : tuple of str
        Steps that find no ground on it.
    """

    lower: Array
    upper: Array
    terrain: FlatTerrain | SlopingTerrain
    footfalls: Array | None = None
    raster: float = 0.0
    warnings: tuple[str, ...] = ()

    def fine_blocks(self, spacing: float, reach: float, chosen: Mask | None = None) -> tuple[Indices, int]:
        """The squares that hold all places within reach of a footfall.

        Parameters
        ----------
        spacing : float
            Side of a grid's cells [m].
        reach : float
            How far beyond the soles the ground changes [m].
        chosen : (N,) bool array, optional
            The footfalls that count; by default all.

        Returns
        -------
        blocks : (N, 2) int array
            Column and row of squares of 2^level cells.
        level : int
        """
        assert self.footfalls is not None, "where the feet come down is not known"
        footfalls = self.footfalls if chosen is None else self.footfalls[chosen]
        reach += self.raster + spacing / 2
        level = max(0, int(np.floor(np.log2(reach / BLOCKS_IN_REACH / spacing))))
        side = spacing * 2**level
        far = reach / side + np.sqrt(0.5)  # from the middle of a block to where the place may be
        row, column = np.mgrid[-int(far) : int(far) + 1, -int(far) : int(far) + 1]
        disc = keys_of(np.stack([column, row], axis=-1)[row**2 + column**2 <= far**2])
        return cells_of(np.unique(cells_at(footfalls, side)[:, None] + disc)), level

    def with_prints(self, printed: Keys, cell_size: float) -> GroundPlan:
        """The plan with printed cells of a size [m] among its footfalls, as legs plough more than lies under soles."""
        keys = np.unique(cells_at((cells_of(printed) + 0.5) * cell_size, self.raster))
        return replace(self, footfalls=np.concatenate([self.footfalls, (cells_of(keys) + 0.5) * self.raster]))

    def widened(self, margin: float, camera: CameraView | None) -> GroundPlan:
        """The plan with a margin [m] on all sides, and over what a camera sees of it; without a margin as it is."""
        if not margin > 0:
            return self
        corners = near = np.stack([self.lower - margin, self.upper + margin])
        if camera is not None:
            height = float(self.terrain.heights(*(self.lower + self.upper)[:, None] / 2)[0])
            seen = np.clip(camera.reach(height), near[0] - FARTHEST, near[1] + FARTHEST)
            corners = np.concatenate([near, seen])
        return replace(self, lower=corners.min(axis=0), upper=corners.max(axis=0))


def extent(motions: Sequence[CharacterMotion]) -> tuple[Array, Array]:
    """Lowest and highest x, y around all paths of the soles, with a margin [m]."""
    soles = [sole for motion in motions for sole in motion.soles]
    paths = [sole.landmark_positions()[..., :2] for sole in soles]
    margin = MARGIN * max(sole.sole.length for sole in soles)
    lower = np.min([path.min(axis=(0, 1)) for path in paths], axis=0)
    upper = np.max([path.max(axis=(0, 1)) for path in paths], axis=0)
    return lower - margin, upper + margin


@sliced
def plan_ground(motions: Sequence[CharacterMotion], depth: float = 0.0) -> Slices[GroundPlan]:
    """The plane under the lowest positions of the soles, with a margin around all of their paths.

    It is level, unless the soles stand on a slope. Where the typical print has a depth [m] in which legs plough, what
    they pass on their way is among its footfalls.
    """
    slope = _slope([motion for motion in motions if motion.centre is None])
    levels = [] if slope.any() else [motion.ground_level for motion in motions if motion.ground_level is not None]
    lows = levels or [_standing_height(motion, sole, slope) for motion in motions for sole in _feet(motion)]
    low = float(np.median(lows))
    contacts = []
    for motion in motions:
        yield
        contacts.append(detect_contacts(motion, _terrain(low, slope)))
    floats = [
        offset
        for motion, contact in zip(motions, contacts, strict=True)
        for sole, offset in zip(motion.soles, contact.offset, strict=True)
        if motion.centre is None and any(sole is foot for foot in _feet(motion))
    ]
    # What skin shows is where it rests; the underside of a foot that was cut from it may lie a little off.
    height = low + (float(np.median(floats)) if floats and not levels else 0.0)
    raster = shortest_length(sole.sole.length for motion in motions for sole in motion.soles) / POINTS_ALONG_SOLE
    footfalls = []
    for motion, contact in zip(motions, contacts, strict=True):
        for sole, touching, offset in zip(motion.soles, contact.touching.T, contact.offset, strict=True):
            yield
            if sole.sole.prop:
                footfalls.append(_places_under_prop(sole, _terrain(height, slope), raster))
            else:
                deep = DEEPER * depth if wading(DEEPER * depth, sole.sole.length) > 0 else 0.0
                near, under = max(NEAR_GROUND * sole.sole.length, deep), _terrain(low + offset, slope)
                footfalls.append(_places_under(sole, touching | (deep > 0), under, raster, near))
    yield
    missed = [(motion.name, missed_steps(motion, contact)) for motion, contact in zip(motions, contacts, strict=True)]
    return GroundPlan(
        *extent(motions),
        _terrain(height, slope),
        np.concatenate(footfalls),
        raster,
        tuple(advice(name, steps, "the created ground").text for name, steps in missed if steps),
    )


def _terrain(height: float, slope: Array) -> FlatTerrain | SlopingTerrain:
    return SlopingTerrain(height, slope) if slope.any() else FlatTerrain(height)


def _feet(motion: CharacterMotion) -> list[SoleMotion]:
    """The soles that tell where the ground is: hands and canes need not ever touch it."""
    return [sole for sole in motion.soles if sole.sole.prop is None] or list(motion.soles)


def _standing_height(motion: CharacterMotion, sole: SoleMotion, slope: Array) -> float:
    """Height at which a sole is on its ground, where that would be at the origin [m].

    A prop may fly for most of a shot, and its mesh touches exactly.
    """
    if sole.sole.prop:
        lifts = sole.lowest() - sole.transforms[:, 0, :2, 3] @ slope
    else:
        points = sole.landmark_positions()
        lifts = (points[..., 2] - points[..., :2] @ slope).min(axis=1)
    return float(np.percentile(lifts, LOW_PERCENTILE if motion.centre is None else 0.0))


def _slope(motions: Sequence[CharacterMotion]) -> Array:
    """Rise along x and y of the ground that the soles stand on, (2,): 0 unless a level one would lose many of them."""
    holds = np.concatenate([np.zeros((0, 3)), *(_footholds(motion) for motion in motions)])
    if len(holds) < 2:
        return np.zeros(2)
    leg = float(np.median([motion.leg_length for motion in motions]))
    place = holds[:, :2] - holds[:, :2].mean(axis=0)
    _, spread, axes = np.linalg.svd(place / np.sqrt(len(place)), full_matrices=False)
    along = axes[spread > LEAST_SPREAD * leg]
    terms = np.column_stack([place @ along.T, np.ones(len(place))])
    height = holds[:, 2]
    weight = np.ones(len(height))
    for _ in range(_ROUNDS):  # the least sum of distances, which single footholds off the ground do not tilt
        fit, *_ = np.linalg.lstsq(terms * weight[:, None], height * weight, rcond=None)
        weight = 1.0 / np.sqrt(np.maximum(np.abs(height - terms @ fit), 1e-3 * leg))
    near = TOUCH_HEIGHT * leg
    on_slope = (np.abs(height - terms @ fit) < near).mean()
    on_level = max((np.abs(height - level) < near).mean() for level in np.percentile(height, np.arange(0, 101, 5)))
    slope: Array = fit[:-1] @ along
    return slope if on_slope > on_level + STEEPER_KEEPS else np.zeros(2)


def _footholds(motion: CharacterMotion) -> Array:
    """Lowest point of each foot whenever it is seen to bear or rests, (N, 3) [m]; none of limbs, which may rest on
    nothing."""
    limit = REST_SPEED * motion.froude_speed
    footholds = [np.zeros((0, 3))]
    for sole in (sole for sole in motion.soles if sole.sole.prop is None):
        points = sole.landmark_positions()
        lowest = points[np.arange(len(points)), points[..., 2].argmin(axis=1)]
        speed = np.linalg.norm(np.gradient(lowest, motion.time_step, axis=0), axis=-1) if len(lowest) > 1 else 0.0
        footholds.append(lowest[speed < limit if sole.bears is None else sole.bears])
    return np.concatenate(footholds)


def _places_under(sole: SoleMotion, touching: Mask, terrain: Terrain, raster: float, near: float) -> Array:
    """Places under a sole while it touches, as far as it is near its ground [m], (N, 2) [m], one in each square of a
    raster.

    Contacts begin and end between frames: it counts as touching until halfway to the next.
    """
    edge = np.flatnonzero(touching[1:] != touching[:-1])
    poses = np.concatenate([sole.transforms[touching], (sole.transforms[edge] + sole.transforms[edge + 1]) / 2])
    keys: Keys = np.zeros(0, dtype=np.int64)
    for number, patch in enumerate(sole.sole.patches):
        stride = max(1, round(raster / patch.spacing))
        row, column = np.nonzero(patch.signed_distance[::stride, ::stride] < raster)
        points = patch.origin + np.stack([column, row], axis=-1) * (stride * patch.spacing)
        points = np.column_stack([points, np.nan_to_num(patch.heights[::stride, ::stride][row, column])])
        for first in range(0, len(poses), _FRAMES_AT_ONCE):
            pose = poses[first : first + _FRAMES_AT_ONCE, number, :3]
            places = points @ pose[..., :3].transpose(0, 2, 1) + pose[:, None, :, 3]
            x, y, z = np.moveaxis(places, -1, 0)
            low = z - terrain.heights(x, y) < near
            keys = np.union1d(keys, cells_at(places[low, :2], raster))
    return (cells_of(keys) + 0.5) * raster


def _places_under_prop(sole: SoleMotion, terrain: Terrain, raster: float) -> Array:
    """Places under the lower part of a body whenever it is near the ground, (N, 2) [m]: it may roll and sink in."""
    prop = sole.sole.prop
    assert prop is not None, sole.sole.name
    near = SOLID_REACH * prop.size
    count = (len(sole.transforms) - 1) * PARTS_OF_A_FRAME + 1
    keys: Keys = np.zeros(0, dtype=np.int64)
    for pose in sole.at(np.arange(count) / PARTS_OF_A_FRAME).transforms[:, 0]:
        place = posed(prop.vertices, pose)
        place = place[place[:, 2] < terrain.heights(*place[:, :2].T) + near, :2]
        if len(place):
            low, high = np.floor(place.min(axis=0) / raster), np.floor(place.max(axis=0) / raster) + 1
            box = np.stack(np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1])), axis=-1)
            keys = np.union1d(keys, keys_of(box.astype(np.int64)).ravel())
    return (cells_of(keys) + 0.5) * raster
