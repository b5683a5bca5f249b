"""A bake as image sequences in the ground's UV space: displacement and masks, for other programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import product
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.composers.relief_plan import relief_at
from ...core.debris.fallout import Fallout
from ...core.errors import InputError
from ...core.files.files import replacing
from ...core.meshing.uv_raster import Pixels, rasterise
from ...core.motion.ground_frame import GroundFrame
from ...core.numerics.arrays import Array, Indices
from ...core.numerics.triangles import barycentric
from ...core.playback.vertex_histories import VertexHistories, vertex_histories
from ...core.record.footprints import NEVER, Footprint, extent
from ...core.relief.steps import water_at
from ...core.rig.recording import SceneUnits
from .. import mesh_arrays
from ..carried import marks_object
from ..debris import debris_object
from ..ground import baked_ground, ground_surface, refined_mesh
from ..weather import weathered_points
from .exports import baked_display_mesh, counted, written_by_blender
from .mark_images import FloorImage, floor_images

DISPLACEMENT, MASK, WEATHER, DEBRIS, MARKS = "displacement", "mask", "weather", "debris", "marks"
"""Change of height [m] in all channels; compression [m], rim [m], age [s] in red, green, blue; where there is weather,
wetness and fresh snow, 0 to 1, and depth of standing water [m]; with debris, its volume over area [m], the share that
it covers, 0 to 1, and the time since it came down [s], `NEVER` where none did; of floors, see `FloorImage.at`."""
FINEST_FALLOUT = 0.01
"""Least side of the squares over which debris is summed [m]; in coarse images it is that of a pixel."""
FARTHEST_FALLOUT = 3.0
"""Largest distance of exported debris from all prints [m]."""

STRAY = 0.02
"""Largest distance of a pixel from a footprint's cells in the look-up [m]."""

PROBES = 64
"""Cells of a footprint that are looked up in the UV map before it is used, about."""


