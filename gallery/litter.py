"""What lies and grows on a ground, as instances that a foot bends, buries and darkens: a node group to learn from.

It reads what a bake leaves on the mesh (`softground_rest`, `softground_compression`) and needs nothing of the add-on:
pieces are strewn over the undisturbed ground, so that none jumps while it moves, and then go where it went.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import bpy
import numpy as np

from sample_scenes import stage
from sample_scenes.stage import Array
from softground_addon.blender import compat
from softground_addon.blender.nodes.node_graph import NodeGraph
from softground_addon.blender.nodes.node_modifiers import GroupInput, inputs_of, new_group
from softground_addon.blender.nodes.shader_graph import Colour, Graph
from softground_addon.blender.playback.own_data import COMPRESSION, REST

GROUP = MARK = "SoftGround Litter"
PRESSED = "softground_pressed"
"""Of an instance, for its material: from 0 to 1, how far a foot has pressed it."""
TOUCHED, BURIED = 0.0005, 0.008
"""Compression of the ground from which on pieces move with it, and at which they are pressed in for good [m]."""

INPUTS = (
    GroupInput("Ground", None, "The mesh that shows the prints", kind="Object"),
    GroupInput(
        "Pieces", None, "Objects of size 1 that lie on the ground, one picked for each place", kind="Collection"
    ),
    GroupInput("Density", 1.0, "Pieces per square metre"),
    GroupInput("Where", "", "Float attribute of the ground that multiplies the density", kind="String"),
    GroupInput("Smallest", 0.01, "Size of the smallest piece [m]"),
    GroupInput("Largest", 0.05, "Size of the largest piece [m]"),
    GroupInput("Law", 1.8, "How much more small ones there are: N larger than s goes as s to minus this"),
    GroupInput("Lean", 0.3, "Largest angle from upright of a piece that no foot has pressed [rad]"),
    GroupInput("Bend", 0.0, "Angle from upright of a piece that a foot has pressed [rad]"),
    GroupInput("Depth", 0.0, "How deep pieces lie in the ground, in sizes"),
    GroupInput("Bury", 0.3, "How much deeper a foot may press them, in sizes"),
    GroupInput("Seed", 0, "Another number strews them elsewhere", kind="Int"),
)


def ensure_group() -> Any:
    """The node group, made on first use."""
    known = next((tree for tree in bpy.data.node_groups if tree.get(MARK)), None)
    if known is not None:
        return known
    graph = NodeGraph(new_group(GROUP, MARK, INPUTS))
    chosen = graph.node("NodeGroupInput").outputs
    seed = chosen["Seed"]

    info = graph.node("GeometryNodeObjectInfo")
    graph.link(chosen["Ground"], info.inputs["Object"])
    position = graph.node("GeometryNodeInputPosition").outputs["Position"]
    rest = graph.attribute(REST, "FLOAT_VECTOR")
    baked = graph.node("GeometryNodeInputNamedAttribute", data_type="FLOAT_VECTOR")
    graph.link(REST, baked.inputs["Name"])
    undisturbed = graph.choose("VECTOR", baked.outputs["Exists"], position, rest)
    moved = graph.vector("SUBTRACT", position, undisturbed)
    ground = graph.store(info.outputs["Geometry"], "moved", moved, True, "FLOAT_VECTOR")
    painted = graph.node("GeometryNodeInputNamedAttribute", data_type="FLOAT")
    graph.link(chosen["Where"], painted.inputs["Name"])
    share = graph.choose("FLOAT", painted.outputs["Exists"], 1.0, painted.outputs["Attribute"])
    density = graph.math("MULTIPLY", chosen["Density"], share)
    strewn = graph.node("GeometryNodeDistributePointsOnFaces", distribute_method="RANDOM")
    for source, name in (
        (graph.put(ground, True, undisturbed), "Mesh"),
        (density, "Density"),
        (seed, "Seed"),
    ):
        graph.link(source, next(each for each in strewn.inputs if each.name == name and each.enabled))

    pressed = graph.node("ShaderNodeMapRange", interpolation_type="SMOOTHSTEP")
    for source, index in ((graph.attribute(COMPRESSION), 0), (TOUCHED, 1), (BURIED, 2)):
        graph.link(source, pressed.inputs[index])
    points = graph.store(strewn.outputs["Points"], PRESSED, pressed.outputs[0], True)
    down = graph.number(graph.attribute(PRESSED))
    size = _size(graph, chosen, seed)
    sunk = (graph.number(chosen["Depth"]) + graph.number(chosen["Bury"]) * random(graph, seed, 1) * down) * size
    offset = graph.combined(0.0, 0.0, (0.0 - sunk).socket)
    offset = graph.vector("ADD", graph.attribute("moved", "FLOAT_VECTOR"), offset)
    points = graph.forgotten(graph.put(points, True, position, offset), "moved")

    upright = random(graph, seed, 2) * graph.number(chosen["Lean"])
    lean = upright + (graph.number(chosen["Bend"]) - upright) * down
    turn = graph.combined(lean.socket, 0.0, (random(graph, seed, 3) * (2 * pi)).socket)
    shapes = graph.node("GeometryNodeCollectionInfo")
    shapes.inputs["Separate Children"].default_value = shapes.inputs["Reset Children"].default_value = True
    graph.link(chosen["Pieces"], shapes.inputs["Collection"])
    placed = graph.node("GeometryNodeInstanceOnPoints")
    placed.inputs["Pick Instance"].default_value = True
    pick = (random(graph, seed, 4) * 1000.0).socket
    for source, name in (
        (points, "Points"),
        (shapes.outputs[0], "Instance"),
        (pick, "Instance Index"),
        (turn, "Rotation"),
        (size.socket, "Scale"),
    ):
        graph.link(source, placed.inputs[name])
    graph.finish(placed.outputs["Instances"])
    return graph.tree


def random(graph: NodeGraph, seed: Any, number: int) -> Any:
    """A number from 0 to 1 for each piece."""
    node = graph.node("FunctionNodeRandomValue", data_type="FLOAT")
    graph.link(graph.math("ADD", seed, 100.0 * number), next(each for each in node.inputs if each.name == "Seed"))
    return graph.number(next(output for output in node.outputs if output.enabled))


def _size(graph: NodeGraph, chosen: Any, seed: Any) -> Any:
    """Sizes by a power law between the smallest and the largest [m]."""
    smallest, law = graph.number(chosen["Smallest"]), graph.number(chosen["Law"])
    ratio = graph.number(graph.math("POWER", (smallest / graph.number(chosen["Largest"])).socket, law.socket))
    still = 1.0 - random(graph, seed, 5) * (1.0 - ratio)
    return smallest * graph.number(graph.math("POWER", still.socket, graph.math("DIVIDE", -1.0, law.socket)))


def strew(ground: bpy.types.Object, pieces: bpy.types.Collection, density: float | str, **values: Any) -> Any:
    """An object of pieces on a ground, with values of `INPUTS` in lower case.

    Parameters
    ----------
    ground : bpy.types.Object
        The mesh that shows the prints.
    pieces : bpy.types.Collection
    density : float or str
        Pieces per square metre, or the name of an attribute of the ground that says so.
    """
    strewn = bpy.data.objects.new(pieces.name, bpy.data.meshes.new(pieces.name))
    strewn.parent = ground
    modifier: Any = strewn.modifiers.new(GROUP, "NODES")
    modifier.node_group = ensure_group()
    inputs = inputs_of(modifier)
    given = {name.title(): value for name, value in values.items()} | {"Ground": ground, "Pieces": pieces}
    given["Where" if isinstance(density, str) else "Density"] = density
    for name, value in given.items():
        compat.write_input(modifier, inputs[name], value)
    bpy.context.scene.collection.objects.link(strewn)
    return strewn


def pieces_of(name: str, meshes: Sequence[bpy.types.Mesh]) -> bpy.types.Collection:
    """A collection of shapes, in no scene."""
    collection = bpy.data.collections.new(name)
    for mesh in meshes:
        collection.objects.link(bpy.data.objects.new(mesh.name, mesh))
    return collection


def material(name: str, dark: Colour, light: Colour, roughness: float, through: float = 0.0) -> bpy.types.Material:
    """Of pieces that no two are alike of, and that are darker where a foot has pressed them.

    `through` is the share of the light that shines through them.
    """
    made = stage.plain_material(f"SoftGround Sample {name}", light, roughness)
    graph = Graph(made.node_tree)
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    seed = graph.out(graph.node("ShaderNodeObjectInfo"), 5)
    pressed = graph.out(graph.node("ShaderNodeAttribute", attribute_type="INSTANCER", attribute_name=PRESSED), 2)
    soiled = tuple(0.35 * part for part in dark)
    colour = graph.mix(pressed * 0.85, graph.mix(seed, dark, light), soiled)
    made.node_tree.links.new(colour.output, shader.inputs["Base Color"])
    if through:
        shines = graph.node("ShaderNodeBsdfTranslucent", {0: colour})
        both = graph.node("ShaderNodeMixShader", {0: through, 2: graph.out(shines)})
        made.node_tree.links.new(shader.outputs[0], both.inputs[1])
        made.node_tree.links.new(both.outputs[0], made.node_tree.get_output_node("ALL").inputs["Surface"])
    return made


def mesh_of(name: str, vertices: Array, faces: Any, look: bpy.types.Material, *, smooth: bool = True) -> bpy.types.Mesh:
    """A mesh from places (N, 3) and the corners of its faces."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(vertices).tolist(), [], np.asarray(faces).tolist())
    mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), smooth))
    mesh.materials.append(look)
    return mesh


