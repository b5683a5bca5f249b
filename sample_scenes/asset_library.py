"""`make assets`: an asset library of what SoftGround makes, with catalogues and previews, into build/assets.

Materials of the grounds, pieces of debris, prints under weather that play by themselves, and two characters that walk.

python -m sample_scenes.asset_library [FOLDER]
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import bpy
import numpy as np

from sample_scenes import production, stage, terrain
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.dog import Dog
from sample_scenes.four_legged import WALK, go_on_four_legs
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Walker, addon
from softground_addon.blender.debris import debris_shapes
from softground_addon.blender.materials import materials
from softground_addon.blender.weather import ground_weather as weather
from softground_addon.core.ground import presets
from softground_addon.core.ground.surfaces import SURFACES

OUTPUT = Path(__file__).parents[1] / "build" / "assets"
BLEND, CATALOGUES = "softground_assets.blend", "blender_assets.cats.txt"

KINDS = ("Materials", "Debris", "Weather", "Characters")
"""The catalogues, below one of the extension's name."""

LICENCE, AUTHORS = "CC0-1.0", "The SoftGround authors"

FRAMES = 48
NIGHT = 240
"""Frames after the step for which the pictures of weather wait: ten seconds."""

TILE, SPACING = 0.5, 0.005
"""Side of the ground around one print, and distance of its vertices [m]."""

WEATHER_ON = {
    "SNOWFALL": "Snow",
    "THAW": "Snow",
    "WINDY_DUNES": "Dry Sand",
    "SHOWER": "Mud",
    "DRYING_BEACH": "Wet Sand",
}
"""The ground that each weather is shown on."""

VIEW, FROM_THE_SIDE = (0.5, 0.9, -0.9), (0.9, 0.6, -0.25)
"""Where the cameras of previews look to."""
CLOSER = 0.75
"""Part of a tile that its preview shows."""
SIZE, SAMPLES = 128, 24
"""Width and height of previews, and samples of each pixel."""


def main(arguments: list[str]) -> int:
    """Build the library; returns the exit code of the process."""
    folder = Path(arguments[0]) if arguments else OUTPUT
    folder.mkdir(parents=True, exist_ok=True)
    with addon():
        build(bpy.context.scene)
        bpy.context.preferences.filepaths.save_version = 0
        bpy.ops.wm.save_as_mainfile(filepath=str((folder / BLEND).resolve()), compress=True)
    (folder / CATALOGUES).write_text(catalogues(), encoding="utf-8")
    for name in (BLEND, CATALOGUES):
        print(folder / name, (folder / name).stat().st_size)
    return 0


def catalogue_of(kind: str) -> str:
    """The identifier of a catalogue, the same in each build."""
    return str(uuid5(NAMESPACE_URL, f"softground/{kind}"))


def catalogues() -> str:
    """The file in which Blender keeps an asset library's catalogues."""
    lines = [f"{catalogue_of(kind)}:SoftGround/{kind}:SoftGround-{kind}" for kind in KINDS]
    return "\n".join(["VERSION 1", "", *lines, ""])


