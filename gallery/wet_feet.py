"""Feet step through a puddle and on over tiles: prints of water, which dry from the first on."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path

import bpy

from gallery import open_air
from gallery.muddy_boots import EDGE, END, PICTURE, START, TOP, height, slab, stone
from sample_scenes import production, stage
from sample_scenes.production import Bake, Claim, Options
from softground_addon.blender import compat
from softground_addon.blender.carried import marks_object
from softground_addon.blender.nodes.node_modifiers import inputs_of

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Soil"
FRAMES = 140
PUDDLE, HALF_WIDTH, DEEP = (-1.1, 0.25), 0.45, 6e-4
"""Where the puddle is along the way, half its width and its height over the floor [m]."""
DRIES_FASTER = 60.0
"""So that prints are gone after ten seconds."""


@dataclass(frozen=True)
class WetFeet:
    """One walk through a puddle."""

    bakes: dict[str, Bake]


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> WetFeet:
    """A terrace beside dry soil, a puddle on it, and a walk over both."""
    ground = open_air.add_ground(scene, "Yard", (-3.0, START + 2.0), height, "soil")
    hard = scene.softground.hard_grounds
    hard.add().object = slab(scene, "Floor", (END, EDGE), TOP, stone())
    puddle = hard.add()
    puddle.object = slab(scene, "Puddle", PUDDLE, TOP + DEEP, _water(), HALF_WIDTH)
    puddle.wet = "WATER"
    bpy.context.view_layer.update()
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    open_air.add_camera(scene, (1.15, 0.6, 1.15), (-0.05, -2.2, 0.0), 30.0, (0.0, -1.9, 0.0), 11.0)
    chosen = {"relief": "OFF", "tread": "0"} | dict(options or {})
    return WetFeet({PRESET: open_air.bake_walk(scene, ground, START, FRAMES, PRESET, cell_size, chosen)})


def claims(built: WetFeet) -> list[Claim]:
    """What the feet took up is left or still on them."""
    carried = built.bakes[PRESET].report["totals"]["carried_kg"]
    marks = marks_object.of(built.bakes[PRESET].ground)
    steps = {value.value for value in marks.data.attributes["step"].data}
    return [
        Claim("Wet prints", len(steps), 4, 9),
        Claim("Water that they weigh together [g]", 1e3 * carried["left_behind"], 0.5, 8.0),
        Claim(
            "Picked up less booked [kg]",
            carried["picked_up"] - carried["left_behind"] - carried["on_soles"],
            -1e-9,
            1e-9,
        ),
    ]


def shoot(built: WetFeet, folder: Path, samples: int) -> list[Path]:
    """The terrace from behind, with the sun ahead."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(-150), radians(24), (1.0, 0.93, 0.84), 4.0, 0.35, open_air.PALE_DUSK)
    modifier = marks_object.of(built.bakes[PRESET].ground).modifiers[0]
    compat.write_input(modifier, inputs_of(modifier)["Time Scale"], DRIES_FASTER)
    scene.frame_set(FRAMES)
    path = folder / "wet_feet.jpg"
    stage.render(scene, scene.camera, path, PICTURE, samples)
    return [path]


def _water() -> bpy.types.Material:
    """Shallow water."""
    material = stage.plain_material("Puddle", (0.12, 0.12, 0.11), 0.03)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Alpha"].default_value = 0.45
    return material


if __name__ == "__main__":
    production.main(__name__)
