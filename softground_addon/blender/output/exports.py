"""A bake as a mesh for other programs: point cache, Alembic, USD, and the finished ground as it stands.

All write the open scene, as Blender's exporters do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...core.composers import relief_plan
from ...core.errors import InputError
from ...core.files import point_cache
from ...core.files.files import check_not_full, check_room, replacing
from ...core.playback import vertex_histories as histories
from ..carried import marks_object
from ..debris import debris_object
from ..ground import baked_ground, ground_mesh, ground_surface
from ..playback import display_key, own_data, playback, weather_modifier
from . import debris_points

BYTES_OF_A_POINT = 24
"""Size of a piece of debris in a frame of Alembic: place and velocity."""


def export_point_cache(ground: bpy.types.Object, path: Path, start: int, end: int) -> None:
    """Write the positions of the ground that carries the bake as a PC2 cache, one sample per frame.

    Raises
    ------
    InputError
        If there is no bake, its record is damaged, or the file cannot be written.
    """
    unit_scale = bpy.context.scene.unit_settings.scale_length
    display_mesh = baked_display_mesh(ground)
    rest = ground_mesh.rest_positions(ground_mesh.mesh_of(display_mesh))
    moved = playback.moved_vertices(ground_mesh.mesh_of(display_mesh))
    footprints, about = baked_ground.load(ground)
    frame_of_bake = baked_ground.frame_in(about["inputs"])
    world = ground_surface.rest_vertices(display_mesh, unit_scale, frame_of_bake)[moved]
    sigma = baked_ground.baked_with(about, "blur_sigma")
    x, y = world[:, :2].T
    relief = relief_plan.relief_at(footprints, x, y, about["inputs"], blur_sigma=sigma)
    over_time = histories.vertex_histories(footprints, x, y, blur_sigma=sigma, relief=relief)
    up = ground_surface.up_of(display_mesh, unit_scale, frame_of_bake)

    def samples() -> Iterator[NDArray[np.float32]]:
        for frame in counted(start, end):
            height = over_time.movement.at(frame, len(moved))[:, :1]
            sample = rest.copy()
            sample[moved] += (height * up).astype(np.float32)
            yield sample

    point_cache.write(path, samples(), start_frame=start, points=len(rest), count=end - start + 1)


def export_alembic(ground: bpy.types.Object, path: Path, start: int, end: int) -> None:
    """Write the ground that carries the bake, and its debris as points, as Alembic, with Blender's exporter.

    Raises
    ------
    InputError
        If there is no bake, or the file cannot be written.
    """
    display_mesh = baked_display_mesh(ground)
    with (
        _only(display_mesh, start, end, marks_object.of(ground)),
        debris_points.selected(ground, clouds=False),
        replacing(path) as partial,
    ):
        shown = display_mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
        frames, debris = end - start + 1, debris_object.of(ground)
        size = size_of_alembic(ground_mesh.mesh_of(shown), frames)
        if debris is not None:
            size += frames * BYTES_OF_A_POINT * len(ground_mesh.mesh_of(debris).vertices)
        if (marks := marks_object.of(ground)) is not None:
            size += frames * size_of_alembic(ground_mesh.mesh_of(marks), 1)  # there are more from frame to frame
        check_room(path, size)  # else Blender ends
        options = {
            "selected": True,
            "start": start,
            "end": end,
            "orcos": False,  # generated coordinates, at each frame anew as the mesh's bounds change
            "apply_subdiv": True,  # else the ground is written without its last modifier where that subdivides
            "as_background_job": False,
            "export_custom_properties": False,
        }
        _run(bpy.ops.wm.alembic_export, partial, path, **options)


def size_of_alembic(mesh: bpy.types.Mesh, frames: int) -> int:
    """Size of an Alembic file with the mesh at some frames, at most [bytes].

    Each frame holds positions and, of a mesh that is not smooth, the normals at its corners.
    """
    vertices, corners, maps = len(mesh.vertices), len(mesh.loops), len(mesh.uv_layers)
    normals = 0 if mesh.normals_domain == "POINT" else corners
    vector, number, rest_of_frame = 12, 4, 512
    once = vector * vertices + number * (corners + len(mesh.polygons)) + maps * 3 * number * corners
    return once + frames * (vector * (vertices + normals) + rest_of_frame)


def export_usd(ground: bpy.types.Object, path: Path, start: int, end: int) -> None:
    """Write the ground that carries the bake, and its debris as points, as USD, with Blender's exporter.

    Raises
    ------
    InputError
        If there is no bake, a frame is negative, or the file cannot be written.
    """
    if start < 0:
        raise InputError(
            f"Blender writes USD from frame 0 on, not from {start}: give another first frame, or export Alembic."
        )
    with (
        _only(baked_display_mesh(ground), start, end, marks_object.of(ground)),
        debris_points.selected(ground, clouds=True),
        replacing(path) as partial,
    ):
        options = {
            "selected_objects_only": True,
            "export_subdivision": "TESSELLATE",
            "export_animation": True,
            "export_shapekeys": False,  # else the finished ground is written, with nothing that moves
            "export_materials": False,
            "convert_world_material": False,  # else the world comes along as a light, with an image beside the file
            "export_custom_properties": False,
        }
        _run(bpy.ops.wm.usd_export, partial, path, **options)


def final_mesh(ground: bpy.types.Object) -> bpy.types.Object:
    """A new object of the open scene: the ground as it stands at the end of the bake, without modifiers or shape keys.

    The mesh includes the user's modifiers, and the weather by the last frame of the scene, or of the bake if that is
    later.

    Raises
    ------
    InputError
        If there is no bake.
    """
    display_mesh = baked_display_mesh(ground)
    mesh = ground_mesh.mesh_of(display_mesh).copy()
    display_key.drop_all(mesh)
    ground_mesh.write_positions(mesh, ground_mesh.displayed_positions(display_mesh))
    of_playing = own_data.made(mesh) & {own_data.REST, *own_data.OF_PLAYBACK, *own_data.OF_WEATHER}
    weather = weather_modifier.modifier_of(display_mesh)
    last = _last_frame(ground) if weather and weather.show_viewport else None
    if last is not None or any(item.show_viewport for item in ground_mesh.users_modifiers(display_mesh)):
        with ground_surface.stand_in(display_mesh, mesh, weather_at=last) as evaluated:
            plain, mesh = mesh, bpy.data.meshes.new_from_object(evaluated)
        mesh.name = plain.name
        bpy.data.meshes.remove(plain)
    for name in of_playing.intersection(mesh.attributes.keys()):  # those for shading stay
        mesh.attributes.remove(mesh.attributes[name])
    still = bpy.data.objects.new(f"{ground.name} Final", mesh)
    for key in own_data.PROPERTIES:
        mesh.pop(key, None)
    still.matrix_world = Matrix(ground_surface.to_world_of(display_mesh, 1.0).tolist())
    bpy.context.scene.collection.objects.link(still)
    return still


def _last_frame(ground: bpy.types.Object) -> int:
    """Last frame of the open scene, or of the bake if that is later."""
    return math.ceil(max(bpy.context.scene.frame_end, baked_ground.load(ground)[1]["inputs"]["frames"][1]))


def export_final(ground: bpy.types.Object, path: Path) -> None:
    """Write the ground as it stands at the end of the bake as Wavefront OBJ, with Blender's exporter.

    Raises
    ------
    InputError
        If there is no bake, or the file cannot be written.
    """
    still, scene = final_mesh(ground), bpy.context.scene
    mesh = ground_mesh.mesh_of(still)
    try:
        with _only(still, scene.frame_start, scene.frame_end), replacing(path) as partial:
            _run(bpy.ops.wm.obj_export, partial, path, export_selected_objects=True, export_materials=False)
    finally:
        bpy.data.objects.remove(still)
        bpy.data.meshes.remove(mesh)


def baked_display_mesh(ground: bpy.types.Object) -> bpy.types.Object:
    """The object that carries the ground's bake.

    Raises
    ------
    InputError
        If there is no bake.
    """
    display_mesh = baked_ground.display_mesh_of(ground)
    if not ground_mesh.is_baked(display_mesh):
        raise InputError(f"There is no bake on ground '{ground.name}': press Bake Footprints first.")
    return display_mesh


def counted(start: int, end: int) -> Iterator[int]:
    """The frames of a file that is written, with the progress at the mouse cursor."""
    with _progress(start, end) as show:
        for frame in range(start, end + 1):
            yield frame
            show(frame)


@contextmanager
def _progress(start: int, end: int) -> Iterator[Callable[[int], None]]:
    """Progress at the mouse cursor, by a function of the frame that is done."""

    def show(frame: int) -> None:
        if start <= frame <= end:
            _show((frame - start + 1) / (end - start + 1))

    manager = bpy.context.window_manager
    manager.progress_begin(0.0, 1.0)
    try:
        yield show
    finally:
        manager.progress_end()


def _show(done: float) -> None:
    bpy.context.window_manager.progress_update(done)


@contextmanager
def _only(
    display_mesh: bpy.types.Object, start: int, end: int, marks: bpy.types.Object | None = None
) -> Iterator[None]:
    """An object as all that is selected, shown if it is hidden, with its marks if these are shown, and the frames as
    those of the open scene; then all as before."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    layer.update()
    if display_mesh.name not in layer.objects:
        raise InputError(f"'{display_mesh.name}' is not in the current view layer: include its collection first.")
    hidden = display_mesh.hide_get(), display_mesh.hide_viewport, display_mesh.hide_render
    selected = [obj for obj in layer.objects if obj.select_get()]
    active, frames = layer.objects.active, (scene.frame_start, scene.frame_end)
    frame, subframe = scene.frame_current, scene.frame_subframe
    try:
        for obj in selected:
            obj.select_set(False)
        display_mesh.hide_viewport = display_mesh.hide_render = False
        layer.update()
        display_mesh.hide_set(False)
        display_mesh.select_set(True)
        if not display_mesh.select_get():
            raise InputError(f"'{display_mesh.name}' is hidden with its collection: show the collection first.")
        if marks is not None and marks.name in layer.objects:
            marks.select_set(True)
        scene.frame_start, scene.frame_end = start, end
        yield
    finally:
        for obj in [obj for obj in (display_mesh, marks) if obj is not None and obj.name in layer.objects]:
            obj.select_set(False)
        display_mesh.hide_set(hidden[0])
        display_mesh.hide_viewport, display_mesh.hide_render = hidden[1:]
        for obj in selected:
            obj.select_set(True)
        layer.objects.active = active
        scene.frame_start, scene.frame_end = frames
        scene.frame_set(frame, subframe=subframe)


def _run(export: Any, partial: Path, path: Path, **options: Any) -> None:
    scene, result = bpy.context.scene, set()
    changed = bpy.app.handlers.frame_change_post
    with _progress(scene.frame_start, scene.frame_end) as show, written_by_blender(partial, path):
        changed.append(on_frame := lambda changing, *_: show(changing.frame_current))
        try:
            result = export(filepath=str(partial), check_existing=False, **options)
        finally:
            changed.remove(on_frame)
    if "FINISHED" not in result or not partial.is_file():
        raise InputError(f"'{path}' could not be written by Blender's exporter: see its messages.")


@contextmanager
def written_by_blender(partial: Path, path: Path) -> Iterator[None]:
    """Errors of Blender's writers as exceptions, also that of a full disk, which many of them do not report.

    Raises
    ------
    InputError
        If Blender reports an error.
    OSError
        If the disk is full.
    """
    failed = ""
    try:
        yield
    except RuntimeError as error:
        failed = str(error).strip()
    if partial.is_file():
        check_not_full(partial)
    if failed:
        raise InputError(f"'{path}' could not be written: {failed}")
