"""A fox trots over powder in the morning: each hind paw lands in the print of the forepaw, all in one line."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import firs, litter, open_air, production, stage
from sample_scenes.course import Course
from sample_scenes.dog import Dog
from sample_scenes.four_legged import TROT, go_on_four_legs
from sample_scenes.production import Bake, Claim, Options
from sample_scenes.stage import Array
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.shader_graph import Graph

CELL_SIZE = 0.004
"""Fine enough for toes [m]."""

PRESET = "Fresh Snow (field)"
POWDER = {"material.youngs_modulus": "190000", "tread": "0"}
"""A fox sinks in to the pasterns, and no deeper."""

BODY = Dog(withers=0.38, mass=6.0, brush=2.3)
GAIT = replace(TROT, speed=1.64, step_width=0.05, lift=0.30, crouch=0.02)
"""At this speed half a stride is as long as the trunk, so that hind paws land where the forepaws were."""
WAY = Course(((0.0, 0.0), (1.6, 0.0), (3.2, 0.22), (4.8, 0.65), (6.8, 1.05), (9.0, 0.95), (12.0, 0.3), (15.0, -0.6)))
"""A long bend over the level part of the ground [m]."""
FRAMES = 190
START = 2.3  # m along y; the fox goes toward -y
PICTURE = (1920, 1080)
HEIGHT = open_air.rolling(swell=0.12, hills=22.0, seed=6)
_SKY = (radians(8.0), 1.8)


def _stalks(x: Array, y: Array) -> Array:
    """Tufts of a square metre: in clumps beside the track, none on it."""
    clumps = np.sin(1.7 * x + 0.6) * np.sin(1.3 * y + 1.1 * x) + 0.5 * np.sin(3.1 * x - 2.3 * y)
    seen = (np.abs(x - 0.3) > 0.55) * (np.abs(x) < 9.0) * (y > -13.0) * (y < 1.4)
    return 9.0 * seen * np.clip(clumps - 0.35, 0.0, 1.0)


@dataclass(frozen=True)
class FoxInPowder:
    """One trot."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> FoxInPowder:
    """A snow field, and a fox that trots away from the camera."""
    ground = open_air.add_ground(scene, "Powder", (-14.0, START + 3.0), HEIGHT, "snow", {"stalks": _stalks})
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (0.26, 1.60, 0.33), (0.17, -0.9, 0.045), 36.0, (0.0, 0.2, 0.0), 14.0)
    motion = go_on_four_legs(BODY, GAIT, FRAMES, scene.render.fps, course=WAY)
    chosen = POWDER | dict(options or {})
    bake = open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen, motion, BODY)
    return FoxInPowder({PRESET: bake})


def claims(built: FoxInPowder) -> list[Claim]:
    """Prints as deep as the pasterns, hind paws in those of forepaws."""
    steps = built.bakes[PRESET].footprints
    hind = np.array([step.position[:2] for step in steps if step.sole.startswith("foot")])
    fore = np.array([step.position[:2] for step in steps if step.sole.startswith("hand")])
    apart = np.linalg.norm(hind[:, None] - fore, axis=-1).min(axis=1)
    return [
        Claim("Steps in the snow", len(steps), 50, 100),
        Claim("Depth of the deepest [m]", max(step.max_depth_m for step in steps), 0.03, 0.15),
        Claim("From a hind paw to the next print of a forepaw [m]", float(np.median(apart)), 0.0, 0.03),
    ]


def shoot(_built: FoxInPowder, folder: Path, samples: int) -> list[Path]:
    """From just above the snow, with the sun low ahead."""
    scene = bpy.context.scene
    scene.frame_set(scene.frame_end)
    open_air.add_low_sun(scene, radians(48), radians(9), (1.0, 0.74, 0.52), 8.0, 0.11, _SKY)
    chance = np.random.default_rng(4)
    spots = np.column_stack([chance.normal(0.0, 60.0, 150), -chance.uniform(30.0, 120.0, 150)])
    firs.add_firs(spots, chance.uniform(4.0, 12.0, len(spots)), HEIGHT, firs.WINTRY, snow=0.8)
    _add_stalks(scene.softground.ground, chance)
    figure = next(child for child in bpy.data.objects["Animal"].children if child.type == "MESH")
    coat = next(slot for slot in figure.material_slots if "coat" in slot.material.name.lower())
    coat.link, coat.material = "OBJECT", _fur()
    scene.view_settings.exposure = 0.5
    path = folder / "fox_in_powder.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def _add_stalks(baked: bpy.types.Object, chance: np.random.Generator) -> None:
    """Dry grass that looks out of the snow."""
    grass = litter.blades(open_air.tufts(chance), *litter.STRAW)
    ground = baked_ground.display_mesh_of(baked)
    litter.strew(
        ground, litter.pieces_of("Stalks", grass), "stalks", smallest=0.10, largest=0.34, law=1.2, lean=0.2, bend=1.3
    )


def _fur() -> bpy.types.Material:
    """Red above, white below and at the tip of the tail, with black legs, by the place in the resting figure."""
    material = stage.plain_material("SoftGround Sample fox", (0.36, 0.12, 0.03), 0.85)
    graph = Graph(material.node_tree)
    place = graph.out(graph.node("ShaderNodeTexCoord"))
    _, along, up = (graph.out(graph.node("ShaderNodeSeparateXYZ", {0: place}), axis) for axis in range(3))
    hair = graph.noise(place, 0.02, 3.0, 0.7) * 0.10 + -0.05
    colour = graph.mix(graph.noise(place, 0.06, 3.0), (0.30, 0.085, 0.018), (0.52, 0.20, 0.055))
    trunk = graph.ramp(along, 0.745, 0.765, 1.0, 0.0)
    colour = graph.mix(graph.ramp(up + hair, 0.42, 0.48, 1.0, 0.0) * trunk, colour, (0.60, 0.52, 0.43))
    colour = graph.mix(graph.ramp(up + hair, 0.26, 0.34, 1.0, 0.0) * trunk, colour, (0.018, 0.014, 0.012))
    colour = graph.mix(graph.ramp(along + hair, 0.93, 0.97), colour, (0.70, 0.66, 0.60))
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(colour.output, shader.inputs["Base Color"])
    bump = graph.node("ShaderNodeBump", {"Height": graph.noise(place, 0.012, 3.0, 0.7), "Distance": 0.01})
    material.node_tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    return material


if __name__ == "__main__":
    production.main(__name__)
