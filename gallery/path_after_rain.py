"""A walk along a forest path, after a shower: water stands in the prints and in hollows, and mirrors the sky."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, radians
from pathlib import Path

import bpy
import numpy as np

from gallery import broadleaf, firs, litter, open_air
from sample_scenes import production, stage
from sample_scenes.production import Built, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender import compat
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.blender.playback import weather_modifier
from softground_addon.blender.playback.own_data import RIM
from softground_addon.blender.weather import ground_weather as weather

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Mud"
FRAMES = 260
START = 2.6  # m along y; the walk is toward -y
PICTURE = (1920, 1080)
SUN = radians(-48.0)
"""Where the sun stands, from the way toward +x [rad]."""
NEEDLES = (0.030, 0.052, 0.026)
"""Colour of those on firs."""
RAIN = 5.0  # mm/h: rounds edges, and leaves treads
WATER_TABLE = 1.9  # cm below the brims: half of the floor of a print is under water
PUDDLES = np.array(
    [
        (0.74, -0.55, 0.36, 0.62, 0.046),
        (-0.95, -1.70, 0.42, 0.85, 0.048),
        (0.70, -3.60, 0.50, 1.00, 0.052),
        (-0.80, -5.60, 0.46, 1.20, 0.055),
        (0.75, -8.20, 0.55, 1.50, 0.060),
        (-0.60, -11.5, 0.60, 1.90, 0.060),
    ]
)
"""Hollows beside the way: middle, half width, half length and depth [m]."""
LEVEL = -0.016  # m, of the water in them
REFRACTION = 1.33
TURBID = 0.05
"""Depth of water that hides the bed of a puddle [m]."""
SPACING = 0.07  # m between vertices: shores are uneven
_HILLS = open_air.rolling(swell=0.22, hills=14.0, seed=8)


def height(x: Array, y: Array) -> Array:
    """A trodden path between low banks, uneven, with hollows [m]."""
    bank = np.clip((np.abs(x) - 1.0 - 0.15 * np.sin(0.9 * y) - 0.1 * np.sin(2.1 * y + 1.0)) / 0.7, 0.0, 1.0)
    near = np.clip((14.0 - np.hypot(x, y)) / 4.0, 0.0, 1.0)
    beside = np.clip((np.abs(x) - 0.15) / 0.25, 0.3, 1.0)
    uneven = near * beside * (0.008 * open_air.waves(x, y, 0.75, 3) + 0.004 * open_air.waves(x, y, 0.32, 4))
    return _HILLS(x, y) + 0.11 * bank**2 * (3.0 - 2.0 * bank) - hollow(x, y) + uneven


def hollow(x: Array, y: Array) -> Array:
    """How deep the puddles' beds are below the path [m]."""
    depth = np.zeros(np.broadcast(x, y).shape)
    for middle, along, wide, long, deep in PUDDLES:
        bent = x - middle - 0.10 * np.sin(3.1 * (y - along) + 7.0 * middle) - 0.05 * np.sin(7.3 * y)
        depth += deep * np.exp(-((bent / wide) ** 2) - ((y - along) / long) ** 2)
    return depth


def _rim(x: Array, y: Array) -> Array:
    """Mud that swells here, and tears or is carried off there."""
    return np.clip(0.35 + 0.75 * open_air.waves(x, y, 0.24, 6), 0.0, 1.2)


def _firmness(x: Array, y: Array) -> Array:
    """Soft and hard places."""
    return 1.45 * np.exp(0.3 * open_air.waves(x, y, 0.5, 7))


def _damp(x: Array, y: Array) -> Array:
    """How near the ground is to the water of the puddles: 1 under it, 0 on dry places."""
    return np.clip((0.022 - (height(x, y) - LEVEL)) / 0.022, 0.0, 1.0) * (np.abs(x) < 1.8)


def _beside(way: float, bank: float) -> Callable[[Array, Array], Array]:
    """So many pieces on a square metre of the way, and of the forest floor beside it; none far from the camera."""

    def density(x: Array, y: Array) -> Array:
        share = np.clip((np.abs(x) - 0.5) / 0.7, 0.0, 1.0)
        seen = np.clip((y + 26.0) / 16.0, 0.0, 1.0) ** 2 * (y < 2.5) * np.clip((9.0 - np.abs(x)) / 4.0, 0.0, 1.0)
        return seen * (way + (bank - way) * share) * (height(x, y) > LEVEL)

    return density


