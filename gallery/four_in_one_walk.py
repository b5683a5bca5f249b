"""One walk over four grounds of one mesh: mud, rock that takes marks and no prints, sand, snow."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender.carried import marks_object
from softground_addon.blender.materials import materials
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.core.record.footprints import Footprint

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Mud"
FRAMES, SHOWN = 132, 126
START = 2.3  # m along y; the walk is toward -y
BORDERS = (0.35, -1.25, -2.85)
"""Between mud, rock, sand and snow, in the middle of the way [m]."""
LOOKS = {"Rock": "none", "Sand": "dry_sand", "Snow": "snow"}
"""Materials after the mud, with the presets that they name."""
SPACING = 0.06  # m
PICTURE = (960, 640)
_HILLS = open_air.rolling(swell=0.14, hills=9.0, seed=11)


def shifted(x: Array) -> Array:
    """How much further along the way borders are beside it, for none is drawn with a ruler [m]."""
    return 0.16 * np.sin(1.7 * x + 0.4) + 0.07 * np.sin(4.3 * x + 1.9) + 0.03 * np.sin(9.1 * x)


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """Ground, walk, bake."""
    ground = open_air.add_ground(scene, "Pass", (-6.0, START + 2.0), _HILLS, "mud", spacing=SPACING)
    points = np.empty(len(ground.data.vertices) * 3, np.float32)
    positions = ground.data.attributes["position"].data
    positions.foreach_get("vector", points)
    x, y, z = points.reshape(-1, 3).T
    rows = y.reshape(-1, int(np.flatnonzero(np.diff(y))[0]) + 1)  # which bend along the borders
    slots = np.searchsorted(-np.array(BORDERS), -(rows[1:, :-1] + rows[:-1, :-1]) / 2).astype(np.int32)
    y += shifted(x)
    z[:] = _HILLS(x, y)
    positions.foreach_set("vector", points)
    for name, preset in LOOKS.items():
        material = _rock() if preset == "none" else materials.ensure_material(name.lower()).copy()
        material.name, material.softground_preset = name, preset
        material.pop(materials.MARK, None)  # which follows the preset of the ground no more
        ground.data.materials.append(material)
    ground.data.polygons.foreach_set("material_index", slots.ravel())
    ground.data.update()
    open_air.add_camera(scene, (1.0, 2.75, 1.5), (-0.2, -0.95, 0.12), 29.0, (0.0, -0.3, 0.0), 11.0, picture=PICTURE)
    chosen = {"relief_vertices": "400000"} | dict(options or {})
    return open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen)


def claims(built: Built) -> list[Claim]:
    """Each material has prints of its own depth, and the rock has marks."""
    bake = built.bakes[PRESET]
    steps = {
        surface: [step for step in bake.footprints if step.surface == surface] for surface in ("mud", "sand", "snow")
    }
    middle = [step.position[1] for step in bake.footprints]
    on_rock = sum(BORDERS[1] + 0.25 < y < BORDERS[0] - 0.25 for y in middle)
    return [
        *(Claim(f"Prints in {surface}", len(of_one), 2, 6) for surface, of_one in steps.items()),
        Claim("Prints on rock", on_rock, 0, 0),
        Claim("Depth in mud over that in sand", _depth(steps["mud"]) / _depth(steps["sand"]), 1.1, 2.5),
        Claim("Depth in snow over that in mud", _depth(steps["snow"]) / _depth(steps["mud"]), 1.1, 2.5),
        Claim("Marks on the rock", len(marks_object.of(bake.ground).data.polygons), 1, np.inf),
    ]


def _depth(steps: list[Footprint]) -> float:
    """Mean depth of prints [m]."""
    return float(np.mean([step.compressed_m3 / step.area_m2 for step in steps]))


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """All four from behind, under a low sun from the side."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(-155), radians(17), (1.0, 0.90, 0.78), 4.2, 0.4, open_air.PALE_DUSK)
    scene.view_settings.exposure = 0.4
    scene.frame_set(SHOWN)
    outfit.wear_boots(bpy.data.objects["Hiker"], Body())
    path = folder / "four_in_one_walk.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def _rock() -> bpy.types.Material:
    """Bare rock in flat steps."""
    material = stage.plain_material("Rock", (0.25, 0.24, 0.23), 0.8)
    tree = material.node_tree
    tree.nodes.clear()
    graph = Graph(tree)
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    grain = graph.ramp(graph.noise(place, 0.03, 7.0, 0.75), 0.2, 0.8, 0.6, 1.3)
    patches = graph.ramp(graph.noise(place, 0.7, 4.0, 0.6), 0.3, 0.7, 0.75, 1.15)
    base = graph.node("ShaderNodeVectorMath", {0: (0.27, 0.23, 0.19), "Scale": grain * patches}, operation="SCALE")
    steps = graph.ramp(graph.noise(place, 0.6, 6.0, 0.55), 0.42, 0.58)
    uneven = steps * 0.03 + graph.noise(place, 0.02, 5.0, 0.7) * 0.004
    relief = graph.node("ShaderNodeDisplacement", {"Height": uneven, "Midlevel": 0.0, "Scale": 1.0})
    shader = graph.out(graph.node("ShaderNodeBsdfPrincipled", {"Base Color": graph.out(base), "Roughness": 0.75}))
    graph.node("ShaderNodeOutputMaterial", {"Surface": shader, "Displacement": graph.out(relief)})
    return material


if __name__ == "__main__":
    production.main(__name__)
