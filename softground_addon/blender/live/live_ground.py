"""The ground's mesh while live mode is on: heights of a few cells written as the timeline moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.composers.playhead import Playhead
from ...core.ground.display_blur import blurred_window, gaussian_kernel
from ...core.ground.heightfield import HeightField
from ...core.ground.places import Places
from ...core.ground.sparse_grid import TILE, Window
from ...core.motion.ground_frame import GroundFrame
from ...core.numerics import bilinear
from ...core.numerics.arrays import Array, Indices
from ...core.numerics.slices import Slices
from ...core.record import record
from ...core.record.footprints import NEVER
from ...core.record.pressed_ground import GroundSample
from .. import settings
from ..ground import ground_mesh, ground_surface
from ..ground.baked_ground import Place

Tile = tuple[int, int]

ON_CENTRE = 1e-4
"""Vertices this near to the centres of their cells, in cells, take the cells' values as they are."""


@dataclass(frozen=True)
class _TileVertices:
    """The vertices over a tile of cells, and where they lie between the centres of the cells.

    Attributes
    ----------
    index : (N,) int array
        Vertices of the mesh.
    corner : (N, 2) int array
        Column and row of the cell before each of them, in the tile with a margin of one cell.
    cell : (N, 2) int array
        Column and row of the cell that each of them lies in, in the tile.
    u, v : (N,) float arrays
        Their fractions of the way from its centre to the next one's, 0 to 1.
    """

    index: Indices
    corner: Indices
    cell: Indices
    u: Array
    v: Array

    def interpolate(self, values: Array) -> Array:
        """Values (channels, rows, columns) of the tile with its margin, at the vertices."""
        column, row = self.corner.T
        if not (self.u.any() or self.v.any()):
            on_centres: Array = values[:, row, column]
            return on_centres
        corners = ((row, column), (row, column + 1), (row + 1, column), (row + 1, column + 1))
        return bilinear.between((values[:, *corner] for corner in corners), self.u, self.v)