def _swept(density: Callable[[Array, Array], Array]) -> Callable[[Array, Array], Array]:
    """A density of what boots sweep aside: nothing lies where the nearest of them went."""

    def left(x: Array, y: Array) -> Array:
        aside = np.clip((np.abs(x) - 0.30) / 0.25, 0.0, 1.0)
        return density(x, y) * np.maximum(aside, 0.7 * np.clip((-1.2 - y) / 1.5, 0.0, 1.0))

    return left


PAINTED = {
    "softground_rim_factor": _rim,
    "softground_stiffness": _firmness,
    "damp": _damp,
    "leaves": _swept(_beside(40.0, 170.0)),
    "needles": _swept(_beside(110.0, 480.0)),
    "crumbs": _beside(260.0, 160.0),
    "stones": _beside(70.0, 30.0),
    "twigs": _beside(5.0, 16.0),
    "growth": _beside(-60.0, 60.0),
}
"""Pieces of a square metre, by kind."""


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A wide ground, a walk away from the camera, and a shower on its prints."""
    ground = open_air.add_ground(scene, "Path", (-20.0, START + 3.0), height, "mud", PAINTED, SPACING)
    open_air.add_camera(scene, (0.28, 1.38, 0.40), (-0.05, -1.2, 0.02), 28.0, (0.05, 0.2, 0.0), 9.0, picture=PICTURE)
    chosen = {"tread": "0.006", "relief_strength": "0.7"} | dict(options or {})
    built = open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen)
    modifier = weather.add(built.bakes[PRESET].ground)
    weather.set_preset(modifier, "SHOWER")
    for name, value in {"Rain": RAIN, "Water Table": WATER_TABLE}.items():
        compat.write_input(modifier, weather_modifier.inputs_of(modifier)[name], value)
    return built


def claims(built: Built) -> list[Claim]:
    """A track of the depth of boots in mud."""
    steps = built.bakes[PRESET].footprints
    return [
        Claim("Steps in the mud", len(steps), 12, 40),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.01, 0.08),
    ]


def shoot(_built: Built, folder: Path, samples: int) -> list[Path]:
    """From the height of a knee, toward the evening sun that comes through the trees at the side."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    stage.hide(bpy.data.objects["Hiker"])  # long out of sight
    open_air.add_low_sun(scene, SUN + pi / 2, radians(20), (1.0, 0.78, 0.54), 9.0, 0.34, (radians(16.0), 1.1))
    chance = np.random.default_rng(5)
    near = _add_trees(chance)
    ground = baked_ground.display_mesh_of(scene.softground.ground)
    _soak(ground)
    _add_litter(ground, chance)
    _add_puddles(scene)
    _add_roots(scene, near, chance)
    scene.view_settings.exposure, scene.render.image_settings.quality = 1.15, 82
    path = folder / "path_after_rain.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def _add_trees(chance: np.random.Generator) -> Array:
    """A forest that lets some sunlight through to the way; the places of the trees next to it, (N, 2) [m]."""
    sides = np.where(chance.random(340) < 0.5, -1.0, 1.0)
    spots = np.column_stack([sides * (4.5 + chance.gamma(1.4, 9.0, 340)), -chance.uniform(13.0, 75.0, 340)])
    end = np.column_stack([chance.normal(-1.0, 6.0, 34), -chance.uniform(40.0, 80.0, 34)])  # where the way bends off
    spots = np.concatenate([spots, end])
    heights = 6.0 * chance.lognormal(0.45, 0.4, len(spots))
    lit = np.abs(np.arctan2(spots[:, 0], -spots[:, 1]) - SUN) < radians(9.0)
    firs.add_firs(spots[~lit], heights[~lit], height, NEEDLES)
    bushes = np.column_stack([sides[:90] * (3.4 + chance.gamma(1.3, 2.0, 90)), -chance.uniform(7.0, 40.0, 90)])
    leaves = (0.030, 0.045, 0.010), (0.12, 0.14, 0.035)
    broadleaf.add_broadleaves(bushes, chance.uniform(0.4, 1.7, 90), height, *leaves, stem=0.02, seed=40)
    near = np.array([(-2.6, -5.2), (2.9, -3.9), (-3.9, -9.0), (2.9, -9.5), (-2.9, -13.0), (4.6, -7.2), (5.2, -4.4)])
    beyond = np.array([(-5.4, -3.6), (-7.0, -6.6), (-8.2, -5.4), (-6.3, -4.9)])  # trunks between the sun and the way
    tall = np.concatenate([near, beyond])
    firs.add_firs(tall, chance.uniform(14.0, 19.0, len(tall)), height, NEEDLES, seed=9, crown=0.32)
    return near[:4]


