"""A walk through a meadow toward a low sun: grass lies where boots trod, and rises behind them."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import broadleaf, open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.plants import meadow

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Soil"
FRAMES = 190
START = 1.2  # m along y; the walk is toward -y
PICTURE = (1280, 720)
EYE, ASIDE = (0.42, 1.45, 0.92), -0.18
"""Of the camera [m], and how far toward x it looks for each metre toward -y."""
TUFTS, NEAREST, FARTHEST = 42_000, 0.9, 26.0
"""Tufts of grass, of which as many stand in each octave of distance from the camera [m]."""
HEIGHT = open_air.rolling(swell=0.18, hills=18.0, seed=5)


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A wide ground, and a walk away from the camera."""
    ground = open_air.add_ground(scene, "Meadow", (-26.0, START + 3.0), HEIGHT, "soil", {"growth": _growth})
    open_air.add_camera(scene, EYE, (-0.12, -2.2, 0.10), 30.0, (0.0, -0.9, 0.1), 16.0, picture=PICTURE)
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, {"relief": "OFF"} | dict(options or {}))


def claims(built: Built) -> list[Claim]:
    """A track under grass."""
    return [Claim("Steps in the meadow", len(built.bakes[PRESET].footprints), 10, 40)]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From the height of a child, against the evening sun."""
    scene, chance = bpy.context.scene, np.random.default_rng(3)
    give_way(plant(tufts(chance, TUFTS, EYE, ASIDE), chance))
    spots = np.column_stack([chance.normal(0.0, 45.0, 90), -chance.uniform(38.0, 110.0, 90)])
    leaves = (0.030, 0.045, 0.010), (0.12, 0.14, 0.035)
    broadleaf.add_broadleaves(spots, chance.uniform(3.0, 8.0, 90), HEIGHT, *leaves, stem=0.15, seed=40)
    dress(scene)
    scene.frame_set(scene.frame_end)
    scene.render.image_settings.quality = 85
    path = folder / "meadow.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def give_way(grass: bpy.types.Object) -> None:
    """Let grass give way by the button."""
    production.make_active(grass)
    bpy.ops.softground.give_way(kind="MEADOW")


def dress(scene: bpy.types.Scene) -> None:
    """Evening sun, green ground and clothes."""
    open_air.add_low_sun(scene, radians(62), radians(13), (1.0, 0.74, 0.48), 10.0, 0.26, open_air.PALE_DUSK)
    scene.view_settings.exposure = 1.2
    for material in baked_ground.display_mesh_of(scene.softground.ground).data.materials:
        open_air.overgrow(material, "growth", meadow.DARK, meadow.LIGHT)
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_creased(hiker, Body())
    outfit.wear_rucksack(hiker, Body())


def _growth(x: Array, y: Array) -> Array:
    """Share of the ground that is green from afar: all of it."""
    return np.ones(np.broadcast(x, y).shape)


def tufts(chance: np.random.Generator, count: int, eye: tuple[float, float, float], aside: float) -> Array:
    """Places of tufts before a camera, (N, 3) [m], ever fewer of a square metre with distance."""
    away = np.geomspace(NEAREST, FARTHEST, count) * chance.uniform(0.95, 1.05, count)
    turn = chance.uniform(radians(-48.0), radians(48.0), count)
    x, y = eye[0] + aside * away + away * np.sin(turn), eye[1] - away * np.cos(turn)
    return np.column_stack([x, y, HEIGHT(x, y)])


def plant(spots: Array, chance: np.random.Generator) -> bpy.types.Object:
    """Blades of the sample meadow in tufts at places (N, 3) [m]; light shines through them."""
    grass = meadow.planted(spots, chance, 1.0)
    bpy.context.scene.collection.objects.link(grass)
    tree = grass.data.materials[0].node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    shines, both = tree.nodes.new("ShaderNodeBsdfTranslucent"), tree.nodes.new("ShaderNodeMixShader")
    both.inputs[0].default_value = 0.45
    tree.links.new(shader.inputs["Base Color"].links[0].from_socket, shines.inputs["Color"])
    tree.links.new(shader.outputs[0], both.inputs[1])
    tree.links.new(shines.outputs[0], both.inputs[2])
    tree.links.new(both.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return grass


if __name__ == "__main__":
    production.main(__name__)
