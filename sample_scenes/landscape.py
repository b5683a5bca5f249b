"""Fig. 4, a landscape: snow turns to sand behind a hill, and five characters cross it, each in their own way.

One walks, one runs over the hill, one is on snowshoes, a heavy one with large feet leaves a trail, a light one with
tiny feet leaves hardly anything. Snow and sand are one mesh with two materials, each of which names its preset.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import plates, production, terrain
from sample_scenes.body import Body, Foot
from sample_scenes.character import create_character
from sample_scenes.course import Course
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.motion import BodyMotion
from sample_scenes.production import Built, Claim, Options, Walker
from sample_scenes.run import Run, run
from sample_scenes.snowshoe import ON_SNOWSHOES, put_on_snowshoes
from softground_addon.blender.materials import materials
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.record.footprints import Footprint

CELL_SIZE = 0.01  # m
FRAMES = 116
SPACING = 0.06  # m between the vertices of the landscape; along the tracks the bake makes it finer
LOW, HIGH = np.array((-3.4, -8.0)), np.array((4.2, 1.4))  # m
BORDER = -3.6  # m; snow before it, sand beyond

SAND = "sand"
"""Attribute of the ground: how much of it is sand, not snow."""
SAND_PRESET = "paper_dry_sand"

HILL_HEIGHT, HILL_WIDTH = 0.45, 0.85  # m
HILL = np.array((1.1, -1.6))

LANES = {"walker": -0.3, "runner": 1.1, "snowshoes": -1.4, "heavy": -2.5, "light": 2.7}
"""Across the way, where each goes [m]."""
STARTS = {"walker": 0.3, "runner": 0.9, "snowshoes": -0.7, "heavy": -2.2, "light": -1.0}
"""Along the way, where each starts [m]; all go toward -y."""

_WALKER = Body()
_HEAVY = Body(stature=2.05, mass=270.0, foot=Foot(0.50, 0.20))
_LIGHT = Body(stature=1.05, mass=9.0, foot=Foot(0.13, 0.055))


@dataclass(frozen=True)
class Landscape(Built):
    """One ground with five tracks."""

    walkers: dict[str, bpy.types.Object]


def height(x: terrain.Array, y: terrain.Array) -> terrain.Array:
    """A hill in the snow [m]."""
    away = ((x - HILL[0]) ** 2 + (y - HILL[1]) ** 2) / HILL_WIDTH**2
    return HILL_HEIGHT * np.exp(-away)


def sand(_x: terrain.Array, y: terrain.Array) -> terrain.Array:
    """0 in the snow, 1 in the sand, with a hand's breadth between."""
    return np.clip(0.5 + (BORDER - y) / 0.12, 0.0, 1.0)


def motions(rate: float) -> dict[str, tuple[Body, BodyMotion]]:
    """Who goes how, in their own frames: x ahead is -y of the landscape."""
    lane, start = LANES["runner"], STARTS["runner"]
    course = Course(heights=lambda ahead, left: height(lane + left, start - ahead))
    return {
        "walker": (_WALKER, walk(_WALKER, Gait(), FRAMES, rate)),
        "runner": (_WALKER, run(_WALKER, Run(speed=2.8), round(2.8 * rate), rate, course=course)),
        "snowshoes": (_WALKER, walk(_WALKER, ON_SNOWSHOES, FRAMES, rate)),
        "heavy": (_HEAVY, walk(_HEAVY, Gait(speed=0.42, step_width=0.10), FRAMES, rate)),
        "light": (_LIGHT, walk(_LIGHT, Gait(speed=0.8), FRAMES, rate)),
    }


