"""A stone floor beside soft ground, and walks from one onto the other: what scenes of carried mud and water share."""

from __future__ import annotations

import bpy
import numpy as np

from gallery import open_air
from sample_scenes import stage
from sample_scenes.body import Body
from sample_scenes.course import Course
from sample_scenes.gait import Gait, walk
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender.carried import marks_object
from softground_addon.blender.nodes.shader_graph import Graph

START = 2.4  # m along y; the walk is toward -y
EDGE, END, HALF_WIDTH = 0.6, -9.0, 1.6
"""Where the floor begins and ends along the way, and half its width [m]."""
TOP, BELOW = 0.004, 0.06
"""Height of the floor, and how deep the soft ground lies beneath it [m]."""
PICTURE = (960, 640)
_HILLS = open_air.rolling(swell=0.12, hills=8.0, seed=4)


def height(x: Array, y: Array) -> Array:
    """Soft ground before the floor, and lower below it [m]."""
    beside = (np.abs(x) > HALF_WIDTH) | (y < END)
    under = np.clip((EDGE - 0.02 - y) / 0.05, 0.0, 1.0) * ~beside
    return _HILLS(x, y) * beside - BELOW * under


def crossed(
    scene: bpy.types.Scene,
    preset: str,
    surface: str,
    camera: tuple[tuple[float, ...], tuple[float, ...], float],
    frames: int,
    cell_size: float | None,
    options: Options,
    *,
    body: Body | None = None,
    course: Course | None = None,
) -> Built:
    """A yard with a floor, on which other slabs may lie already, and a walk over it that a camera sees."""
    ground = open_air.add_ground(scene, "Yard", (-3.0, START + 2.0), height, surface)
    scene.softground.hard_grounds.add().object = slab(scene, "Floor", (END, EDGE), TOP, stone())
    bpy.context.view_layer.update()
    eye, target, lens = camera
    open_air.add_camera(scene, eye, target, lens, target, 11.0, picture=PICTURE)
    body = body or Body()
    motion = walk(body, Gait(), frames, scene.render.fps, course=course) if course else None
    return open_air.bake_walk(scene, ground, START, frames, preset, cell_size, options, motion, body)


def booked(built: Built, marks: tuple[int, int], grams: tuple[float, float]) -> list[Claim]:
    """How many steps leave marks, what these weigh, and that all which is picked up is booked."""
    (bake,) = built.bakes.values()
    carried, obj = bake.report["totals"]["carried_kg"], marks_object.of(bake.ground)
    step, mass = (marks_object.values(obj.data, name) for name in ("step", "mass"))
    lost = carried["left_behind"] + carried["shed"] + carried["on_soles"]
    return [
        Claim("Steps that leave marks", len(np.unique(step[mass > 0])), *marks),
        Claim("Mass of the marks [g]", 1e3 * carried["left_behind"], *grams),
        Claim("Picked up less booked [kg]", carried["picked_up"] - lost, -1e-9, 1e-9),
    ]


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