STRAW = (0.20, 0.135, 0.07), (0.40, 0.30, 0.17)
"""Dark and light colour of dead grass."""


def blades(
    tufts: Sequence[bpy.types.Mesh], dark: Colour, light: Colour, name: str = "blades"
) -> Sequence[bpy.types.Mesh]:
    """Tufts of grass, now of other colours and soiled where a foot has pressed them; a material for each name."""
    look = material(name, dark, light, 0.6, through=0.3)
    for tuft in tufts:
        tuft.materials.clear()
        tuft.materials.append(look)
    return tufts


def leaves(
    dark: Colour, light: Colour, count: int = 6, name: str = "leaf", through: float = 0.25
) -> bpy.types.Collection:
    """Fallen leaves, folded along the middle and curled; a material for each name."""
    look = material(name, dark, light, 0.55, through)
    return pieces_of("Leaves", [_leaf(np.random.default_rng(number), look) for number in range(count)])


def _leaf(chance: np.random.Generator, look: bpy.types.Material) -> bpy.types.Mesh:
    along = np.linspace(0.0, 1.0, 9)
    half = chance.uniform(0.24, 0.36) * np.sin(pi * along**0.8) ** 0.8 + 0.006
    half *= 1.0 + 0.10 * np.where(np.arange(9) % 2, 1.0, -1.0) * np.sin(pi * along)
    fold, curl, twist = chance.uniform(0.1, 0.7), chance.uniform(-0.25, 0.45), chance.uniform(-0.5, 0.5)
    rows = []
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        side = share * half
        lift = fold * np.abs(side) + curl * (along - 0.5) ** 2 + twist * side * (along - 0.5)
        rows.append(np.column_stack([along - 0.5, side, lift + 0.03 + 0.35 * share**2 * half**2]))
    stalk = np.array([(-0.5, -0.006, 0.05), (-0.5, 0.006, 0.05), (-0.72, 0.006, 0.02), (-0.72, -0.006, 0.02)])
    vertices = np.concatenate([*rows, stalk])
    faces = [(9 * r + i, 9 * r + i + 1, 9 * r + i + 10, 9 * r + i + 9) for r in range(4) for i in range(8)]
    return mesh_of("Leaf", vertices, [*faces, (45, 46, 47, 48)], look)


