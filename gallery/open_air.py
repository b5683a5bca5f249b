"""What pictures out of doors have in common: ground to the horizon, a walk, sky and low sun, trees, a sharp camera."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import atan, e, pi, radians

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import ArrayLike

from sample_scenes import production, stage, terrain
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.dog import Dog
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.motion import BodyMotion
from sample_scenes.production import Built, Options, Walker
from sample_scenes.stage import Array
from softground_addon.blender.nodes.shader_graph import Colour, Graph, Socket

NEAR, FAR = 9.0, 600.0
"""Half the width of the ground that is even, and of all of it [m]."""

SPACING, _GROWTH = 0.15, 1.055
"""Between vertices of the even part [m], and how much wider each further row is."""

_CORRIDOR = 1.2  # m to either side of the way, as level as the walk is animated for


def places(low: float, high: float, spacing: float = SPACING) -> Array:
    """Places along one axis, `spacing` apart from low to high and ever wider apart to the horizon [m]."""
    beyond = spacing * np.cumsum(_GROWTH ** np.arange(1, 140))
    beyond = beyond[beyond < FAR]
    even = terrain.spaced(low, high, spacing)
    return np.concatenate([even[0] - beyond[::-1], even, even[-1] + beyond])


def rolling(swell: float, hills: float, seed: int = 0) -> terrain.Field:
    """Height of a ground that is level along x = 0 and rises to hills.

    Parameters
    ----------
    swell : float
        Height of the waves beside the way [m].
    hills : float
        Height of the hills at the horizon [m].
    """
    waves = np.random.default_rng(seed)
    near = [(waves.uniform(1.3, 6.0), waves.uniform(0, pi), waves.uniform(0, 2 * pi)) for _ in range(9)]
    far = [(200.0 / 1.35**number, waves.uniform(0, pi), waves.uniform(0, 2 * pi)) for number in range(9)]

    def summed(sines: list[tuple[float, float, float]], x: Array, y: Array) -> Array:
        return sum(
            length * np.sin((x * np.cos(way) + y * np.sin(way)) * 2 * pi / length + phase)
            for length, way, phase in sines
        ) / sum(length for length, *_ in sines)

    def height(x: Array, y: Array) -> Array:
        aside = np.clip((np.abs(x) - _CORRIDOR) / 4.0, 0.0, 1.0) ** 1.5
        away = np.clip((np.hypot(x, y) - 45.0) / 320.0, 0.0, 1.0) ** 1.6
        ridges = 1.0 - np.abs(2.0 * summed(far, x, y))
        return swell * aside * summed(near, x, y) + hills * away * ridges

    return height


def waves(x: Array, y: Array, size: float, seed: int) -> Array:
    """Irregular waves about 0, mostly within 1, of about a length `size` [m]."""
    chance = np.random.default_rng(seed)
    total = np.zeros(np.broadcast(x, y).shape)
    for _ in range(7):
        way, length = chance.uniform(0, 2 * pi), size * chance.uniform(0.7, 1.6)
        total += np.sin((x * np.cos(way) + y * np.sin(way)) * 2 * pi / length + chance.uniform(0, 2 * pi))
    return total / 2.6


def add_ground(
    scene: bpy.types.Scene,
    name: str,
    along: tuple[float, float],
    height: terrain.Field,
    surface: str,
    painted: Mapping[str, terrain.Field] | None = None,
    spacing: float = SPACING,
) -> bpy.types.Object:
    """Ground to the horizon, with vertices `spacing` apart around the way and from one y to another `along` it [m]."""
    x, y = places(-NEAR, NEAR, spacing), places(*along, spacing)
    return terrain.add_terrain(name, x, y, height, surface, scene.collection, painted)


def bake_walk(
    scene: bpy.types.Scene,
    ground: bpy.types.Object,
    start: float,
    frames: int,
    preset: str,
    cell_size: float | None,
    options: Options | None,
    motion: BodyMotion | None = None,
    body: Body | Dog | None = None,
    beside: Sequence[Walker] = (),
) -> Built:
    """A hiker, or an animal, who goes along the way toward -y, from y = `start` [m], in prints for close-ups.

    A hiker walks, unless another `motion` of so many frames is given; others may print `beside` him. The camera is
    there first: relief is fine where it comes near.
    """
    body = body or Body()
    name = "Hiker" if isinstance(body, Body) else "Animal"
    walker = create_character(name, body, scene.collection)
    walker.location = (0.0, start, 0.0)
    if motion is None:
        assert isinstance(body, Body), "an animal needs a motion"
        motion = walk(body, Gait(), frames, scene.render.fps)
    write_action(walker, motion, "Walk")
    scene.frame_start, scene.frame_end = 1, frames
    chosen = {"shape_keys": "false", "relief": "CLOSE_UP", "detail": "ALWAYS", "sink_feet": "true"}
    chosen |= dict(options or {})
    more = () if isinstance(body, Body) else ("hand.L", "hand.R")
    walkers = [Walker(walker, body.mass, more=more), *beside]
    return Built({preset: production.bake(scene, walkers, preset, cell_size, ground=ground, options=chosen)})


_SUN_WIDTH = radians(0.7)
_SUN_OF_SKY = radians(1.5)
"""So low that the sky takes the colours of dusk."""
_OZONE = 3.0
"""Of the sky, in that of a clear day: what turns dusk blue overhead."""
PALE_DUSK = (radians(4.5), 2.4)
"""Sun and ozone of a sky that is pale at the horizon, where a lower sun makes it mustard."""
DAY = (radians(14.0), 1.0)
"""Those of a sky by day, in which stone and what lies on it keep their colours."""


def add_low_sun(
    scene: bpy.types.Scene,
    toward: float,
    elevation: float,
    colour: tuple[float, float, float],
    sun: float,
    sky: float,
    of_sky: tuple[float, float] = (_SUN_OF_SKY, _OZONE),
) -> None:
    """The sun of the other scenes, of another colour and strength [W/m²], below a sky in which it is lower still.

    `of_sky` is how high the sky's own sun stands [rad], and its ozone in that of a clear day.
    """
    stage.add_sun(scene, toward, elevation)
    light = next(lamp for lamp in bpy.data.lights if lamp.type == "SUN")
    light.energy, light.color, light.angle = sun, colour, _SUN_WIDTH
    nodes = {node.type: node for node in scene.world.node_tree.nodes}
    nodes["TEX_SKY"].sun_elevation, nodes["TEX_SKY"].ozone_density = of_sky
    nodes["BACKGROUND"].inputs[1].default_value = sky


def darken(material: bpy.types.Material, share: Socket | float, graph: Graph | None = None) -> list[bpy.types.Node]:
    """Leave a share of the colour of a ground, as rain does; returns the shaders.

    A share that is a socket needs the `graph` that it comes from.
    """
    tree, graph = material.node_tree, graph or Graph(material.node_tree)
    shaders = [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"]
    for shader in shaders:
        colour = shader.inputs["Base Color"]
        darker = graph.node("ShaderNodeVectorMath", {"Scale": share}, operation="SCALE")
        tree.links.new(colour.links[0].from_socket, darker.inputs[0])
        tree.links.new(darker.outputs[0], colour)
    return shaders


def overgrow(material: bpy.types.Material, share: str, dark: Colour, light: Colour) -> None:
    """Tint a ground with what grows there, as far as the attribute `share` says."""
    tree, graph = material.node_tree, Graph(material.node_tree)
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    tint = graph.ramp(graph.noise(place, 0.05, 4.0, 0.7), 0.3, 0.7)
    patches = graph.noise(place, 1.7, 3.0, 0.6) * 0.8 + -0.4
    cover = graph.ramp(graph.attribute(share) + patches, 0.2, 0.9)
    for shader in [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"]:
        colour = shader.inputs["Base Color"]
        grown = graph.mix(cover, dark, graph.mix(tint, dark, light))
        bare = next(each for each in grown.output.node.inputs if each.identifier == "A_Color")
        tree.links.new(colour.links[0].from_socket, bare)
        tree.links.new(grown.output, colour)
    dull(graph, tree, graph.blend(cover, 1.0, 0.0))


def dull(graph: Graph, tree: bpy.types.NodeTree, share: Socket | float) -> None:
    """Leave a share of the gloss of a ground: toward a low sun it makes concrete of earth."""
    for shader in [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"]:
        gloss = shader.inputs["Specular IOR Level"]
        less = graph.node("ShaderNodeMath", {0: gloss.default_value, 1: share}, operation="MULTIPLY")
        if gloss.links:
            tree.links.new(gloss.links[0].from_socket, less.inputs[0])
        tree.links.new(less.outputs[0], gloss)


_LOW = 0.05
"""Sine of the height over the horizon up to which haze hides most of the sky."""


def add_haze(world: bpy.types.World, colour: Colour, distance: float) -> None:
    """Air before all that is there now: over a distance [m], 63 % of the light becomes that of the air."""
    for material in bpy.data.materials:
        shown = material.node_tree.get_output_node("ALL").inputs["Surface"] if material.node_tree else None
        if shown and shown.links:
            graph = Graph(material.node_tree)
            away = graph.out(graph.node("ShaderNodeCameraData"), 2) * (-1.0 / distance)
            _mix_air(graph, shown, graph.node("ShaderNodeEmission", {"Color": (*colour, 1.0)}), away)
            material.cycles.emission_sampling = "NONE"
    graph = Graph(world.node_tree)
    ray = graph.node("ShaderNodeSeparateXYZ", {0: graph.out(graph.node("ShaderNodeTexCoord"))})
    height = graph.math("MAXIMUM", graph.out(ray, 2), 0.0) * (1.0 / _LOW)
    hidden = graph.math("LOGARITHM", graph.math("SUBTRACT", 1.0001, graph.math("EXPONENT", height * -1.0, 0.0)), e)
    air = graph.node("ShaderNodeBackground", {"Color": (*colour, 1.0)})
    _mix_air(graph, world.node_tree.get_output_node("ALL").inputs["Surface"], air, hidden)


def _mix_air(graph: Graph, shown: bpy.types.NodeSocket, air: bpy.types.Node, exponent: Socket) -> None:
    """Leave e to the `exponent` of what is shown, and add that much air as is missing."""
    mixed = graph.node("ShaderNodeMixShader", {0: graph.math("EXPONENT", exponent, 0.0), 1: graph.out(air)})
    links = shown.id_data.links
    links.new(shown.links[0].from_socket, mixed.inputs[2])
    links.new(mixed.outputs[0], shown)


def add_camera(
    scene: bpy.types.Scene,
    eye: ArrayLike,
    target: ArrayLike,
    lens: float,
    focus: ArrayLike,
    f_stop: float,
    picture: tuple[int, int] | None = None,
) -> bpy.types.Object:
    """A camera that is sharp at `focus`, with the size of the `picture` that it takes [pixels], if that is new."""
    if picture:
        scene.render.resolution_x, scene.render.resolution_y = picture
    camera = stage.add_camera(scene, "Camera", lens)
    stage.aim(camera, eye, target)
    camera.data.clip_end = 2 * FAR
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = (Vector(focus) - Vector(eye)).length
    camera.data.dof.aperture_fstop = f_stop
    scene.camera = camera
    return camera


_FILM = 0.9
"""How far beyond the shore sand shines from the last wave [m]."""


def add_sea(scene: bpy.types.Scene, shore: Callable[[Array], Array], level: float, ground: terrain.Field) -> None:
    """Water from a shore x(y) toward -x and to the horizon, at a level [m]: a thin sheet with foam where it runs up."""
    out = np.concatenate([np.arange(-_FILM, 8.0, 0.05), np.geomspace(8.0, FAR, 30)])
    out, along = np.meshgrid(out, places(-30.0, 4.0))
    x = shore(along) - out
    swell = 0.06 * np.clip(out / 6.0 - 0.3, 0.0, 1.0) * np.sin(1.7 * x + 0.6 * np.sin(0.35 * along))
    sheet = ground(x, along) + 0.0015 + 0.004 * np.clip(out / 0.15, 0.0, 1.0)
    rows, columns = x.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    mesh = bpy.data.meshes.new("Sea")
    mesh.from_pydata(
        np.stack([x, along, np.maximum(sheet, level + swell)], axis=-1).reshape(-1, 3).tolist(),
        [],
        (corner[:, None] + [0, columns, columns + 1, 1]).tolist(),
    )
    mesh.shade_smooth()
    weight = np.clip(out / 0.12, 0.0, 1.0)
    fields = {
        "film": np.clip(1.0 + out / _FILM, 0.0, 1.0),
        "body": np.clip((out - 0.2) / 2.5, 0.0, 1.0),
        "foam": weight
        * (
            np.exp(-out / 0.12)
            + 0.75 * np.exp(-(((out - 0.55) / 0.45) ** 2))
            + 0.8 * np.exp(-(((out - 3.2) / 0.35) ** 2))
        ),
    }
    for name, values in fields.items():
        mesh.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", values.astype(np.float32).ravel())
    mesh.materials.append(_water())
    scene.collection.objects.link(bpy.data.objects.new("Sea", mesh))


def _water() -> bpy.types.Material:
    """Ripples that mirror the sky, clear where they are thin, and a lace of foam."""
    material = stage.plain_material("SoftGround Sample sea", (0.015, 0.06, 0.07), 0.08)
    tree = material.node_tree
    graph = Graph(tree)
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    film, body, foam = (graph.attribute(name) for name in ("film", "body", "foam"))
    aside = graph.node("ShaderNodeVectorMath", {0: place, 1: (7.3, 1.9, 0.0)}, operation="ADD")
    drift = graph.node(
        "ShaderNodeCombineXYZ",
        {0: graph.noise(place, 0.15, 4.0) * 0.22, 1: graph.noise(graph.out(aside), 0.15, 4.0) * 0.22},
    )
    stirred = graph.out(graph.node("ShaderNodeVectorMath", {0: place, 1: graph.out(drift)}, operation="ADD"))
    wide, middle, fine = (
        graph.out(graph.node("ShaderNodeTexVoronoi", {"Vector": stirred, "Scale": scale}, feature="DISTANCE_TO_EDGE"))
        for scale in (7.0, 24.0, 80.0)
    )
    patches = graph.ramp(graph.noise(place, 0.7, 4.0), 0.38, 0.62, 0.15, 1.0)
    ragged = graph.noise(place, 0.2, 5.0, 0.6) * 0.9
    holes = wide * -1.0 + middle * -0.9 + fine * -0.5
    lace = graph.ramp(foam * patches + ragged + holes, 0.30, 1.05) * 0.9
    ripples = graph.node(
        "ShaderNodeBump", {"Height": graph.noise(place, 0.5, 3.0), "Distance": 0.05, "Strength": body * 0.6}
    )
    colour = graph.mix(lace, (0.02, 0.075, 0.085), (0.85, 0.84, 0.80))
    sea = graph.node(
        "ShaderNodeBsdfPrincipled", {"Base Color": colour, "Roughness": 0.08, "Normal": graph.out(ripples)}
    )
    mirror = graph.out(graph.node("ShaderNodeFresnel", {"IOR": 1.33}))
    wet = graph.node("ShaderNodeBsdfGlossy", {"Roughness": 0.12, "Color": (1.0, 1.0, 1.0, 1.0)})
    clear = graph.node("ShaderNodeBsdfTransparent")
    thin = graph.node(
        "ShaderNodeMixShader", {0: mirror * graph.ramp(film, 0.0, 1.0), 1: graph.out(clear), 2: graph.out(wet)}
    )
    cover = graph.math("MAXIMUM", graph.ramp(body, 0.0, 1.0), lace)
    mixed = graph.node("ShaderNodeMixShader", {0: cover, 1: graph.out(thin), 2: graph.out(sea)})
    tree.links.new(mixed.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


def add_grass(
    spots: Array,
    heights: Array,
    ground: terrain.Field,
    seed: int = 0,
    shapes: Sequence[bpy.types.Mesh] | None = None,
) -> None:
    """Tufts of bent blades on a ground, at places (N, 2), so high (N,) [m]; green, unless other `shapes` are given."""
    chance = np.random.default_rng(seed)
    shapes = shapes or tufts(chance)
    for number, ((x, y), height) in enumerate(zip(spots, heights, strict=True)):
        tuft = bpy.data.objects.new("Grass", shapes[number % len(shapes)])
        tuft.location = (x, y, float(ground(np.array(x), np.array(y))) - 0.01)
        tuft.rotation_euler.z, tuft.scale = chance.uniform(0, 2 * pi), (height, height, height)
        bpy.context.scene.collection.objects.link(tuft)


def tufts(chance: np.random.Generator) -> list[bpy.types.Mesh]:
    """Grass of height about 1."""
    return [_tuft(chance) for _ in range(5)]


def _tuft(chance: np.random.Generator) -> bpy.types.Mesh:
    """Blades of length about 1, each of three quads and a tip, which lean out of a common root."""
    blades = 60
    turn, lean = chance.uniform(0, 2 * pi, (2, blades))
    lean = 0.15 + 0.9 * (lean / (2 * pi)) ** 1.5
    length, width = chance.uniform(0.45, 1.1, blades), chance.uniform(0.008, 0.016, blades)
    ahead = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(blades)])
    aside = np.column_stack([-np.sin(turn), np.cos(turn), np.zeros(blades)]) * width[:, None]
    root = 0.12 * ahead * chance.uniform(0, 1, (blades, 1))
    along = np.linspace(0.0, 1.0, 4)
    out = length[:, None] * np.sin(lean[:, None] * along) * along
    up = length[:, None] * np.cos(lean[:, None] * along) * along
    spine = root[:, None] + ahead[:, None] * out[..., None] + np.array((0, 0, 1.0)) * up[..., None]
    thin = (1.0 - along)[None, :, None]
    vertices = np.stack([spine - aside[:, None] * thin, spine + aside[:, None] * thin], axis=2).reshape(-1, 3)
    quad = np.array([(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(3)])
    faces = (8 * np.arange(blades)[:, None, None] + quad).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Grass")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    mesh.materials.append(stage.plain_material("SoftGround Sample grass", (0.055, 0.060, 0.018), 0.7))
    return mesh


_GLOW = 0.35
"""Of a flake: light goes through it, so that it is bright also where the sun stands behind [W/m²]."""


def add_snowfall(camera: bpy.types.Object, count: int, aspect: float, seed: int = 0) -> bpy.types.Object:
    """Flakes of 3 to 8 mm in the air that a camera sees, as one mesh of lumps, no two alike."""
    chance = np.random.default_rng(seed)
    depth = 0.7 + 26.0 * chance.random(count) ** 0.8
    half = np.tan(atan(18.0 / camera.data.lens))
    across = depth * half * chance.uniform(-1.1, 1.1, count)
    up = depth * half / aspect * chance.uniform(-1.1, 1.1, count)
    centres = np.column_stack([across, up, -depth])
    sizes = chance.uniform(0.0015, 0.0038, count)
    corners, sides = stage.ball(2)
    lumps = corners * chance.uniform(0.6, 1.15, (count, len(corners), 1))
    vertices = (centres[:, None] + sizes[:, None, None] * lumps).reshape(-1, 3)
    faces = (np.arange(count)[:, None, None] * len(corners) + sides).reshape(-1, 3)
    world = np.array(camera.matrix_world)
    vertices = vertices @ world[:3, :3].T + world[:3, 3]
    high = np.repeat(vertices.reshape(count, -1, 3)[:, :, 2].min(axis=1) > 0.05, len(sides))
    mesh = bpy.data.meshes.new("Snowfall")
    mesh.from_pydata(vertices.tolist(), [], faces[high].tolist())
    mesh.shade_smooth()
    flake = stage.plain_material("SoftGround Sample flake", (0.9, 0.9, 0.92), 0.7)
    shader = next(node for node in flake.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Emission Color"].default_value = (1.0, 0.95, 0.9, 1.0)
    shader.inputs["Emission Strength"].default_value = _GLOW
    mesh.materials.append(flake)
    flakes = bpy.data.objects.new("Snowfall", mesh)
    flakes.visible_shadow = False  # a flake blurs its shadow as it falls
    bpy.context.scene.collection.objects.link(flakes)
    return flakes