def build(scene: bpy.types.Scene) -> None:
    """Make all assets in one file, each with its preview."""
    stage.set_up_rendering(scene)
    scene.render.film_transparent = True
    stage.add_sun(scene, toward=0.6)
    camera = stage.add_camera(scene, "Camera", 50.0)
    with TemporaryDirectory() as folder:
        picture = Path(folder) / "preview.png"
        for weather_preset, ground in WEATHER_ON.items():
            tile = _print_under_weather(scene, weather_preset, ground)
            scene.frame_set(NIGHT)
            stage.frame_points(camera, _corners([tile], CLOSER), VIEW)
            _mark(tile, "Weather", f"One print, ten seconds of {tile.name.split(' in ')[-1].lower()}; plays by itself")
            _take(tile, scene, camera, picture)
            tile.hide_render = True
        for name, body, course in _courses(scene.render.fps):
            collection = bpy.data.collections.new(name)
            scene.collection.children.link(collection)
            armature = create_character(name, body, collection)
            write_action(armature, course, "Walk")
            scene.frame_set(FRAMES // 2)
            things = [armature, *armature.children]
            stage.frame_points(camera, _corners(armature.children), FROM_THE_SIDE)
            _mark(collection, "Characters", f"A rigged {name.lower()} that walks: add it to SoftGround and bake")
            _take(collection, scene, camera, picture)
            for thing in things:
                thing.hide_render = True
        for surface in SURFACES.values():
            shapes = debris_shapes.collection_of(surface)
            scene.collection.children.link(shapes)
            apart = 1.1 * max(max(piece.dimensions) for piece in shapes.objects)
            for number, piece in enumerate(shapes.objects):
                piece.location = (apart * (number % 2), apart * (number // 2), 0.0)
            bpy.context.view_layer.update()
            stage.frame_points(camera, _corners(shapes.objects), VIEW)
            _mark(shapes, "Debris", "Pieces of radius 1 that steps throw: choose them in the debris' Shapes")
            _take(shapes, scene, camera, picture)
            for piece in shapes.objects:
                piece.location, piece.hide_render = (0.0, 0.0, 0.0), True
            scene.collection.children.unlink(shapes)
            material = materials.ensure_material(surface.name)
            _mark(material, "Materials", "Follows the prints of a bake, and lies still on any other mesh")
            _show(material, next(presets.FOLDER.glob(f"{_file_of(surface.name)}.png")))
        for thing in scene.objects:
            thing.hide_render = False
    bpy.ops.outliner.orphans_purge(do_recursive=True)


def _file_of(surface: str) -> str:
    """The preset whose picture shows a surface."""
    return {"sand": "dry_sand"}.get(surface, surface)


def _courses(rate: float) -> Iterable[tuple[str, Any, Any]]:
    """Name, body and motion of each character."""
    person, dog = Body(), Dog()
    yield "Hiker", person, walk(person, Gait(), FRAMES, rate)
    yield "Dog", dog, go_on_four_legs(dog, WALK, FRAMES, rate)


def _print_under_weather(scene: bpy.types.Scene, preset: str, ground: str) -> bpy.types.Object:
    """A tile of ground with one print of a walk, over which weather goes."""
    body = Body()
    walker = create_character("Walker", body, scene.collection)
    write_action(walker, walk(body, Gait(), FRAMES, scene.render.fps), "Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    everywhere = production.bake(scene, [Walker(walker, body.mass)], ground, SPACING, write=False)
    step = everywhere.footprints[1]
    title = weather.PRESETS[preset][0]
    places = terrain.spaced(-TILE / 2, TILE / 2, SPACING)
    name = f"Print in {title}"
    tile = terrain.add_terrain(
        name,
        step.position[0] + places,
        step.position[1] + places,
        _level,
        scene.softground.material.surface,
        scene.collection,
    )
    baked = production.bake(
        scene, [Walker(walker, body.mass)], ground, SPACING, ground=tile, options={"detail": "NEVER", "relief": "FINE"}
    )
    assert baked.display_mesh == tile
    weather.set_preset(weather.add(tile), preset)
    scene.softground.characters.clear()
    scene.softground.ground = None
    production.remove_character(walker)
    return tile


def _level(x: stage.Array, _y: stage.Array) -> stage.Array:
    return np.zeros_like(x)


def _corners(things: Iterable[bpy.types.Object], share: float = 1.0) -> stage.Array:
    """Corners of the box around objects, or of a part of it about its middle, (8, 3) [m]."""
    ends = np.array(stage.bounds(things))
    corners = np.stack([ends[[i, j, k], range(3)] for i, j, k in product((0, 1), repeat=3)])
    return np.asarray(ends.mean(axis=0) + share * (corners - ends.mean(axis=0)))


def _mark(thing: Any, kind: str, description: str) -> None:
    """Make a data-block an asset of a catalogue."""
    thing.asset_mark()
    about = thing.asset_data
    about.catalog_id, about.description = catalogue_of(kind), description
    about.author, about.license = AUTHORS, LICENCE
    for tag in ("SoftGround", kind):
        about.tags.new(tag, skip_if_exists=True)


def _take(thing: Any, scene: bpy.types.Scene, camera: bpy.types.Object, picture: Path) -> None:
    """Render the preview of what the scene shows."""
    stage.render(scene, camera, picture, (SIZE, SIZE), SAMPLES)
    _show(thing, picture)


def _show(thing: Any, picture: Path) -> None:
    """Give an asset a picture as its preview."""
    image = bpy.data.images.load(str(picture))
    try:
        pixels = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(pixels)
        preview = thing.preview_ensure()
        preview.image_size = tuple(image.size)
        preview.image_pixels_float.foreach_set(pixels)
    finally:
        bpy.data.images.remove(image)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