class LiveGround:
    """Writes a height field and the age of its contacts to the ground of a scene, where it changed.

    While it is at work the mesh is one with a bake on it, so that `ground_mesh.restore` takes everything away again,
    in this session or after a crash.

    Parameters
    ----------
    place : Place
        Its display mesh carries no bake.
    unit_scale : float
        Metres per Blender unit.
    frame : GroundFrame, optional
        That the place is in.
    """

    def __init__(self, place: Place, unit_scale: float, frame: GroundFrame | None) -> None:
        ground = settings.resolve(place.display_mesh)
        self._name = place.display_mesh
        self._vertices, self._places = place.index, Places(*place.position[:, :2].T)
        self._up = ground_surface.up_of(ground, unit_scale, frame)
        self._known: dict[Tile, _TileVertices] = {}
        self._reached: Indices = np.empty(0, np.intp)  # vertices over the known tiles
        self.take_from(ground)

    def put_on(self, place: Place) -> bpy.types.Object:
        """Show its place, which has no prints yet; returns the ground."""
        nothing, no_prints = GroundSample(*np.empty((5, 0))), record.dump(record.BakeRecord([], {}))
        empty, ground = np.empty(0, np.intp), settings.resolve(place.display_mesh)
        # No shape keys: Blender would evaluate them on the whole mesh at each frame.
        ground_mesh.write(ground, empty, nothing, no_prints, self._up, shape_keys=False)
        shown = place.publish()
        self._name = settings.name_of(shown)
        return shown

    def take_from(self, ground: bpy.types.Object) -> None:
        """Start from the mesh as it is now; it is written as a whole when it is shown next."""
        mesh = ground_mesh.mesh_of(ground)
        self._rest = ground_mesh.rest_positions(mesh)
        self._display = self._rest.copy()
        self._shading = np.zeros((2, len(self._rest)), dtype=np.float32)
        self._contact = np.full(len(self._rest), -np.inf, dtype=np.float32)
        self._age = np.full(len(self._rest), NEVER, dtype=np.float32)
        self._is_written = False

    def forget_cells(self) -> None:
        """Look up anew which vertices lie in which cells, as their size is another."""
        self._known = {}
        self._reached = np.empty(0, np.intp)

    def object(self, likely: bpy.types.Object | None) -> bpy.types.Object | None:
        """The ground, which mostly is a likely one; None if it is gone or no longer as live mode made it."""
        is_it = likely is not None and likely.session_uid == self._name.uid
        ground = likely if is_it else settings.find(self._name)
        if ground is None:
            return None
        mesh = ground_mesh.mesh_of(ground)
        intact = ground_mesh.is_baked(ground) and len(mesh.vertices) == len(self._rest)
        return ground if intact and settings.exists(ground) else None

    def show(
        self, ground: bpy.types.Object, playhead: Playhead, windows: Sequence[Window], sigma: float, frame_rate: float
    ) -> None:
        """Bring the mesh to the state of a playhead's ground in some windows.

        Parameters
        ----------
        windows : sequence of Window
            Where its ground may have changed.
        sigma : float
            Standard deviation of the display blur [m].
        frame_rate : float
            Scene frames per second [Hz].
        """
        for _ in self.updating(playhead, windows, sigma):
            pass
        mesh = ground_mesh.mesh_of(ground)
        if not self._is_written:
            for name, values in zip((ground_mesh.COMPRESSION, ground_mesh.RIM), self._shading, strict=True):
                _write(mesh, name, values)
            ground_mesh.write_positions(mesh, self._display)
            self._is_written = True
        since = (playhead.frame - self._contact[self._reached]) / frame_rate
        self._age[self._reached] = np.where(np.isfinite(since), since, NEVER)
        _write(mesh, ground_mesh.AGE, self._age)

    def updating(self, playhead: Playhead, windows: Sequence[Window], sigma: float) -> Slices[None]:
        """Work out what `show` writes in some windows; the mesh stays as it is."""
        field = playhead.ground
        margin = len(gaussian_kernel(sigma / field.cell_size)) // 2 + 1
        for tile in _tiles_of(windows, margin):
            self._is_written = False
            vertices = self._vertices_of(tile, field.cell_size)
            if len(vertices.index):
                window = Window(tile[0] * TILE, tile[1] * TILE, TILE, TILE)
                self._update(field, window, vertices, sigma)
                column, row = vertices.cell.T
                self._contact[vertices.index] = playhead.contact.read(window)[0, row, column]
            yield

    def _vertices_of(self, tile: Tile, cell_size: float) -> _TileVertices:
        """The vertices over a tile, looked up once."""
        if tile not in self._known:
            inside = self._places.within(Window(tile[0] * TILE, tile[1] * TILE, TILE, TILE), cell_size)
            along, corner_of_tile = self._places.at(inside) / cell_size, np.array(tile) * TILE
            at = along - corner_of_tile + 0.5  # from the centre of the cell before it
            if np.abs(at - np.rint(at)).max(initial=0.0) < ON_CENTRE:
                at = np.rint(at)
            corner = np.clip(np.floor(at).astype(np.intp), 0, TILE)
            cell = np.floor(along).astype(np.intp) - corner_of_tile
            self._known[tile] = _TileVertices(self._vertices[inside], corner, cell, *(at - corner).T)
            self._reached = np.concatenate([self._reached, self._vertices[inside]])
        return self._known[tile]

    def _update(self, field: HeightField, tile: Window, vertices: _TileVertices, sigma: float) -> None:
        # Whole tiles, so that the rounding of a height does not depend on what else has changed.
        compression, rim = vertices.interpolate(blurred_window(field, tile.expanded(1), sigma))
        index = vertices.index
        self._display[index] = self._rest[index] + (rim - compression)[:, None] * self._up
        self._shading[:, index] = compression, rim


def _write(mesh: bpy.types.Mesh, name: str, values: NDArray[np.float32]) -> None:
    """Set an attribute of all vertices (V,)."""
    attribute: Any = mesh.attributes[name]
    attribute.data.foreach_set("value", values)


def _tiles_of(windows: Sequence[Window], margin: int) -> list[Tile]:
    """The tiles that windows with a margin around them reach into."""
    tiles = set()
    for window in windows:
        around = window.expanded(margin)
        columns = range(around.column // TILE, (around.column + around.columns - 1) // TILE + 1)
        rows = range(around.row // TILE, (around.row + around.rows - 1) // TILE + 1)
        tiles |= {(column, row) for column in columns for row in rows}
    return sorted(tiles)