def _soak(ground: bpy.types.Object) -> None:
    """Rain darkens all of the ground and leaves it shining, in patches and around the puddles."""
    for material in ground.data.materials:
        tree, graph = material.node_tree, Graph(material.node_tree)
        place = graph.out(graph.node("ShaderNodeNewGeometry"))
        patches = graph.ramp(graph.noise(place, 0.30, 4.0, 0.6), 0.40, 0.62)
        ragged = graph.attribute("damp") + graph.noise(place, 0.06, 4.0, 0.65) * 0.7 + -0.35
        shore = graph.ramp(ragged, 0.05, 0.75)
        torn = graph.ramp(graph.attribute(RIM), 0.0005, 0.004)
        shine = graph.math("MAXIMUM", patches * 0.85, shore) * graph.math("SUBTRACT", 1.0, torn * 0.85)
        for shader in open_air.darken(material, graph.blend(shore, graph.blend(patches, 0.46, 0.36), 0.24), graph):
            tree.links.new(graph.blend(shine, 0.80, 0.20).output, shader.inputs["Roughness"])
            tree.links.new(graph.blend(shine, 0.10, 0.5).output, shader.inputs["Specular IOR Level"])


def _add_litter(ground: bpy.types.Object, chance: np.random.Generator) -> None:
    """Leaves, needles, crumbs, stones, twigs and grass, which the boots have bent, buried and soiled."""
    grass = litter.blades(open_air.tufts(chance), (0.045, 0.060, 0.014), (0.115, 0.125, 0.040))
    crumbs = litter.stones((0.050, 0.030, 0.018), (0.120, 0.074, 0.044), 0.75)
    stones = litter.stones((0.09, 0.075, 0.06), (0.20, 0.175, 0.145), 0.5, rough=0.2)
    brown, ochre = (0.042, 0.018, 0.007), (0.20, 0.085, 0.022)
    flat = {"lean": 0.18, "bend": 0.15, "bury": 0.12}
    litter.strew(ground, litter.leaves(brown, ochre), "leaves", smallest=0.035, largest=0.075, law=2.2, seed=1, **flat)
    fallen = litter.needles((0.045, 0.022, 0.010), (0.17, 0.085, 0.034))
    litter.strew(ground, fallen, "needles", smallest=0.03, largest=0.07, seed=2, lean=0.05, bury=0.2)
    litter.strew(
        ground, crumbs, "crumbs", smallest=0.004, largest=0.022, lean=pi, bend=pi / 2, depth=0.1, bury=1.0, seed=3
    )
    litter.strew(
        ground, stones, "stones", smallest=0.004, largest=0.04, lean=pi, bend=pi / 2, depth=0.1, bury=0.8, seed=4
    )
    wood = litter.twigs((0.050, 0.034, 0.022), (0.15, 0.11, 0.075))
    litter.strew(ground, wood, "twigs", smallest=0.05, largest=0.45, law=1.4, lean=0.06, bury=0.03, seed=5)
    torn = litter.clods((0.040, 0.025, 0.015), (0.085, 0.054, 0.033))
    litter.strew(
        ground, torn, 1.6e5, where=RIM, smallest=0.004, largest=0.028, law=1.8, lean=pi, bend=pi, depth=0.2, seed=11
    )
    growth = litter.pieces_of("Grass", grass)
    litter.strew(ground, growth, "growth", smallest=0.05, largest=0.30, law=1.2, lean=0.2, bend=1.4, bury=0.05, seed=6)


