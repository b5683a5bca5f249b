"""Snow lies on a jetty by *Cover*, and a walk prints in it."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import firs, open_air, outfit
from gallery.stone_floor import slab
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options
from softground_addon.blender.nodes.shader_graph import Graph

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Snow"
FRAMES, SHOWN = 130, 124
START = 2.2  # m along y; the walk is toward -y
THICKNESS_CM = 9.0
HALF_WIDTH, ABOVE = 0.72, 0.55
"""Half the width of the jetty, and its height over the frozen lake [m]."""
PICTURE = (960, 600)
_HILLS = open_air.rolling(swell=0.05, hills=22.0, seed=5)


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A jetty over a frozen lake, its cover of snow, and a walk on it."""
    open_air.add_ground(scene, "Lake", (-26.0, START + 3.0), lambda x, y: _HILLS(x, y) - ABOVE, "snow", spacing=0.6)
    top, wood = -THICKNESS_CM / 100.0, _planks()
    jetty = slab(scene, "Jetty", (-9.0, START + 1.0), top, wood, HALF_WIDTH)
    for side in (-1.0, 1.0):
        for along in np.arange(-8.0, START, 1.9):
            bpy.ops.mesh.primitive_cylinder_add(radius=0.07, depth=1.3, location=(side * 0.80, along, -0.42))
            bpy.context.object.data.materials.append(wood)
    bpy.context.view_layer.update()
    production.make_active(jetty)
    bpy.ops.softground.cover(thickness_cm=THICKNESS_CM)
    open_air.add_camera(scene, (1.6, 1.9, 0.95), (-0.16, -1.9, 0.16), 30.0, (0.0, -0.4, 0.0), 9.0, picture=PICTURE)
    chosen = {
        "relief_vertices": "300000",
        "material.layer_depth": str(-top),
        "under": "NEVER",
        "material.youngs_modulus": "1.2e5",
    } | dict(options or {})
    ground = scene.softground.ground
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen)


def claims(built: Built) -> list[Claim]:
    """Prints, none of which goes through the snow."""
    steps = built.bakes[PRESET].footprints
    return [
        Claim("Steps in the snow", len(steps), 8, 14),
        Claim("Depth of the deepest over the snow's", max(step.max_depth_m for step in steps) / 0.09, 0.3, 1.0),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From beside the jetty, with its edge in the low sun."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(-128), radians(15), (1.0, 0.86, 0.70), 5.0, 0.3, open_air.PALE_DUSK)
    scene.frame_set(SHOWN)
    chance = np.random.default_rng(7)
    spots = np.column_stack([chance.normal(0.0, 55.0, 90), -chance.uniform(40.0, 110.0, 90)])
    firs.add_firs(spots, chance.uniform(4.0, 10.0, len(spots)), _HILLS, firs.WINTRY, snow=0.7)
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    outfit.wear_creased(hiker, Body())
    path = folder / "snow_on_jetty.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def _planks() -> bpy.types.Material:
    """Weathered planks across the way."""
    material = stage.plain_material("Planks", (0.16, 0.11, 0.07), 0.8)
    tree = material.node_tree
    tree.nodes.clear()
    graph = Graph(tree)
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    along = graph.out(graph.node("ShaderNodeSeparateXYZ", {0: place}), 1)
    joint = graph.ramp(graph.math("FRACT", along * (1.0 / 0.16), 0.0), 0.04, 0.08)
    grain = graph.ramp(graph.noise(place, 0.05, 6.0, 0.7), 0.25, 0.75)
    colour = graph.mix(grain, (0.075, 0.050, 0.032), (0.21, 0.155, 0.11))
    colour = graph.mix(joint, (0.012, 0.009, 0.007), colour)
    shader = graph.out(graph.node("ShaderNodeBsdfPrincipled", {"Base Color": colour, "Roughness": 0.8}))
    graph.node("ShaderNodeOutputMaterial", {"Surface": shader})
    return material


if __name__ == "__main__":
    production.main(__name__)