def twigs(dark: Colour, light: Colour, count: int = 4) -> bpy.types.Collection:
    """Bent twigs with a fork or two, of length about 1."""
    look = material("twig", dark, light, 0.85)
    return pieces_of("Twigs", [_twig(np.random.default_rng(number), look) for number in range(count)])


def _twig(chance: np.random.Generator, look: bpy.types.Material) -> bpy.types.Mesh:
    along = np.linspace(-0.5, 0.5, 9)[:, None]
    line = np.column_stack(
        [along, np.cumsum(chance.normal(0.0, 0.03, 9)), 0.02 + 0.01 * np.cumsum(chance.normal(0, 0.5, 9))]
    )
    lines = [(line, 0.016)]
    for start in chance.integers(2, 7, 2):
        way = np.array((1.0, chance.choice((-1.0, 1.0)) * chance.uniform(0.6, 1.1), 0.15))
        lines.append((line[start] + np.linspace(0.0, chance.uniform(0.15, 0.35), 5)[:, None] * way, 0.008))
    return mesh_of("Twig", *tubes(lines), look)


def tubes(lines: Sequence[tuple[Array, float]], around: int = 6, taper: float = 0.35) -> tuple[Array, Array]:
    """Vertices and quads of tubes on lines (N, 3), with a radius at their start [m] and `taper` times it at the end."""
    vertices, faces, first = [], [], 0
    for line, radius in lines:
        ahead = np.gradient(line, axis=0)
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        aside = np.cross(ahead, (0.0, 0.0, 1.0))
        aside /= np.linalg.norm(aside, axis=1, keepdims=True)
        turn = 2 * pi * np.arange(around) / around
        ring = np.cos(turn)[:, None] * aside[:, None] + np.sin(turn)[:, None] * np.cross(aside, ahead)[:, None]
        thick = radius * np.linspace(1.0, taper, len(line))[:, None, None]
        vertices.append((line[:, None] + thick * ring).reshape(-1, 3))
        row, column = np.meshgrid(np.arange(len(line) - 1), np.arange(around), indexing="ij")
        ahead_of = (column + 1) % around
        quad = [
            row * around + column,
            (row + 1) * around + column,
            (row + 1) * around + ahead_of,
            row * around + ahead_of,
        ]
        faces.append(first + np.stack(quad, axis=-1).reshape(-1, 4))
        first += len(line) * around
    return np.concatenate(vertices), np.concatenate(faces)