def export_images(
    ground: bpy.types.Object,
    folder: Path,
    start: int,
    end: int,
    *,
    units: SceneUnits,
    resolution: int = 2048,
    uv_map: str = "",
    name: str = "",
    floors: Sequence[bpy.types.Object] = (),
) -> list[Path]:
    """Write displacement and masks as OpenEXR sequences of 32-bit floats in the ground's UV space.

    Under weather that is shown, they are those of the weathered ground at each frame.

    Parameters
    ----------
    ground : bpy.types.Object
        Its own UV map is used, also where the detail along the trail carries the bake.
    folder : Path
        Gets `<name>_displacement_<frame>.exr` and `<name>_mask_<frame>.exr`, and under weather
        `<name>_weather_<frame>.exr`, and of steps that throw `<name>_debris_<frame>.exr`.
    start, end : int
        First and last frame.
    units : SceneUnits
        Of the ground's scene.
    resolution : int
        Width and height [pixels].
    uv_map : str
        Name of the UV map; by default the one that is rendered.
    name : str
        Beginning of the files' names; by default the ground's name.
    floors : sequence of bpy.types.Object, optional
        Hard ground; of each that has a UV map and marks, `<name>_marks_<floor>_<frame>.exr`.

    Raises
    ------
    InputError
        If there is no bake, no such UV map, prints lie outside of its image, or the files cannot be written.
    """
    weathered = weathered_points.has_weather(baked_display_mesh(ground))
    footprints, about = baked_ground.load(ground)
    sigma = baked_ground.baked_with(about, "blur_sigma")
    reach = STRAY + 4 * (float(np.hypot(sigma, weathered_points.BLUR)) if weathered else sigma)
    thrown = debris_object.of(ground)
    fallen = debris_object.at_rest(thrown, units) if thrown is not None else None
    if fallen is not None:
        reach = max(reach, _farthest(footprints, fallen.place))
    if weathered and about["inputs"].get("regions"):  # open ground is not the same everywhere
        reach = max(reach, baked_display_mesh(ground).dimensions.length * units.unit_scale_m)
    solved_in = baked_ground.frame_in(about["inputs"])
    pixels = _pixels(ground, units.unit_scale_m, footprints, reach, resolution, uv_map, solved_in)
    # Last comes a place that no footprint reaches: as it is, so is all the ground around.
    far = max(((each.window.column + each.window.columns) * each.cell_size for each in footprints), default=0.0)
    position = np.append(pixels.position, [(far + 2 * reach, 0.0, 0.0)], axis=0)
    x, y, _ = position.T
    relief = relief_at(footprints, x, y, about["inputs"], blur_sigma=sigma)
    over_time = vertex_histories(footprints, x, y, blur_sigma=sigma, relief=relief)
    if not folder.is_dir():
        raise InputError(f"There is no folder '{folder}': create it first, or choose another.")
    fallout = None
    if fallen is not None:
        # No finer than the pixels, which lie beside each other mostly: none falls between them.
        pixel = np.median(np.linalg.norm(np.diff(pixels.position, axis=0), axis=1)) if len(x) > 2 else 0.0
        cell_size = max(FINEST_FALLOUT, float(pixel), footprints[0].cell_size if footprints else 0.0)
        fallout = Fallout(fallen.place, fallen.radius, fallen.landed, position[:, :2], cell_size)
    stem = name or bpy.path.clean_name(ground.name)
    paths = []
    with ExitStack() as open_:
        image, at = open_.enter_context(_image(resolution)), None
        if weathered:
            water = water_at(relief, len(x))
            points = weathered_points.weathered_points(ground, position, over_time, water, units.unit_scale_m)
            at = open_.enter_context(points)
        for frame in counted(start, end):
            height, compression = over_time.movement.at(frame, len(x)).T
            rim, age = np.maximum(height + compression, 0.0), _age(over_time, frame, len(x), units.frame_rate)
            kinds: dict[str, tuple[Array, ...]] = {}
            if at is not None:
                now = at(frame, height, compression, rim)
                height, compression, rim = now.height, now.compression, now.rim
                kinds = {WEATHER: (now.wetness, now.fresh, now.water)}
            if fallout is not None:
                thickness, cover, latest = fallout.at(frame)
                since = np.where(np.isfinite(latest), (frame - latest) / units.frame_rate, NEVER)
                kinds |= {DEBRIS: (thickness, cover, since)}
            for kind, channels in {DISPLACEMENT: (height,) * 3, MASK: (compression, rim, age), **kinds}.items():
                path = folder / f"{stem}_{kind}_{frame:04d}.exr"
                _save(image, resolution, pixels.index, np.stack(channels, axis=-1), path)
                paths.append(path)
        for each, frame in product(_marked(ground, floors, units, resolution), range(start, end + 1)):
            path = folder / f"{stem}_{MARKS}_{bpy.path.clean_name(each.floor)}_{frame:04d}.exr"
            _save(image, resolution, each.index, each.at(frame), path)
            paths.append(path)
    return paths


def _marked(
    ground: bpy.types.Object, floors: Sequence[bpy.types.Object], units: SceneUnits, resolution: int
) -> Iterator[FloorImage]:
    """Images of the marks that a ground has."""
    marks = marks_object.of(ground)
    if marks is not None and marks_object.has_numbers(marks):
        yield from floor_images(marks, floors, units, resolution)


def kinds_of(ground: bpy.types.Object) -> tuple[str, ...]:
    """The kinds of images that are written of a ground."""
    weathered = weathered_points.has_weather(baked_ground.display_mesh_of(ground))
    thrown = debris_object.of(ground) is not None
    return (DISPLACEMENT, MASK, *((WEATHER,) if weathered else ()), *((DEBRIS,) if thrown else ()))


def _farthest(footprints: Sequence[Footprint], place: Array) -> float:
    """Largest distance of debris from the box around all footprints, `FARTHEST_FALLOUT` at most [m]."""
    if not footprints or not len(place):
        return 0.0
    low, high = extent(footprints)
    away = np.maximum(low - place, place - high).max(axis=1)
    return float(np.clip(away[away <= FARTHEST_FALLOUT].max(initial=0.0) + FINEST_FALLOUT, 0.0, FARTHEST_FALLOUT))


def _age(over_time: VertexHistories, frame: float, points: int, frame_rate: float) -> Array:
    contacts = over_time.contacts
    latest = np.full(points, -np.inf)
    begun = contacts.start <= frame
    np.maximum.at(latest, contacts.point[begun], np.minimum(contacts.end[begun], frame))
    return np.where(np.isfinite(latest), (frame - latest) / frame_rate, NEVER)


