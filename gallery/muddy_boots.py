"""Boots come out of mud onto a stone floor, and leave less of it with each step."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy
import numpy as np

from gallery import open_air, outfit
from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.production import Bake, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender.carried import marks_object
from softground_addon.blender.nodes.shader_graph import Graph

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Mud"
FRAMES, SHOWN = 120, 108
START = 2.4  # m along y; the walk is toward -y
EDGE, END, HALF_WIDTH = 0.6, -9.0, 1.6
"""Where the floor begins and ends along the way, and half its width [m]."""
TOP, BELOW = 0.004, 0.06
"""Height of the floor, and how deep the mud lies beneath it [m]."""
PICTURE = (960, 640)
_HILLS = open_air.rolling(swell=0.12, hills=8.0, seed=4)


def height(x: Array, y: Array) -> Array:
    """Mud before the floor, and lower below it [m]."""
    under = np.clip((EDGE - 0.02 - y) / 0.05, 0.0, 1.0) * (np.abs(x) < HALF_WIDTH)
    return _HILLS(x, y) * (np.abs(x) > HALF_WIDTH) - BELOW * under


@dataclass(frozen=True)
class MuddyBoots:
    """One walk out of the mud."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> MuddyBoots:
    """A floor of stone beside a muddy yard, and a walk over both."""
    ground = open_air.add_ground(scene, "Yard", (-3.0, START + 2.0), height, "mud")
    scene.softground.hard_grounds.add().object = slab(scene, "Floor", (END, EDGE), TOP, stone())
    bpy.context.view_layer.update()
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (1.05, 1.75, 0.95), (-0.02, -0.9, 0.0), 32.0, (0.0, -0.5, 0.0), 11.0)
    chosen = {"relief_vertices": "300000", "tread": "0.005"} | dict(options or {})
    return MuddyBoots({PRESET: open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen)})


def claims(built: MuddyBoots) -> list[Claim]:
    """Each foot leaves less with each step, and all that it picked up is booked."""
    carried = built.bakes[PRESET].report["totals"]["carried_kg"]
    marks = marks_object.of(built.bakes[PRESET].ground)
    steps = {value.value for value in marks.data.attributes["step"].data}
    booked = carried["left_behind"] + carried["shed"] + carried["on_soles"]
    return [
        Claim("Marks on the floor", len(steps), 5, 9),
        Claim("Mud that they weigh together [g]", 1e3 * carried["left_behind"], 10, 120),
        Claim("Picked up less booked [kg]", carried["picked_up"] - booked, -1e-9, 1e-9),
    ]


def shoot(built: MuddyBoots, folder: Path, samples: int) -> list[Path]:
    """The floor from behind, and one mark from above."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(-150), radians(24), (1.0, 0.93, 0.84), 4.0, 0.35, open_air.PALE_DUSK)
    scene.frame_set(SHOWN)
    hiker = bpy.data.objects["Hiker"]
    outfit.wear_boots(hiker, Body())
    whole = folder / "muddy_boots.jpg"
    stage.render(scene, scene.camera, whole, PICTURE, samples)
    marks = marks_object.of(built.bakes[PRESET].ground)
    place = np.array([marks.matrix_world @ vertex.co for vertex in marks.data.vertices])
    first = np.array([value.value for value in marks.data.attributes["step"].data]) == 0
    middle = place[first].mean(axis=0)
    stage.hide(hiker)
    near = open_air.add_camera(scene, middle + np.array((0.15, 0.25, 0.42)), middle, 45.0, middle, 16.0)
    close = folder / "muddy_boots_close.jpg"
    stage.render(scene, near, close, PICTURE, samples)
    return [whole, close]


def slab(
    scene: bpy.types.Scene,
    name: str,
    y: tuple[float, float],
    top: float,
    material: bpy.types.Material,
    half_width: float = HALF_WIDTH,
) -> bpy.types.Object:
    """A slab across the way, from one y to another and up to a height [m]."""
    x, z = (-half_width, half_width), (TOP - BELOW, top)
    corners = [(a, b, c) for c in z for a, b in ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(material)
    floor = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(floor)
    return floor


def stone() -> bpy.types.Material:
    """Tiles of pale stone with dark joints."""
    material = stage.plain_material("Stone Tiles", (0.42, 0.40, 0.36), 0.6)
    tree = material.node_tree
    tree.nodes.clear()
    graph = Graph(tree)
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    tiles = graph.node(
        "ShaderNodeTexBrick",
        {
            "Vector": place,
            "Color1": (0.40, 0.38, 0.34, 1.0),
            "Color2": (0.47, 0.45, 0.41, 1.0),
            "Mortar": (0.16, 0.15, 0.14, 1.0),
            "Scale": 1.0,
            "Mortar Size": 0.004,
            "Brick Width": 0.62,
            "Row Height": 0.42,
        },
    )
    grain = graph.ramp(graph.noise(place, 0.05, 6.0, 0.7), 0.2, 0.8, 0.78, 1.12)
    colour = graph.node("ShaderNodeVectorMath", {0: graph.out(tiles), "Scale": grain}, operation="SCALE")
    uneven = graph.noise(place, 0.02, 5.0, 0.65) * 0.0015 + graph.out(tiles, 1) * -0.003
    inputs = {"Base Color": graph.out(colour), "Roughness": graph.blend(grain, 0.3, 0.62)}
    relief = graph.node("ShaderNodeDisplacement", {"Height": uneven, "Midlevel": 0.0, "Scale": 1.0})
    shader = graph.out(graph.node("ShaderNodeBsdfPrincipled", inputs))
    graph.node("ShaderNodeOutputMaterial", {"Surface": shader, "Displacement": graph.out(relief)})
    return material


if __name__ == "__main__":
    production.main(__name__)
