"""A bake for other programs, from its record: point cache, Alembic, USD, image sequences, a still mesh."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core import point_cache
from ..core.errors import InputError
from ..core.files import replacing
from ..core.histories import Histories, histories
from ..core.ramps import TOLERANCE
from ..core.uv_raster import Pixels, rasterise
from . import baked_ground, ground_mesh, playback, refined_mesh

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

CACHE_MODIFIER = "SoftGround Cache"

DISPLACEMENT, MASK = "displacement", "mask"
"""Image sequences: change of height [m] in all channels; and compression [m], rim [m], age [s] in red, green, blue."""

STRAY = 0.02
"""Pixels farther than this from any footprint's cells are left out of the look-up [m]."""


def export_point_cache(scene: bpy.types.Scene, ground: bpy.types.Object, path: Path, start: int, end: int) -> None:
    """Write the positions of the ground that carries the bake as a PC2 cache, one sample per frame.

    Raises
    ------
    InputError
        If there is no bake, its record is damaged, or the file cannot be written.
    """
    unit_scale = scene.unit_settings.scale_length
    carrier = _baked_carrier(ground)
    rest = ground_mesh.rest_positions(ground_mesh.mesh_of(carrier))
    world = ground_mesh.rest_vertices(carrier, unit_scale)
    moved = _moved_vertices(carrier)
    over_time = _histories(ground, *world[moved, :2].T)
    up = ground_mesh.up_of(carrier, unit_scale)

    def samples() -> Iterator[NDArray[np.float32]]:
        for frame in range(start, end + 1):
            height = over_time.heights.at(frame, len(moved))
            sample = rest.copy()
            sample[moved] += (height[:, None] * up).astype(np.float32)
            yield sample

    point_cache.write(path, samples(), start_frame=start, points=len(rest), count=end - start + 1)


def use_point_cache(ground: bpy.types.Object, path: Path, start: int) -> bpy.types.Modifier:
    """Let the ground that carries the bake play a PC2 cache in place of its native playback."""
    carrier = baked_ground.carrier_of(ground)
    modifier: Any = carrier.modifiers.get(CACHE_MODIFIER) or carrier.modifiers.new(CACHE_MODIFIER, "MESH_CACHE")
    modifier.cache_format, modifier.filepath, modifier.frame_start = "PC2", str(path), start
    modifier.deform_mode, modifier.interpolation = "OVERWRITE", "LINEAR"
    modifier.time_mode, modifier.play_mode = "FRAME", "SCENE"
    carrier.modifiers.move(list(carrier.modifiers).index(modifier), 0)
    played = playback.modifier_of(carrier)
    if played:
        played.show_viewport = played.show_render = False
    return modifier


def export_alembic(scene: bpy.types.Scene, ground: bpy.types.Object, path: Path, start: int, end: int) -> None:
    """Write the ground that carries the bake as Alembic, with Blender's exporter.

    Raises
    ------
    InputError
        If there is no bake, or the file cannot be written.
    """
    with _only(scene, ground, start, end), replacing(path) as partial:
        options = {
            "selected": True,
            "start": start,
            "end": end,
            "as_background_job": False,
            "export_custom_properties": False,
        }
        _run(bpy.ops.wm.alembic_export, partial, path, **options)


def export_usd(scene: bpy.types.Scene, ground: bpy.types.Object, path: Path, start: int, end: int) -> None:
    """Write the ground that carries the bake as USD, with Blender's exporter.

    Raises
    ------
    InputError
        If there is no bake, or the file cannot be written.
    """
    with _only(scene, ground, start, end), replacing(path) as partial:
        options = {
            "selected_objects_only": True,
            "export_animation": True,
            "export_shapekeys": False,  # else the finished ground is written, with nothing that moves
            "export_materials": False,
            "export_custom_properties": False,
        }
        _run(bpy.ops.wm.usd_export, partial, path, **options)


