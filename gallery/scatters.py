"""The same step in each kind of scatter that gives way: hair curves, instances, particles, leaves, a mesh of blades."""

from __future__ import annotations

from math import pi
from pathlib import Path

import bpy
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from gallery import autumn_leaves, litter, meadow, open_air
from sample_scenes import production, stage, terrain
from sample_scenes.production import Built
from sample_scenes.stage import Array
from softground_addon.blender.nodes.node_graph import NodeGraph
from softground_addon.blender.nodes.node_modifiers import new_group

CELL_SIZE, build, claims = autumn_leaves.CELL_SIZE, autumn_leaves.build, autumn_leaves.claims

EYE, TARGET, LENS = np.array((0.20, 0.36, 0.60)), np.array((0.0, -0.13, 0.03)), 34.0
"""Of the camera, from the step on [m], and its focal length over a picture 36 mm high [mm]."""
AFTER = 5.0
"""Frames from the end of the step to the pictures."""
ACROSS, AHEAD, BEHIND = 1.1, 1.6, 0.7
"""How far a scatter reaches from the step [m]."""
HEIGHT, WIDTHS = 240, ((320, 320, 320), (480, 480))
"""Of the pictures, row by row [px]."""
GREEN = (0.060, 0.085, 0.015), (0.22, 0.26, 0.06)
"""Dark and light colour of tufts."""
LARGEST, QUALITIES = 80_000, (80, 70, 62, 54, 46, 38)
"""Bytes of the sheet, and qualities to try."""


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """Each scatter by itself from the same place, and the sheet of all."""
    scene, step = bpy.context.scene, built.bakes[autumn_leaves.PRESET].footprints[autumn_leaves.STEP]
    autumn_leaves.dress(scene)
    stage.go_to(scene, step.end_frame + AFTER)
    stage.aim(scene.camera, step.position + EYE, step.position + TARGET)
    scene.camera.data.sensor_fit, scene.camera.data.sensor_height, scene.camera.data.lens = "VERTICAL", 36.0, LENS
    scene.camera.data.dof.use_dof = False
    chance = np.random.default_rng(2)
    scatters = {
        "Hair curves": _hair(_spots(step.position, 450, chance), chance),
        "Instances on points": _instances(_spots(step.position, 420, chance)),
        "Geometry Nodes scatter": autumn_leaves.strew_leaves(),
        "Particles made real": _particles(step.position, 700),
        "Mesh of loose blades": _loose(_spots(step.position, 3500, chance), chance),
    }
    tiles = []
    for (title, shown), width in zip(scatters.items(), (width for row in WIDTHS for width in row), strict=True):
        for others in scatters.values():
            for obj in others:
                obj.hide_render = others is not shown
        tiles.append(folder / f"scatters {title}.png")
        stage.render(scene, scene.camera, tiles[-1], (width, HEIGHT), samples)
    return [_sheet(dict(zip(scatters, tiles, strict=True)), folder / "scatters.jpg")]


def _spots(step: Array, density: float, chance: np.random.Generator) -> Array:
    """Places around a step, so many of a square metre, (N, 3) [m]."""
    count = int(density * 2.0 * ACROSS * (AHEAD + BEHIND))
    x, y = chance.uniform(-ACROSS, ACROSS, count) + step[0], chance.uniform(-AHEAD, BEHIND, count) + step[1]
    return np.column_stack([x, y, autumn_leaves.HEIGHT(x, y)])


def _giving_way(obj: bpy.types.Object, kind: str) -> list[bpy.types.Object]:
    """An object that gives way by the button."""
    production.make_active(obj)
    bpy.ops.softground.give_way(kind=kind)
    return [obj]


def _hair(spots: Array, chance: np.random.Generator) -> list[bpy.types.Object]:
    """Blades of the sample meadow."""
    return _giving_way(meadow.plant(spots, chance), "MEADOW")


def _instances(spots: Array) -> list[bpy.types.Object]:
    """Tufts on the vertices of a mesh, by a node of Blender's own."""
    tufts = litter.blades(open_air.tufts(np.random.default_rng(5)), *GREEN, name="tufts")
    mesh = bpy.data.meshes.new("Points")
    mesh.from_pydata(spots.tolist(), [], [])
    obj = bpy.data.objects.new("Tufts", mesh)
    bpy.context.scene.collection.objects.link(obj)
    graph = NodeGraph(new_group("Tufts on Points", "softground_sample"))
    shapes = graph.node("GeometryNodeCollectionInfo")
    shapes.inputs["Collection"].default_value = litter.pieces_of("Tufts", tufts)
    shapes.inputs["Separate Children"].default_value = shapes.inputs["Reset Children"].default_value = True
    placed = graph.node("GeometryNodeInstanceOnPoints")
    placed.inputs["Pick Instance"].default_value = True
    turn = graph.combined(0.0, 0.0, (litter.random(graph, 0, 1) * (2 * pi)).socket)
    size = litter.random(graph, 0, 2) * 0.06 + 0.05
    given = graph.node("NodeGroupInput").outputs["Geometry"]
    for source, name in (
        (given, "Points"),
        (shapes.outputs[0], "Instance"),
        (turn, "Rotation"),
        (size.socket, "Scale"),
    ):
        graph.link(source, placed.inputs[name])
    graph.finish(placed.outputs["Instances"])
    obj.modifiers.new("Tufts", "NODES").node_group = graph.tree
    return _giving_way(obj, "LAWN")