def _add_puddles(scene: bpy.types.Scene) -> None:
    """Level water over the hollows, clear at its edge and turbid where it is deep, with leaves and needles afloat."""
    x, y = np.meshgrid(np.arange(-1.6, 1.6, 0.02), np.arange(-16.0, 1.6, 0.02))
    depth = LEVEL - height(x, y)
    mesh = litter.mesh_of(
        "Puddles", np.stack([x, y, np.full_like(x, LEVEL)], -1).reshape(-1, 3), _where(depth > -0.014), _puddle_water()
    )
    drifted = np.clip(0.3 + 0.9 * open_air.waves(x, y, 0.5, 5), 0.0, 1.5)
    afloat = (depth > 0.001) * drifted * (0.25 + np.exp(-(((depth - 0.004) / 0.006) ** 2)))
    for name, values in {"depth": depth, "afloat": afloat}.items():
        mesh.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", values.astype(np.float32).ravel())
    water = bpy.data.objects.new("Puddles", mesh)
    scene.collection.objects.link(water)
    leaves, fallen = (bpy.data.collections[name] for name in ("Leaves", "Needles"))
    litter.strew(water, leaves, 55.0, where="afloat", smallest=0.03, largest=0.07, law=2.2, lean=0.06, seed=1)
    litter.strew(water, fallen, 110.0, where="afloat", smallest=0.03, largest=0.07, lean=0.02, seed=2)


def _where(chosen: Array) -> Array:
    """Corners of the squares of a grid whose corner is chosen, (F, 4)."""
    columns = chosen.shape[1]
    corner = np.flatnonzero(chosen[:-1, :-1] & chosen[1:, 1:])
    corner = corner // (columns - 1) * columns + corner % (columns - 1)
    return corner[:, None] + [0, 1, columns + 1, columns]


def _puddle_water() -> bpy.types.Material:
    """Still water that mirrors the sky: clear over the shore, turbid where it is deep."""
    material = stage.plain_material("SoftGround Sample puddle", (0.115, 0.078, 0.047), 0.02)
    tree, graph = material.node_tree, Graph(material.node_tree)
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["IOR"].default_value = REFRACTION
    place = graph.out(graph.node("ShaderNodeNewGeometry"))
    ripples = graph.node(
        "ShaderNodeBump", {"Height": graph.noise(place, 0.06, 1.0), "Distance": 0.001, "Strength": 0.15}
    )
    tree.links.new(ripples.outputs[0], shader.inputs["Normal"])
    ragged = graph.noise(place, 0.22, 3.0, 0.6) * 0.010 + graph.noise(place, 0.035, 4.0, 0.65) * 0.009 + -0.0095
    depth = graph.attribute("depth") + ragged
    mirror = graph.out(graph.node("ShaderNodeFresnel", {"IOR": REFRACTION, "Normal": graph.out(ripples)}))
    sky = graph.node(
        "ShaderNodeBsdfGlossy",
        {"Roughness": graph.ramp(depth, -0.002, 0.006, 0.22, 0.02), "Normal": graph.out(ripples)},
    )
    clear = graph.node("ShaderNodeBsdfTransparent", {"Color": (0.80, 0.70, 0.58, 1.0)})
    thin = graph.node("ShaderNodeMixShader", {0: mirror, 1: graph.out(clear), 2: graph.out(sky)})
    water = graph.node("ShaderNodeMixShader", {0: graph.ramp(depth, 0.0, TURBID, 0.0, 0.85), 1: graph.out(thin)})
    tree.links.new(shader.outputs[0], water.inputs[2])
    ashore = graph.out(graph.node("ShaderNodeBsdfTransparent"))
    shown = graph.node("ShaderNodeMixShader", {0: graph.ramp(depth, -0.006, 0.006), 1: ashore, 2: graph.out(water)})
    tree.links.new(shown.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


def _add_roots(scene: bpy.types.Scene, spots: Array, chance: np.random.Generator) -> None:
    """Roots from trees toward the way, which dive before they reach it."""
    lines = []
    for place in spots:
        for _ in range(5):
            end = np.array((np.sign(place[0]) * chance.uniform(0.45, 1.0), place[1] + chance.normal(0.2, 1.0)))
            along = np.linspace(0.0, 1.0, 24)
            way = place + (end - place) * along[:, None]
            way[:, 1] += 0.12 * np.sin(chance.uniform(5, 9) * along + chance.uniform(0, 6)) * along
            thick = chance.uniform(0.025, 0.05)
            up = thick * (0.55 - 1.3 * along**3 + 0.25 * np.sin(11 * along + chance.uniform(0, 6)))
            lines.append((np.column_stack([way, height(*way.T) + up]), thick))
    vertices, faces = litter.tubes(lines, 10)
    look = litter.material("root", (0.026, 0.018, 0.012), (0.042, 0.029, 0.019), 1.0)
    scene.collection.objects.link(bpy.data.objects.new("Roots", litter.mesh_of("Roots", vertices, faces, look)))


if __name__ == "__main__":
    production.main(__name__)
