"""How the grounds are shown: a low sun, trays around the grounds, a scale beside a print, cameras, Cycles."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from math import atan2, cos, pi, radians, sin
from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

SUN_ELEVATION = radians(12.0)
"""Low, so that prints of a centimetre cast shadows."""

_SUN_STRENGTH = 6.5  # W/m², against a sky of
_SKY_STRENGTH = 0.36
_SKIES = ("NISHITA", "MULTIPLE_SCATTERING", "SINGLE_SCATTERING", "HOSEK_WILKIE")  # the first that this Blender has

_FRAMING_MARGIN = 1.05  # how much larger than what it shows a picture is

_STILL, _HIDDEN = "softground_sample_still", "softground_sample_hidden"
"""Custom properties of what is in pictures only, and of what is left out of them."""

SCALE_LENGTH = 0.20
"""Length of the scale beside a print, in fields of a centimetre [m]."""


def set_up_rendering(scene: bpy.types.Scene) -> None:
    """Cycles on the CPU with few samples and a denoiser."""
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.use_adaptive_sampling = True
    scene.cycles.adaptive_threshold = 0.03
    scene.cycles.use_denoising = True
    scene.cycles.denoiser = "OPENIMAGEDENOISE"
    scene.cycles.max_bounces = 4
    scene.render.use_persistent_data = True
    scene.view_settings.look = "AgX - Medium High Contrast"
    scene.render.image_settings.quality = 90


def add_sun(scene: bpy.types.Scene, toward: float, elevation: float = SUN_ELEVATION) -> None:
    """A low warm sun with its sky, in place of an earlier one.

    `toward` is the direction in the plane in which the light travels [rad].
    """
    for earlier in [lamp for lamp in bpy.data.lights if lamp.type == "SUN"]:
        bpy.data.lights.remove(earlier)  # and the object with it
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.color, light.angle = _SUN_STRENGTH, (1.0, 0.86, 0.70), radians(1.0)
    sun = bpy.data.objects.new("Sun", light)
    ray = Vector((cos(elevation) * cos(toward), cos(elevation) * sin(toward), -sin(elevation)))
    sun.rotation_euler = ray.to_track_quat("-Z", "Y").to_euler()
    sun.location = -6.0 * ray
    scene.collection.objects.link(sun)

    world = bpy.data.worlds.new("Sky")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    nodes = world.node_tree.nodes
    background = next(node for node in nodes if node.type == "BACKGROUND")
    sky = nodes.new("ShaderNodeTexSky")
    known = sky.bl_rna.properties["sky_type"].enum_items.keys()
    sky.sky_type = next(kind for kind in _SKIES if kind in known)
    sky.sun_disc = False
    sky.sun_elevation = elevation
    sky.sun_rotation = pi / 2 - (toward + pi)  # clockwise from +Y
    world.node_tree.links.new(sky.outputs[0], background.inputs[0])
    background.inputs[1].default_value = _SKY_STRENGTH


def add_tray(ground: bpy.types.Object, collection: bpy.types.Collection) -> bpy.types.Object:
    """A board around a ground that hides its open edge."""
    low, high = bounds([ground])
    width, depth, lip = 0.035, 0.16, 0.012
    top, bottom = high[2] + lip, low[2] - depth
    inner = np.array([(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])])
    outer = inner + width * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    rings = [
        np.column_stack([ring, np.full(4, z)])
        for ring, z in ((inner, bottom), (inner, top), (outer, top), (outer, bottom))
    ]
    quads = [
        (4 * ring + i, 4 * ring + (i + 1) % 4, 4 * ((ring + 1) % 4) + (i + 1) % 4, 4 * ((ring + 1) % 4) + i)
        for ring in range(4)
        for i in range(4)
    ]
    mesh = bpy.data.meshes.new("Tray")
    mesh.from_pydata(np.concatenate(rings).tolist(), [], quads)
    mesh.materials.append(plain_material("SoftGround Sample tray", (0.16, 0.105, 0.065), 0.6))
    tray = bpy.data.objects.new("Tray", mesh)
    collection.objects.link(tray)
    return tray


def add_floor(height: float, collection: bpy.types.Collection) -> bpy.types.Object:
    """A wide plain floor to stand the trays on."""
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata([(x, y, height) for x, y in ((-90, -90), (90, -90), (90, 90), (-90, 90))], [], [(0, 1, 2, 3)])
    mesh.materials.append(plain_material("SoftGround Sample floor", (0.20, 0.20, 0.21), 0.9))
    floor = bpy.data.objects.new("Floor", mesh)
    collection.objects.link(floor)
    return floor


def add_scale(place: ArrayLike, heading: float, collection: bpy.types.Collection) -> bpy.types.Object:
    """A photographer's scale on the ground: fields of a centimetre, black and white by turns."""
    fields, width, thickness = round(SCALE_LENGTH * 100), 0.018, 0.004
    x = np.linspace(-SCALE_LENGTH / 2, SCALE_LENGTH / 2, fields + 1)
    profile = np.array([(-width / 2, 0), (-width / 2, thickness), (width / 2, thickness), (width / 2, 0)])
    vertices = [(along, y, z) for along in x for y, z in profile]
    quads = [
        (4 * i + j, 4 * (i + 1) + j, 4 * (i + 1) + (j + 1) % 4, 4 * i + (j + 1) % 4)
        for i in range(fields)
        for j in range(4)
    ]
    quads += [(0, 1, 2, 3), (4 * fields + 3, 4 * fields + 2, 4 * fields + 1, 4 * fields)]
    mesh = bpy.data.meshes.new("Scale")
    mesh.from_pydata(vertices, [], quads)
    mesh.materials.append(plain_material("SoftGround Sample white", (0.8, 0.8, 0.8), 0.6))
    mesh.materials.append(plain_material("SoftGround Sample black", (0.02, 0.02, 0.02), 0.6))
    for face in mesh.polygons:
        face.material_index = min(face.index // 4, fields - 1) % 2
    scale = bpy.data.objects.new("Scale", mesh)
    scale.location, scale.rotation_euler.z = Vector(place), heading
    collection.objects.link(scale)
    return scale


def plain_material(name: str, colour: tuple[float, float, float], roughness: float) -> bpy.types.Material:
    """A plain material of the sample scenes, made on first use."""
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        if material.node_tree is None:
            material.use_nodes = True
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = (*colour, 1.0)
        shader.inputs["Roughness"].default_value = roughness
        material.diffuse_color = (*colour, 1.0)
    return material


def ball(fineness: int) -> tuple[Array, NDArray[np.intp]]:
    """Corners (V, 3) and triangles (F, 3) of a ball of radius 1: 42 corners at a fineness of 2."""
    round_body = bmesh.new()
    try:
        bmesh.ops.create_icosphere(round_body, subdivisions=fineness, radius=1.0)
        faces = [[vertex.index for vertex in face.verts] for face in round_body.faces]
        return np.array([vertex.co for vertex in round_body.verts]), np.array(faces)
    finally:
        round_body.free()


def add_arrow(
    start: ArrayLike, end: ArrayLike, material: bpy.types.Material, collection: bpy.types.Collection
) -> bpy.types.Object:
    """An arrow of a round shaft and a cone, its point at `end`."""
    way = Vector(end) - Vector(start)
    length, radius, head = way.length, 0.016, min(0.09, 0.5 * way.length)
    profile = [(0.0, 0.0), (radius, 0.0), (radius, length - head), (2.6 * radius, length - head), (0.0, length)]
    around = np.linspace(0.0, 2 * pi, 16, endpoint=False)
    vertices = [(r * cos(a), r * sin(a), z) for r, z in profile for a in around]
    quads = [
        (16 * ring + i, 16 * ring + (i + 1) % 16, 16 * (ring + 1) + (i + 1) % 16, 16 * (ring + 1) + i)
        for ring in range(len(profile) - 1)
        for i in range(16)
    ]
    mesh = bpy.data.meshes.new("Arrow")
    mesh.from_pydata(vertices, [], quads)
    mesh.materials.append(material)
    arrow = bpy.data.objects.new("Arrow", mesh)
    arrow.location = Vector(start)
    arrow.rotation_euler = way.to_track_quat("Z", "Y").to_euler()
    collection.objects.link(arrow)
    return arrow


def freeze(armature: bpy.types.Object, frames: Iterable[int], collection: bpy.types.Collection) -> list[Any]:
    """Copies of a character's figure as it stands at some frames; the figure itself is left out of pictures."""
    scene, copies = bpy.context.scene, []
    for frame in frames:
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        for figure in (child for child in armature.children if child.type == "MESH"):
            mesh = bpy.data.meshes.new_from_object(figure.evaluated_get(graph), depsgraph=graph)
            copy = bpy.data.objects.new(f"{figure.name} {frame}", mesh)
            copy.matrix_world, copy[_STILL] = figure.matrix_world, True
            collection.objects.link(copy)
            copies.append(copy)
    hide(armature)
    return copies


def mark_still(thing: bpy.types.Object) -> None:
    """Let `put_back` remove a thing that is in pictures only."""
    thing[_STILL] = True


def figure_of(armature: bpy.types.Object) -> bpy.types.Object:
    """The mesh of a character."""
    return next(child for child in armature.children if child.type == "MESH" and _STILL not in child)


def hide(armature: bpy.types.Object) -> None:
    """Leave a character's figure out of pictures: its long shadow would fall on the prints."""
    for figure in armature.children:
        figure.hide_render = figure[_HIDDEN] = True


def put_back() -> None:
    """Everything as it was before the pictures: figures are seen again, their frozen copies are gone."""
    bpy.context.scene.render.filepath = "//"
    for thing in list(bpy.data.objects):
        if _STILL in thing:
            mesh = thing.data
            bpy.data.objects.remove(thing)
            if not mesh.users:
                bpy.data.meshes.remove(mesh)
        elif _HIDDEN in thing:
            thing.hide_render = False
            del thing[_HIDDEN]


def add_camera(scene: bpy.types.Scene, name: str, lens: float) -> bpy.types.Object:
    """A camera, focal length in mm for a sensor of 36 mm."""
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.data.lens = lens
    camera.data.clip_end = 500.0
    scene.collection.objects.link(camera)
    return camera


def aim(camera: bpy.types.Object, eye: ArrayLike, target: ArrayLike) -> None:
    """Put a camera at `eye` and turn it to `target`."""
    camera.location = Vector(eye)
    camera.rotation_euler = (Vector(target) - Vector(eye)).to_track_quat("-Z", "Y").to_euler()


def frame_points(camera: bpy.types.Object, points: Array, toward: ArrayLike) -> None:
    """Put a camera where it sees all points (N, 3), looking along `toward`."""
    middle = points.mean(axis=0)
    direction = np.asarray(toward, float) / np.linalg.norm(toward)
    points = middle + _FRAMING_MARGIN * (points - middle)
    aim(camera, middle - direction, middle)
    bpy.context.view_layer.update()
    eye, _ = camera.camera_fit_coords(bpy.context.evaluated_depsgraph_get(), points.ravel().tolist())
    camera.location = Vector(eye)


def bounds(things: Iterable[bpy.types.Object]) -> tuple[Array, Array]:
    """Lowest and highest corner of objects in the world [m]."""
    corners = np.array([thing.matrix_world @ Vector(corner) for thing in things for corner in thing.bound_box])
    return corners.min(axis=0), corners.max(axis=0)


def go_to(scene: bpy.types.Scene, moment: float) -> None:
    """Show a moment, which may lie between two frames."""
    scene.frame_set(int(moment), subframe=moment % 1.0)


def render(scene: bpy.types.Scene, camera: bpy.types.Object, path: Path, size: tuple[int, int], samples: int) -> None:
    """Write a picture."""
    scene.camera = camera
    scene.cycles.samples = samples
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "JPEG" if path.suffix == ".jpg" else "PNG"
    scene.render.filepath = str(path)
    with _quiet():
        bpy.ops.render.render(write_still=True)


def contact_sheet(pictures: Sequence[Path], columns: int, path: Path) -> Path:
    """Put pictures of one size side by side, row by row, into a JPEG."""
    tiles = [_pixels(picture) for picture in pictures]
    rows = [np.concatenate(tiles[i : i + columns], axis=1) for i in range(0, len(tiles), columns)]
    sheet = np.concatenate(rows[::-1], axis=0)  # Blender counts rows from the bottom
    image = bpy.data.images.new("Sheet", sheet.shape[1], sheet.shape[0])
    try:
        image.pixels.foreach_set(sheet.ravel())
        image.filepath_raw, image.file_format = str(path), "JPEG"
        image.save(quality=80)
    finally:
        bpy.data.images.remove(image)
    return path


def _pixels(path: Path) -> NDArray[np.float32]:
    """A picture as (rows, columns, 4) from the bottom up."""
    image = bpy.data.images.load(str(path))
    try:
        values = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(values)
        return values.reshape(image.size[1], image.size[0], 4)
    finally:
        bpy.data.images.remove(image)


@contextmanager
def _quiet() -> Iterator[None]:
    """Without what Blender itself writes to the terminal: hundreds of lines of progress for each picture."""
    sys.stdout.flush()
    terminal = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        os.dup2(terminal, 1)
        os.close(terminal)
        os.close(nowhere)


def heading_of(vector: ArrayLike) -> float:
    """Direction of a vector in the plane [rad]."""
    x, y = np.asarray(vector, float)[:2]
    return atan2(y, x)