def export_images(
    scene: bpy.types.Scene,
    ground: bpy.types.Object,
    folder: Path,
    start: int,
    end: int,
    *,
    resolution: int = 2048,
    uv_map: str = "",
) -> list[Path]:
    """Write displacement and mask as OpenEXR sequences of 32-bit floats in the ground's UV space.

    Parameters
    ----------
    scene : bpy.types.Scene
    ground : bpy.types.Object
        Its own UV map is used, also where the detail along the trail carries the bake.
    folder : Path
        Gets `<ground>_displacement_<frame>.exr` and `<ground>_mask_<frame>.exr`.
    start, end : int
        First and last frame.
    resolution : int
        Width and height [pixels].
    uv_map : str
        Name of the UV map; by default the one that is rendered.

    Raises
    ------
    InputError
        If there is no bake, no such UV map, or the files cannot be written.
    """
    pixels = _pixels(scene, ground, resolution, uv_map)
    over_time = _histories(ground, *pixels.position.T)
    if not folder.is_dir():
        raise InputError(f"There is no folder '{folder}': create it first, or choose another.")
    paths = []
    with _image(resolution) as image:
        for frame in range(start, end + 1):
            height = over_time.heights.at(frame, len(pixels.index))
            compression = over_time.compression.at(frame, len(pixels.index))
            age = _age(over_time, frame, len(pixels.index), scene)
            mask = np.stack([compression, np.maximum(height + compression, 0.0), age], axis=-1)
            for name, channels, empty in (
                (DISPLACEMENT, np.repeat(height[:, None], 3, axis=1), (0.0, 0.0, 0.0)),
                (MASK, mask, (0.0, 0.0, -1.0)),
            ):
                path = folder / f"{bpy.path.clean_name(ground.name)}_{name}_{frame:04d}.exr"
                _save(image, resolution, pixels.index, channels, empty, path)
                paths.append(path)
    return paths


def final_mesh(scene: bpy.types.Scene, ground: bpy.types.Object) -> bpy.types.Object:
    """A new object with the ground as it stands at the end of the bake: a plain mesh, no modifiers or shape keys.

    Raises
    ------
    InputError
        If there is no bake.
    """
    carrier = _baked_carrier(ground)
    mesh = ground_mesh.mesh_of(carrier).copy()
    still = bpy.data.objects.new(f"{ground.name} Final", mesh)
    shown = ground_mesh.displayed_positions(carrier)
    still.shape_key_clear()
    ground_mesh.write_positions(mesh, shown)
    for name in [attribute.name for attribute in mesh.attributes]:
        if name == ground_mesh.REST or playback.is_playback_attribute(name):
            mesh.attributes.remove(mesh.attributes[name])
    for key in ground_mesh.PROPERTIES:
        mesh.pop(key, None)
    still.matrix_world = carrier.matrix_world
    scene.collection.objects.link(still)
    return still


def _baked_carrier(ground: bpy.types.Object) -> bpy.types.Object:
    carrier = baked_ground.carrier_of(ground)
    if not ground_mesh.is_baked(carrier):
        raise InputError(f"There is no bake on ground '{ground.name}': press Bake Footprints first.")
    return carrier


def _histories(ground: bpy.types.Object, x: Array, y: Array) -> Histories:
    """The record seen from places, as it is played."""
    footprints, about = baked_ground.load(ground)
    return histories(footprints, x, y, blur_sigma=baked_ground.blur_sigma_of(about), tolerance=TOLERANCE)


def _moved_vertices(carrier: bpy.types.Object) -> Indices:
    """Vertices that the playback moves."""
    return playback.moved_vertices(ground_mesh.mesh_of(carrier))


def _age(over_time: Histories, frame: float, points: int, scene: bpy.types.Scene) -> Array:
    visits = over_time.visits
    latest = np.full(points, -np.inf)
    begun = visits.start <= frame
    np.maximum.at(latest, visits.point[begun], np.minimum(visits.end[begun], frame))
    rate = scene.render.fps / scene.render.fps_base
    return np.where(np.isfinite(latest), (frame - latest) / rate, -1.0)


