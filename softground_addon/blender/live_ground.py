"""The ground's mesh while live mode is on: heights of a few cells written as the timeline moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core import record
from ..core.heightfield import TILE, HeightField, Window
from ..core.pressed_ground import GroundSample
from ..core.smoothing import blurred_window, gaussian_kernel
from . import bake_job, ground_mesh

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class LiveGround:
    """Writes a height field to the ground of a scene, where it changed.

    While it is at work the mesh is one with a bake on it, so that `ground_mesh.restore` takes everything away again,
    in this session or after a crash.

    Parameters
    ----------
    ground : bpy.types.Object
        Carries no bake.
    shot : bake_job.Shot
        Read from that ground.
    unit_scale : float
        Metres per Blender unit.
    """

    def __init__(self, ground: bpy.types.Object, shot: bake_job.Shot, unit_scale: float) -> None:
        self.uid = ground.session_uid
        self.name = ground.name
        vertices = shot.surface.vertices if shot.surface else ground_mesh.rest_vertices(ground, unit_scale)
        x, y, z = vertices.T
        near = ((vertices[:, :2] >= shot.plan.lower) & (vertices[:, :2] <= shot.plan.upper)).all(axis=1)
        near = np.flatnonzero(near)
        on_top = np.abs(z[near] - shot.terrain.heights(x[near], y[near])) < ground_mesh.ON_SURFACE
        self._vertices = near[on_top]
        self._place = vertices[self._vertices, :2]
        self._up = ground_mesh.up_of(ground, unit_scale)
        self._by_tile: dict[tuple[int, int], Indices] | None = None
        nothing = GroundSample(*np.empty((5, 0)))
        ground_mesh.write(ground, np.empty(0, np.intp), nothing, record.dump([], {}), unit_scale)
        self.take_from(ground)

    def take_from(self, ground: bpy.types.Object) -> None:
        """Start from the mesh as it is now."""
        mesh = ground_mesh.mesh_of(ground)
        self._rest = ground_mesh.rest_positions(mesh)
        self._raw, self._display = self._rest.copy(), self._rest.copy()
        self._shading = np.zeros((2, len(self._rest)), dtype=np.float32)

    def object(self) -> bpy.types.Object | None:
        """The ground, whatever its name has become; None if it is gone or no longer what live mode made of it."""
        found = bpy.data.objects.get(self.name)
        if found is None or found.session_uid != self.uid:
            found = next((thing for thing in bpy.data.objects if thing.session_uid == self.uid), None)
        if found is None:
            return None
        self.name = found.name
        mesh: Any = found.data
        intact = ground_mesh.is_baked(found) and mesh.shape_keys and len(mesh.vertices) == len(self._rest)
        return found if intact else None

    def show(self, ground: bpy.types.Object, field: HeightField, windows: Sequence[Window], sigma: float) -> None:
        """Bring the mesh to a height field's state in some windows.

        Parameters
        ----------
        ground : bpy.types.Object
        field : HeightField
        windows : sequence of Window
            Where it may have changed.
        sigma : float
            Standard deviation of the display blur [m].
        """
        margin = len(gaussian_kernel(sigma / field.cell_size)) // 2 + 1
        for window in _without_repeats(windows):
            around = window.expanded(margin)
            self._update(field, around, self._inside(around, field.cell_size), sigma)
        self._write(ground)

    def _inside(self, window: Window, cell_size: float) -> Indices:
        """Places that lie in a window, as numbers among those that may move."""
        if self._by_tile is None:
            self._by_tile = _grouped(np.floor(self._place / (TILE * cell_size)).astype(np.int64))
        columns = range(window.column // TILE, (window.column + window.columns - 1) // TILE + 1)
        rows = range(window.row // TILE, (window.row + window.rows - 1) // TILE + 1)
        none = np.empty(0, np.intp)
        found = np.concatenate([none, *(self._by_tile.get((i, j), none) for i in columns for j in rows)])
        low = np.array([window.column, window.row]) * cell_size
        high = low + np.array([window.columns, window.rows]) * cell_size
        place = self._place[found]
        return found[((place >= low) & (place <= high)).all(axis=1)]

    def _update(self, field: HeightField, window: Window, places: Indices, sigma: float) -> None:
        if not len(places):
            return
        larger = window.expanded(1)
        raw, smooth = field.read(larger), blurred_window(field, larger, sigma)
        at = self._place[places] / field.cell_size - (larger.column + 0.5, larger.row + 0.5)
        compression, rim = _bilinear(raw, at)
        smooth_compression, smooth_rim = _bilinear(smooth, at)
        vertices = self._vertices[places]
        rest, up = self._rest[vertices], self._up
        self._raw[vertices] = rest + (rim - compression)[:, None] * up
        self._display[vertices] = rest + (smooth_rim - smooth_compression)[:, None] * up
        self._shading[:, vertices] = smooth_compression, smooth_rim

    def _write(self, ground: bpy.types.Object) -> None:
        mesh = ground_mesh.mesh_of(ground)
        keys: Any = mesh.shape_keys
        keys.reference_key.points.foreach_set("co", self._raw.ravel())
        keys.key_blocks[ground_mesh.DISPLAY_KEY].points.foreach_set("co", self._display.ravel())
        for name, values in zip((ground_mesh.COMPRESSION, ground_mesh.RIM), self._shading, strict=True):
            mesh.attributes[name].data.foreach_set("value", values)
        ground_mesh.write_positions(mesh, self._raw)


def _grouped(tiles: NDArray[np.int64]) -> dict[tuple[int, int], Indices]:
    """Numbers of the places in each tile."""
    order = np.lexsort(tiles.T)
    ordered = tiles[order]
    borders = np.flatnonzero((np.diff(ordered, axis=0) != 0).any(axis=1)) + 1
    parts = [part for part in np.split(order, borders) if len(part)]
    return {(int(tiles[part[0], 0]), int(tiles[part[0], 1])): part for part in parts}


def _without_repeats(windows: Sequence[Window]) -> list[Window]:
    """The windows, with those that overlap joined into one."""
    joined: list[Window] = []
    for window in windows:
        united = window
        while other := next((other for other in joined if other.intersects(united)), None):
            joined.remove(other)
            united = united.union(other)
        joined.append(united)
    return joined


def _bilinear(values: Array, at: Array) -> Array:
    """Values (channels, rows, columns) between cells, at places (N, 2) in columns and rows."""
    left = np.clip(np.floor(at).astype(np.intp), 0, (values.shape[2] - 2, values.shape[1] - 2))
    u, v = (at - left).T
    column, row = left.T
    low = values[:, row, column] * (1 - u) + values[:, row, column + 1] * u
    high = values[:, row + 1, column] * (1 - u) + values[:, row + 1, column + 1] * u
    result: Array = low * (1 - v) + high * v
    return result