def _pixels(
    ground: bpy.types.Object,
    unit_scale: float,
    footprints: Sequence[Footprint],
    reach: float,
    resolution: int,
    uv_map: str,
    solved_in: GroundFrame | None,
) -> Pixels:
    """The pixels of the ground's UV map that lie near footprints, with their places."""
    with ground_surface.undisturbed_copy(ground) as mesh:
        layers = mesh.uv_layers
        layer = layers.get(uv_map) if uv_map else next((each for each in layers if each.active_render), None)
        if layer is None:
            wanted = f"no UV map '{uv_map}'" if uv_map else "no UV map"
            raise InputError(f"Ground '{ground.name}' has {wanted}: unwrap it first (Edit Mode, U), or choose another.")
        to_world = ground_surface.to_world_of(ground, unit_scale, solved_in)
        surface = refined_mesh.surface_of(mesh_arrays.read_faces(mesh), to_world)
        name, uv = layer.name, np.empty(len(mesh.loops) * 2, dtype=np.float32)
        layer.uv.foreach_get("vector", uv)
    corner = surface.vertices[surface.corner_vertex[surface.triangle_corners]]
    place = corner[..., :2]
    near = _near_footprints(footprints, reach, place)
    corners = uv.reshape(-1, 2).astype(np.float64)[surface.triangle_corners[near]]
    if _leaves_image(footprints, corners, place[near], 0.5 / resolution):
        raise InputError(
            f"Prints on ground '{ground.name}' would be missing, as UV map '{name}' has them outside of the image "
            "(0 to 1): choose a UV map that holds all of them, or unwrap another one."
        )
    return rasterise(corners, corner[near], resolution, resolution)


def _leaves_image(footprints: Sequence[Footprint], uv: Array, place: Array, slack: float) -> bool:
    """True if footprints reach triangles (T, 3, 2) at a place in the UV map outside of the image."""
    pokes_out = ((uv < -slack) | (uv > 1 + slack)).any(axis=(1, 2))
    uv, place = uv[pokes_out], place[pokes_out]
    for footprint in footprints if len(uv) else ():
        cells = footprint.contact_cells[:: len(footprint.contact_cells) // PROBES + 1]
        row, column = np.divmod(cells, footprint.window.columns)
        origin = (footprint.window.column + 0.5, footprint.window.row + 0.5)
        points = (np.stack([column, row], axis=-1) + origin) * footprint.cell_size
        near = ((place.max(axis=1) > points.min(axis=0)) & (place.min(axis=1) < points.max(axis=0))).all(axis=1)
        triangle = np.repeat(np.flatnonzero(near), len(points))
        u, v, inside = barycentric(place[triangle], np.tile(points, (np.count_nonzero(near), 1)))
        weights = np.stack([1 - u - v, u, v], axis=-1)[inside]
        at_uv = np.einsum("nk,nki->ni", weights, uv[triangle[inside]])
        if ((at_uv < -slack) | (at_uv > 1 + slack)).any():
            return True
    return False


def _near_footprints(footprints: Sequence[Footprint], reach: float, place: Array) -> NDArray[np.bool_]:
    """True for triangles (T, 3, 2) near the box around all footprints."""
    if not footprints:
        return np.zeros(len(place), dtype=bool)
    low, high = extent(footprints)
    inside = (place.max(axis=1) > low - reach) & (place.min(axis=1) < high + reach)
    return np.asarray(inside.all(axis=1))


@contextmanager
def _image(resolution: int) -> Iterator[Any]:
    image: Any = bpy.data.images.new("SoftGround", resolution, resolution, alpha=False, float_buffer=True, is_data=True)
    image.file_format = "OPEN_EXR"
    try:
        yield image
    finally:
        bpy.data.images.remove(image)


def _save(image: Any, resolution: int, index: Indices, channels: Array, path: Path) -> None:
    """Write channels (N + 1, 3) of pixels (N,), the last for all others."""
    pixels = np.empty((resolution**2, 4), dtype=np.float32)
    pixels[:, :3], pixels[:, 3] = channels[-1], 1.0
    pixels[index, :3] = channels[:-1]
    image.pixels.foreach_set(pixels.ravel())
    with replacing(path) as partial:
        image.filepath_raw = str(partial)
        with written_by_blender(partial, path):
            image.save()