def _pixels(scene: bpy.types.Scene, ground: bpy.types.Object, resolution: int, uv_map: str) -> Pixels:
    """The pixels of the ground's UV map that lie near footprints, and where."""
    _baked_carrier(ground)
    with ground_mesh.undisturbed_copy(ground) as mesh:
        layers = mesh.uv_layers
        layer = layers.get(uv_map) if uv_map else next((one for one in layers if one.active_render), None)
        if layer is None:
            wanted = f"no UV map '{uv_map}'" if uv_map else "no UV map"
            raise InputError(f"Ground '{ground.name}' has {wanted}: unwrap it first (Edit Mode, U), or choose another.")
        surface = refined_mesh.surface_of(mesh, ground_mesh.to_world_of(ground, scene.unit_settings.scale_length))
        uv = np.empty(len(mesh.loops) * 2, dtype=np.float32)
        layer.uv.foreach_get("vector", uv)
    place = surface.vertices[surface.corner_vertex[surface.triangle_corners], :2]
    near = _near_footprints(ground, place)
    corners = uv.reshape(-1, 2).astype(np.float64)[surface.triangle_corners[near]]
    return rasterise(corners, place[near], resolution, resolution)


def _near_footprints(ground: bpy.types.Object, place: Array) -> NDArray[np.bool_]:
    """Which triangles (T, 3, 2) reach into the box around all footprints."""
    footprints, about = baked_ground.load(ground)
    if not footprints:
        return np.zeros(len(place), dtype=bool)
    reach = STRAY + 4 * baked_ground.blur_sigma_of(about)
    low = np.min([(one.window.column * one.cell_size, one.window.row * one.cell_size) for one in footprints], axis=0)
    high = np.max(
        [
            ((w.column + w.columns) * one.cell_size, (w.row + w.rows) * one.cell_size)
            for one in footprints
            for w in (one.window,)
        ],
        axis=0,
    )
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


def _save(
    image: Any, resolution: int, index: Indices, channels: Array, empty: tuple[float, float, float], path: Path
) -> None:
    pixels = np.empty((resolution**2, 4), dtype=np.float32)
    pixels[:, :3], pixels[:, 3] = empty, 1.0
    pixels[index, :3] = channels
    image.pixels.foreach_set(pixels.ravel())
    with replacing(path) as partial:
        image.filepath_raw = str(partial)
        try:
            image.save()
        except RuntimeError as error:
            raise InputError(f"'{path}' could not be written: {str(error).strip()}") from None


@contextmanager
def _only(scene: bpy.types.Scene, ground: bpy.types.Object, start: int, end: int) -> Iterator[None]:
    """The carrier as all that is selected, and its frames as the scene's; as it was before, afterwards."""
    carrier = _baked_carrier(ground)
    layer = bpy.context.view_layer
    if carrier.name not in layer.objects:
        raise InputError(f"'{carrier.name}' is not in the current view layer: include its collection first.")
    selected = [thing for thing in layer.objects if thing.select_get()]
    active, frames, frame = layer.objects.active, (scene.frame_start, scene.frame_end), scene.frame_current
    try:
        for thing in selected:
            thing.select_set(False)
        carrier.select_set(True)
        scene.frame_start, scene.frame_end = start, end
        yield
    finally:
        carrier.select_set(False)
        for thing in selected:
            thing.select_set(True)
        layer.objects.active = active
        scene.frame_start, scene.frame_end = frames
        scene.frame_set(frame)


def _run(export: Any, partial: Path, path: Path, **options: Any) -> None:
    try:
        result = export(filepath=str(partial), check_existing=False, **options)
    except RuntimeError as error:
        raise InputError(f"'{path}' could not be written: {str(error).strip()}") from None
    if "FINISHED" not in result or not partial.is_file():
        raise InputError(f"'{path}' could not be written by Blender's exporter: see its messages.")
