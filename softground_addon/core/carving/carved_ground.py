"""The ground of a shot as bodies carve it, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from ..ground.hard_ground import bare
from ..ground.heightfield import TerrainTiles
from ..ground.soft_ground import SoftGround
from ..ground.sparse_grid import TILE, SampledGrid, Window
from ..ground.surfaces import find
from ..ground.variation import VariationTiles
from ..numerics.arrays import Array, Indices, Mask
from ..numerics.interpolation import cubic
from ..pressing.repose import SWEEPS_TO_REST
from ..record.footprints import QUANTUM, Footprint, quantised
from ..soles.undersides import lowest_surface
from .carved_step import CarvedStep
from .carver import EDGE, HIGHEST, REACH, SAMPLES, THICKEST, CarvedCells, in_cells, least_cut, of_ground, pieces

MOST_POSES = 32
"""Most poses of a body in a frame."""
SLIDES_EVERY, SWEEPS = 1 / 8, 8
"""Loose matter slides after every so many seconds in so many sweeps (`repose.slid`); the rest goes on in the next."""
PUSHED = 1 / 24
"""Time in which loose matter that is pushed along is packed as much as what stood is by the first cut [s]."""
SETTLING, SWEEPS_TO_SETTLE = 1 / 8, 96
"""It comes to rest once the leg is on its way to its next step, within this time [s], in at most so many sweeps;
without cohesion, in as many as it takes."""
LEAST = round(3e-3 / QUANTUM)
"""Changes of a cell are recorded once they come to so much, and all of them at the end [QUANTUM]: 3 mm."""
TOP, PLOUGHS_FROM, FRONT = 0.1, 1.0, 4
"""What is cut within so much of the open ground [m] may fly, as what cuts it goes so fast [m/s], from so many places
along its front."""
CELLS_ALONG_SOLE = 20
"""Carving has cells of 2 x 2 of the ground where these are so fine that as many go along the shortest sole."""
THIN = 2e-3
"""Loose matter that comes to rest is gathered where it is thinner [m]."""


class Part(NamedTuple):
    """A part of a body and the step that takes it.

    Attributes
    ----------
    vertices : (V,) int array
        Of the body.
    corners : (3, T) int array
        Triangles between them.
    """

    step: CarvedStep
    vertices: Indices
    corners: Indices


class Drawn(NamedTuple):
    """A part of a body as it passed over a frame.

    Attributes
    ----------
    underside : (4, rows, columns) float array
        Lowest surface over the quarters of each cell [m], infinite where there is none.
    way : (2,) float array
        Along x and y, of what moves most [m].
    """

    step: CarvedStep
    window: Window
    underside: Array
    way: Array


def _lowest(bodies: Sequence[Drawn], window: Window) -> Array:
    """Lowest surface of all bodies over the cells of a window, (rows, columns) [m], infinite where there is none."""
    lowest = np.full((window.rows, window.columns), np.inf)
    for body in bodies:
        if (shared := window.intersection(body.window)) is not None:
            here = window.slices(shared)
            lowest[here] = np.minimum(lowest[here], body.underside[:, *body.window.slices(shared)].min(axis=0))
    return lowest


def numbered(corners: Indices, count: int) -> tuple[Indices, Indices]:
    """The vertices of triangles (3, T), of a count, and the triangles as numbers of these."""
    place = np.zeros(count, dtype=np.intp)
    place[corners] = 1
    used = np.flatnonzero(place)
    place[used] = np.arange(len(used))
    return used, place.take(corners)


def _passed(around: Array, corners: Indices, needed: Array) -> tuple[Array, Indices]:
    """Places (3, N) that vertices (4, 3, V) pass from the second to the third of these times [m], and triangles there.

    Each triangle (3, T) is there as often as those of its vertices need (V,) that move most.
    """
    count = np.ceil(needed).astype(np.int8)
    of_triangle = np.maximum.reduce([count.take(corner) for corner in corners])
    poses = int(of_triangle.max())
    between = cubic(np.eye(4), 1.0 + np.arange(1, poses + 1) / poses)
    drawn = []
    for number in np.flatnonzero(np.bincount(of_triangle)).tolist():
        part = corners[:, of_triangle == number]
        drawn += [part + len(count) * (-(-poses * pose // number) - 1) for pose in range(1, number + 1)]
    return (between @ around.swapaxes(0, 1)).reshape(3, -1), np.concatenate(drawn, axis=1)


class CarvedGround:
    """The ground of a shot as it is carved."""

    def __init__(self, ground: SoftGround, cell_size: float, steps: Sequence[CarvedStep], rate: float) -> None:
        soles = [made_by.pressing.sole.length for step in steps if (made_by := step.footprint.pressed_by)]
        self._across = 2 if 2 * cell_size * CELLS_ALONG_SOLE <= min(soles, default=0.0) else 1
        """Cells of the ground along a cell."""
        cell_size *= self._across
        self._ground, self.cell_size = ground, cell_size
        self._coming = sorted(steps, key=lambda step: step.begins, reverse=True)
        self._pressing: list[CarvedStep] = []
        """Steps whose prints are changing."""
        self._slides_every, self._frames_to_rest = (max(1, round(time * rate)) for time in (SLIDES_EVERY, SETTLING))
        self._frames_to_push, self._rate = PUSHED * rate, rate
        self._undisturbed = TerrainTiles(bare(ground.terrain), cell_size)
        self._margin = ceil(2 * REACH / cell_size) + 2
        """Cells around a body that what it cuts is laid on."""
        self._variation = VariationTiles(ground.variation, cell_size) if ground.variation else None
        self._site = SampledGrid(self._undisturbed_site, cell_size, channels=3)
        """Terrain, its openness, the layer's floor."""
        self._cells = SampledGrid(self._untouched, cell_size, channels=3 + 2 * self._across**2 + SAMPLES**2)
        """T, loose matter, what is recorded of the cut and of this, what has broken off, and K."""
        self._tops = SampledGrid(self._terrain, cell_size, channels=1)
        """Highest of the quarters of each cell, with the loose matter on it."""
        self._contacts: list[tuple[Window, Mask]] = []
        self._loosened: dict[CarvedStep, Window] = {}
        """Where steps have cut since what is loose slid before."""
        self._settling: dict[CarvedStep, int] = {}
        """Steps whose loose matter comes to rest, and for how many more frames."""

    def _undisturbed_site(self, x: Array, y: Array) -> Array:
        """What a tile is before anybody comes, from its cell centres."""
        window = self._tile_at(x, y)
        surface = self._undisturbed.surface(window)
        terrain, depth = np.nan_to_num(surface.heights), self._ground.layer_depths(window, self.cell_size)
        bottom = terrain - depth * (self._variation.factors(window).depth if self._variation else 1.0)
        return np.stack([terrain, surface.bears, bottom])

    def _untouched(self, x: Array, y: Array) -> Array:
        """The channels of a tile, from its cell centres."""
        channels = np.zeros((self._cells.channels, *x.shape))
        channels[: self._across**2], channels[-(SAMPLES**2) :] = self._terrain(x, y), np.inf
        return channels

    def _terrain(self, x: Array, y: Array) -> Array:
        """Heights of the undisturbed ground of a tile, from its cell centres, (1, rows, columns)."""
        return self._site.read(self._tile_at(x, y))[:1]

    def _tile_at(self, x: Array, y: Array) -> Window:
        """The cells of a tile, from their centres."""
        return Window(floor(x[0, 0] / self.cell_size), floor(y[0, 0] / self.cell_size), TILE, TILE)

    def press(self, since: float, frame: float) -> None:
        """Go on to the ground as soles have pressed it by a frame; what is loose under them is packed."""
        while self._coming and self._coming[-1].begins <= frame:
            self._pressing.append(self._coming.pop())
        touched = (in_cells(step.footprint.window, step.touches(since, frame), self._across) for step in self._pressing)
        self._contacts = [(window, touching.any(axis=0)) for window, touching in touched]
        for step, (window, touching) in zip(self._pressing, self._contacts, strict=True):
            change = step.change(since, frame)
            if change is None and not touching.any():
                continue
            cells, channels = self._read(window)
            if change is not None:
                raised = in_cells(step.footprint.window, change, self._across)[1]
                cells.press(cells.pressed + raised.reshape(cells.pressed.shape))
            cells.pack()
            self._write(step, window, cells, channels, frame)
        for step in [step for step in self._pressing if step.ends <= frame]:
            self._pressing.remove(step)
            step.release()

    def drawn(self, part: Part, around: Array) -> Drawn | None:
        """A part of a body over a frame, None if none of it is near the ground; from its vertices (4, 3, V) around it.

        What is in the ground is drawn all the way, what only hovers over it at the end.
        """
        ends, cell_size = around[1:3].take(part.vertices, axis=2), self.cell_size
        if not part.step.is_deep or not np.isfinite(ends).all():
            return None
        lowest = ends[:, 2].min(axis=0)
        top = self._tops.read(self._box(ends.swapaxes(0, 1))).max()
        low = lowest < top + HIGHEST  # what is laid in this frame heaps up
        near = np.flatnonzero(np.logical_or.reduce([low.take(corner) for corner in part.corners]))
        corners = part.corners.take(near, axis=1)
        used, corners = numbered(corners, len(low))
        moves = around.take(part.vertices.take(used), axis=2)
        if not moves.size or not np.isfinite(moves).all():
            return None
        way = (moves[2] - moves[1])[:2]
        distance = np.hypot(*way) * (lowest < top).take(used)
        places, triangles = _passed(moves, corners, np.clip(distance / part.step.spacing, 1.0, MOST_POSES))
        window = self._box(places)
        apart = cell_size / SAMPLES
        origin = np.array((window.column, window.row)) * cell_size + apart / 2
        shape = window.rows * SAMPLES, window.columns * SAMPLES
        underside = lowest_surface(places.T, triangles.T, origin, shape, apart)
        of_cells = underside.reshape(window.rows, SAMPLES, window.columns, SAMPLES).transpose(1, 3, 0, 2)
        return Drawn(part.step, window, of_cells.reshape(-1, window.rows, window.columns), way[:, distance.argmax()])

    def _box(self, places: Array) -> Window:
        """The cells around places (3, ...)."""
        low, high = (np.array([end(along) for along in places[:2]]) for end in (np.min, np.max))
        return Window.around(low, high, self.cell_size)

    def carve(self, part: Drawn, bodies: Sequence[Drawn], frame: float) -> None:
        """Cut the ground to one of the parts of bodies that are drawn."""
        step, walls = part.step, part.step.walls
        under = part.underside.min(axis=0)
        least = least_cut(self._contact(part.window), self.cell_size / self._across)
        deep = self._tops.read(part.window)[0] - under >= least
        if (cut := part.window.around_cells(deep)) is None:
            return
        window = cut.expanded(self._margin)
        cells, channels = self._read(window)
        underside = np.full(cells.lowest.shape, np.inf)
        if (shared := window.intersection(part.window)) is not None:
            underside[:, *window.slices(shared)] = part.underside[:, *part.window.slices(shared)]
        again = 1.0 - (1.0 - walls.packing) ** (1.0 / self._frames_to_push)
        underside, standing = np.maximum(underside, self._bottom(window)), cells.standing
        cells.cut(underside, part.way, walls.packing, _lowest(bodies, window), again=again)
        flies = (1.0 - walls.packing) * (standing - np.maximum(cells.standing, cells.terrain - TOP))
        self._plough(part, window, np.maximum(flies, 0.0), standing, frame)
        self._write(step, window, cells, channels, frame)
        before = self._loosened.get(step)
        self._loosened[step] = window if before is None else before.union(window)

    def _plough(self, part: Drawn, window: Window, depth: Array, standing: Array, frame: float) -> None:
        """Note what may fly of what was cut of what stood (rows, columns), if what cut it is fast [m]."""
        velocity = np.append(part.way * self._rate, 0.0)
        holds = part.step.walls.strength > 0  # what has filled a funnel again stays
        if not holds or np.hypot(*velocity[:2]) < PLOUGHS_FROM or not depth.any():
            return
        row, column = np.nonzero(depth)
        x, y = (centres[cells] for centres, cells in zip(window.centres(self.cell_size), (column, row), strict=True))
        ahead = np.argsort(x * part.way[0] + y * part.way[1])
        front = ahead[np.linspace(len(ahead) // 2, len(ahead) - 1, FRONT).astype(int)]
        top = np.full(FRONT, standing[row, column].mean())
        points = np.stack([x[front], y[front], top], axis=-1)
        part.step.plough(frame, float(depth.sum()) * self.cell_size**2, points, velocity)

    def slide(self, bodies: Sequence[Drawn], frame: float) -> None:
        """Let slide what was loosened since it slid before, once it is time to."""
        if round(frame) % self._slides_every:
            return
        for step, window in self._loosened.items():
            cells, channels = self._read(window)
            cells.slide(step.walls, self._held(bodies, window, cells), (window.row, window.column), SWEEPS)
            self._write(step, window, cells, channels, frame)
        self._loosened.clear()

    def _crumbling(self, step: CarvedStep, window: Window) -> Array | float:
        """Depth to which the edges of a window break off at most, (rows, columns), or of all of them [m]."""
        regions = self._ground.regions
        if regions is None:
            return step.walls.crumbling
        numbers, shares = regions.under(window, window, self.cell_size)
        depths = np.array([find(regions.kinds[number].surface).wall_crumbling for number in numbers])
        return float(depths[0]) if shares is None else np.asarray(np.tensordot(depths, shares, 1))

    def _bottom(self, window: Window) -> Array:
        """Floor of the layer, (rows, columns) [m]."""
        floors: Array = self._site.read(window)[2]
        return floors

    @staticmethod
    def _held(bodies: Sequence[Drawn], window: Window, cells: CarvedCells) -> Mask:
        """Cells of a window in which a body stands in the ground."""
        held: Mask = _lowest(bodies, window) < cells.surface + THICKEST
        return held

    def leave(self, step: CarvedStep) -> None:
        """Let what a step has carved come to rest from now on."""
        if not step.at_rest and step.recorder.frames:
            self._settling[step] = self._frames_to_rest

    def settle(self, bodies: Sequence[Drawn], frame: float) -> None:
        """Let walls crumble at first, and what is loose slide on around bodies; at the end, all of it is recorded."""
        for step, frames in list(self._settling.items()):
            holds, begins = step.walls.strength > 0, frames == self._frames_to_rest
            edge = ceil(2 * EDGE / self.cell_size)
            sweeps = SWEEPS_TO_SETTLE if holds else SWEEPS_TO_REST
            window = self._of_recorder(step)
            most = np.max(self._crumbling(step, window.expanded(edge))) if begins else 0.0
            cells, _ = self._read(window)
            changed = np.where(cells.closed, 0.0, cells.surface - cells.terrain)
            reach = step.walls.reach(changed, cells.loose + most, self.cell_size)
            window = window.expanded(max(reach, edge if most else 0, self._margin))
            cells, channels = self._read(window)
            held = self._held(bodies, window, cells)
            if most:
                deepest = pieces(window, self.cell_size, self._crumbling(step, window))
                cells.crumble(deepest, held, self._bottom(window))
            if not holds and begins:
                cells.gather(channels[-2 - SAMPLES**2] * QUANTUM, THIN)  # then its edges slide as well
            cells.slide(
                step.walls,
                held,
                (window.row, window.column),
                ceil(sweeps / self._frames_to_rest),
            )
            if holds and frames == 1:
                cells.gather(channels[-2 - SAMPLES**2] * QUANTUM, THIN)
            if frames == 1:
                del self._settling[step]
            else:
                self._settling[step] = frames - 1
            self._write(step, window, cells, channels, frame, 1 if frames == 1 else LEAST)

    def finish(self, step: CarvedStep, frame: float) -> None:
        """Record all of what a step has carved by the last frame."""
        if not step.at_rest and step.recorder.frames:
            window = self._of_recorder(step).expanded(self._margin)
            self._write(step, window, *self._read(window), frame, 1)

    def footprint(self, step: CarvedStep) -> Footprint:
        """What a step has carved."""
        footprint, area = step.footprint, self.cell_size**2
        frames = step.recorder.frames
        return step.recorder.footprint(
            character=footprint.character,
            sole=footprint.sole,
            start_frame=min(frames),
            end_frame=max(frames),
            position=footprint.position,
            heading=footprint.heading,
            area_m2=0.0,
            peak_force_n=0.0,
            compressed_m3=step.cut * area,
            rim_m3=(step.cut - step.packed - step.unplaced) * area,
            unplaced_rim_m3=step.unplaced * area,
            load_frames=np.zeros(0),
            load_n=np.zeros(0),
            surface=footprint.surface,
        )

    def _of_recorder(self, step: CarvedStep) -> Window:
        """Cells of all changes of a step so far."""
        return Window(*(side // self._across for side in step.recorder.window))

    def _contact(self, window: Window) -> Mask:
        """Cells of a window under soles that press."""
        contact = np.zeros((window.rows, window.columns), dtype=bool)
        for around, touching in self._contacts:
            if (shared := around.intersection(window)) is not None:
                contact[window.slices(shared)] |= touching[around.slices(shared)]
        return contact

    def _read(self, window: Window) -> tuple[CarvedCells, Array]:
        """The cells of a window, and their channels."""
        channels, (terrain, bears, _) = self._cells.read(window), self._site.read(window)
        count, contact = self._across**2, self._contact(window)
        pressed = channels[:count] if count > 1 else channels[0]
        lowest, loose, broken = channels[-(SAMPLES**2) :], channels[count], channels[-1 - SAMPLES**2]
        return CarvedCells(self.cell_size, terrain, bears == 0, contact, pressed, lowest, loose, broken), channels

    def _write(
        self, step: CarvedStep, window: Window, cells: CarvedCells, channels: Array, frame: float, least: int = LEAST
    ) -> None:
        """Write cells back, and record their changes that come to the least [QUANTUM] with a step."""
        count = self._across**2
        recorded = channels[count + 1 : 2 * count + 2]
        change = quantised(np.concatenate([cells.cut_of_cells, cells.loose[None]])) - recorded.astype(np.int64)
        change *= (np.abs(change) >= least).any(axis=0)
        recorded += change
        channels[:count], channels[count], channels[-1 - SAMPLES**2] = cells.pressed, cells.loose, cells.broken
        channels[-(SAMPLES**2) :] = cells.lowest
        self._cells.write(window, channels)
        self._tops.write(window, np.minimum(cells.pressed, cells.lowest).max(axis=0, keepdims=True) + cells.loose)
        step.at_rest = least == 1
        step.cut += cells.cut_height
        step.packed += cells.packed
        step.unplaced += cells.unplaced
        if (part := window.around_cells(change.any(axis=0))) is not None:
            cut, loose = np.split(change[:, *window.slices(part)], [count])
            change = np.stack([of_ground(each) for each in (cut, np.broadcast_to(loose, cut.shape))])
            step.recorder.add(frame, part.refined(self._across), change, np.zeros(change.shape[1:], bool))