def _particles(step: Array, density: float) -> list[bpy.types.Object]:
    """Pebbles that a particle system instanced, made real and joined."""
    scene = bpy.context.scene
    x = terrain.spaced(step[0] - ACROSS, step[0] + ACROSS, 0.1)
    y = terrain.spaced(step[1] - AHEAD, step[1] + BEHIND, 0.1)
    emitter = terrain.add_terrain("Emitter", x, y, autumn_leaves.HEIGHT, "soil", scene.collection)
    system = emitter.modifiers.new("Pebbles", "PARTICLE_SYSTEM").particle_system
    how = system.settings
    how.count = int(density * 2.0 * ACROSS * (AHEAD + BEHIND))
    how.frame_start = how.frame_end = scene.frame_start
    how.lifetime, how.physics_type = 1e5, "NO"
    how.use_rotations, how.rotation_mode, how.phase_factor_random = True, "GLOB_Z", 2.0
    how.render_type, how.particle_size, how.size_random = "COLLECTION", 0.035, 0.75
    how.instance_collection = litter.stones((0.10, 0.09, 0.08), (0.42, 0.39, 0.34), rough=0.2)
    production.make_active(emitter)
    bpy.ops.object.duplicates_make_real()
    pebbles = [obj for obj in bpy.context.selected_objects if obj != emitter]
    bpy.data.objects.remove(emitter)
    bpy.context.view_layer.objects.active = pebbles[0]
    bpy.ops.object.make_single_user(object=True, obdata=True)
    bpy.ops.object.join()
    bpy.ops.object.transform_apply()
    return _giving_way(pebbles[0], "PEBBLES")


def _loose(spots: Array, chance: np.random.Generator) -> list[bpy.types.Object]:
    """Dry stalks of four faces each."""
    count = len(spots)
    along = np.linspace(0.0, 1.0, 5)[None, :, None]
    turn, height = chance.uniform(0.0, 2 * pi, count), chance.uniform(0.05, 0.14, count)
    ahead = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])[:, None]
    aside = 0.0022 * np.column_stack([-np.sin(turn), np.cos(turn), np.zeros(count)])[:, None] * (1.02 - along)
    lean = (height * chance.uniform(0.05, 0.6, count))[:, None, None] * along**2
    spine = spots[:, None] + ahead * lean + height[:, None, None] * along * (0.0, 0.0, 1.0)
    corners = np.stack([spine - aside, spine + aside], axis=2).reshape(-1, 3)
    quad = np.array([(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(4)])
    faces = (10 * np.arange(count)[:, None, None] + quad).reshape(-1, 4)
    look = litter.material("stalks", *litter.STRAW, 0.7, through=0.3)
    obj = bpy.data.objects.new("Stalks", litter.mesh_of("Stalks", corners, faces, look))
    bpy.context.scene.collection.objects.link(obj)
    return _giving_way(obj, "DRY_STALKS")


def _sheet(tiles: dict[str, Path], path: Path) -> Path:
    """The pictures side by side with their titles, in the first of some qualities that is no larger than may be."""
    whole = Image.new("RGB", (sum(WIDTHS[0]), HEIGHT * len(WIDTHS)))
    draw, font = ImageDraw.Draw(whole), ImageFont.load_default(17)
    places = [(sum(row[:number]), HEIGHT * line) for line, row in enumerate(WIDTHS) for number in range(len(row))]
    for (title, tile), (x, y) in zip(tiles.items(), places, strict=True):
        whole.paste(Image.open(tile).convert("RGB"), (x, y))
        draw.text(
            (x + 10, y + HEIGHT - 8), title, font=font, fill="white", anchor="ld", stroke_width=2, stroke_fill="#333"
        )
    for quality in QUALITIES:
        whole.save(path, quality=quality, optimize=True, progressive=True)
        if path.stat().st_size <= LARGEST:
            break
    return path


if __name__ == "__main__":
    production.main(__name__)