def snow_to_sand() -> bpy.types.Material:
    """The add-on's snow with its sand over it, where there is some."""
    material = materials.ensure_material("snow").copy()  # which follows no preset
    material.name = "Snow to Sand"
    del material[materials.MARK]
    tree = material.node_tree
    graph, output = Graph(tree), tree.get_output_node("ALL")
    ground = materials.ground_of(graph)
    shader, height = materials.shaded(graph, SURFACES["sand"], ground)
    drift = graph.noise(ground.place, 0.35, 4.0, 0.6) * 0.5  # no border is drawn with a ruler
    factor = graph.ramp(graph.attribute(SAND) + drift, 0.70, 0.80)
    mixed = graph.node("ShaderNodeMixShader", {0: factor, 2: shader})
    relief = graph.node("ShaderNodeMix", {0: factor, 3: height})
    displaced = output.inputs["Displacement"].links[0].from_node
    for node, number, into in ((mixed, 1, output.inputs["Surface"]), (relief, 2, displaced.inputs["Height"])):
        tree.links.new(into.links[0].from_socket, node.inputs[number])
        tree.links.new(node.outputs[0], into)
    return material


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Landscape:
    """Ground, characters, one bake."""
    x, y = (terrain.spaced(LOW[axis], HIGH[axis], SPACING) for axis in (0, 1))
    ground = terrain.add_terrain("Landscape", x, y, height, "snow", scene.collection, {SAND: sand})
    ground.data.materials[0] = snow_to_sand()
    beyond = ground.data.materials[0].copy()
    beyond.softground_preset = SAND_PRESET
    ground.data.materials.append(beyond)
    middle = (y[1:] + y[:-1]) / 2
    ground.data.polygons.foreach_set("material_index", np.repeat(middle < BORDER, len(x) - 1).astype(np.int32))
    scene.frame_start, scene.frame_end = 1, FRAMES
    walkers, bodies = {}, {}
    for name, (body, motion) in motions(scene.render.fps).items():
        walkers[name] = create_character(name.title(), body, scene.collection, production.COARSENESS)
        walkers[name].location = (LANES[name], STARTS[name], 0.0)
        write_action(walkers[name], motion, name.title())
        bodies[name] = body
    shoes = put_on_snowshoes(walkers["snowshoes"], _WALKER, scene.collection)
    options = {"shape_keys": "false", "detail": "ALWAYS"} | dict(options or {})
    bake = production.bake(
        scene,
        [Walker(walkers[name], bodies[name].mass, shoes if name == "snowshoes" else {}) for name in walkers],
        "Paper Snow",
        cell_size,
        ground=ground,
        options=options,
    )
    return Landscape({"landscape": bake}, walkers)


def depth(steps: list[Footprint]) -> float:
    """Mean depth of whole prints [m]."""
    largest = max(step.area_m2 for step in steps)
    return float(np.mean([s.compressed_m3 / s.area_m2 for s in steps if s.area_m2 > 0.8 * largest]))


def claims(built: Landscape) -> list[Claim]:
    """What mass, soles, speed and ground do to the prints."""
    bake = built.bakes["landscape"]
    tracks = {name: bake.of(walker.name) for name, walker in built.walkers.items()}
    snow = {name: [s for s in steps if s.position[1] > BORDER + 0.35] for name, steps in tracks.items()}
    beyond = {name: [s for s in steps if s.position[1] < BORDER - 0.35] for name, steps in tracks.items()}
    area = {name: max(step.area_m2 for step in steps) for name, steps in snow.items()}
    ratio = depth(snow["walker"]) / depth(snow["snowshoes"])
    return [
        Claim(
            "A walker's prints in snow over those in sand, in depth",
            depth(snow["walker"]) / depth(beyond["walker"]),
            4.5,
            7.5,
        ),
        Claim(
            "Prints of running over those of walking, in depth", depth(snow["runner"]) / depth(snow["walker"]), 1.1, 2.5
        ),
        Claim(
            "Depth without snowshoes over depth with them, relative to the areas",
            ratio * area["walker"] / area["snowshoes"],
            0.75,
            1.25,
        ),
        Claim("Area of a snowshoe over that of a shoe", area["snowshoes"] / area["walker"], 3.0, 7.0),
        Claim("Part of the heavy one's way that is trodden", covered(tracks["heavy"]), 0.98, 1.0),
        Claim("Part of the walker's way that is trodden", covered(tracks["walker"]), 0.2, 0.75),
        Claim("Heavy prints over the walker's, in depth", depth(snow["heavy"]) / depth(snow["walker"]), 1.0, 4.0),
        Claim("Light prints over the walker's, in volume", _volume(snow["light"]) / _volume(snow["walker"]), 0.0, 0.15),
    ]


def _volume(steps: list[Footprint]) -> float:
    return float(np.mean([step.compressed_m3 for step in steps]))


def covered(steps: tuple[Footprint, ...]) -> float:
    """Part of a way along y, from the middle of its first print to that of its last, on which something was trodden."""
    size = steps[0].cell_size
    rows: set[int] = set()
    for step in steps:
        rows |= set((step.contact_cells // step.window.columns + step.window.row).tolist())
    ends = [step.position[1] / size for step in (steps[0], steps[-1])]
    way = np.arange(int(min(ends)), int(max(ends)) + 1)
    return float(np.isin(way, sorted(rows)).mean())


def shoot(built: Landscape, folder: Path, _samples: int) -> list[Path]:
    """All tracks from above, at the end."""
    tracks = {name: built.bakes["landscape"].of(walker.name) for name, walker in built.walkers.items()}
    return [plates.draw_plate(tracks, folder / "landscape.png")]


if __name__ == "__main__":
    production.main(__name__)