def needles(dark: Colour, light: Colour, count: int = 4) -> bpy.types.Collection:
    """Fir needles as they lie, some dozens within a radius of 1."""
    look = material("needle litter", dark, light, 0.8)
    shapes = []
    for number in range(count):
        chance = np.random.default_rng(number)
        middle = np.column_stack([chance.normal(0.0, 0.5, (60, 2)), chance.uniform(0.0, 0.10, 60)])
        turn, tilt = chance.uniform(0, 2 * pi, 60), chance.normal(0.0, 0.15, 60)
        ahead = 0.25 * np.column_stack([np.cos(turn), np.sin(turn), tilt])
        aside = 0.009 * np.column_stack([-np.sin(turn), np.cos(turn), np.full(60, 0.3)])
        corners = np.stack(
            [middle - ahead - aside, middle + ahead - aside, middle + ahead + aside, middle - ahead + aside], 1
        )
        shapes.append(mesh_of("Needles", corners.reshape(-1, 3), np.arange(240).reshape(-1, 4), look, smooth=False))
    return pieces_of("Needles", shapes)


def stones(
    dark: Colour, light: Colour, roughness: float = 0.8, rough: float = 0.35, count: int = 6
) -> bpy.types.Collection:
    """Pebbles or crumbs of diameter about 1: `rough` is how far their corners are from a ball."""
    look = material("stone" if rough < 0.3 else "crumb", dark, light, roughness)
    return pieces_of("Stones", [_stone(np.random.default_rng(number), look, rough) for number in range(count)])


def _stone(chance: np.random.Generator, look: bpy.types.Material, rough: float) -> bpy.types.Mesh:
    corners, faces = stage.ball(2)
    plane = chance.normal(size=(5, 3))
    plane /= np.linalg.norm(plane, axis=1, keepdims=True)
    over = np.clip(corners @ plane.T - chance.uniform(0.5, 0.8, 5), 0.0, None)  # cut by planes: angular
    corners = corners - (1.0 if rough >= 0.3 else 0.5) * over @ plane
    corners = corners * (1.0 + rough * chance.uniform(-0.35, 0.35, (len(corners), 1)))
    corners = 0.5 * corners * (1.0, chance.uniform(0.65, 1.0), chance.uniform(0.55, 0.8))
    return mesh_of("Stone", corners, faces, look)


def clods(dark: Colour, light: Colour, count: int = 6) -> bpy.types.Collection:
    """Lumps of broken earth of diameter about 1, for the foreground: faces where they broke, grains all over."""
    look = material("clod", dark, light, 0.95)
    return pieces_of("Clods", [_clod(np.random.default_rng(number), look) for number in range(count)])


def _clod(chance: np.random.Generator, look: bpy.types.Material) -> bpy.types.Mesh:
    corners, faces = stage.ball(5)
    plane = chance.normal(size=(7, 3))
    plane /= np.linalg.norm(plane, axis=1, keepdims=True)
    over = np.clip(corners @ plane.T - chance.uniform(0.35, 0.75, 7), 0.0, None)
    rough = np.zeros(len(corners))
    for wave in (2.5, 5.0, 9.0, 17.0):
        way = wave * chance.normal(size=(6, 3))
        rough += 0.55 / wave * np.sin(corners @ way.T + chance.uniform(0, 2 * pi, 6)).sum(axis=1) / 2.4
    corners = (corners - 0.9 * over @ plane) * (1.0 + rough + chance.normal(0.0, 0.012, len(corners)))[:, None]
    corners = 0.55 * corners * (1.0, chance.uniform(0.6, 1.0), chance.uniform(0.5, 0.8))
    return mesh_of("Clod", corners, faces, look, smooth=False)
