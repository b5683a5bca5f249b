"""Bare feet step through a puddle and on over tiles: prints of water with toes, which dry within ten seconds."""

from __future__ import annotations

from math import radians
from pathlib import Path

import bpy

from gallery import open_air
from gallery.stone_floor import PICTURE, TOP, booked, crossed, slab
from sample_scenes import production, stage
from sample_scenes.body import Body, Foot
from sample_scenes.production import Built, Claim, Options
from softground_addon.blender import compat
from softground_addon.blender.carried import marks_object
from softground_addon.blender.nodes.node_modifiers import inputs_of

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PRESET = "Soil"
BODY = Body(foot=Foot(0.26, 0.098, bare=True))
FRAMES, SHOWN = 140, (100, 180, 260)
"""Frames of the walk, and those of the picture."""
PUDDLE, HALF_WIDTH, DEEP = (-1.1, 0.25), 0.45, 6e-4
"""Where the puddle is along the way, half its width and its height over the floor [m]."""
DRIES_FASTER = 150.0
"""So that prints are gone after ten seconds."""
CAMERA = (0.55, -1.1, 0.85), (-0.02, -2.15, 0.0), 28.0
"""Where it is and looks [m], and its lens [mm]."""


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Built:
    """A terrace beside dry soil, a puddle on it, and a walk over both."""
    puddle = scene.softground.hard_grounds.add()
    puddle.object = slab(scene, "Puddle", PUDDLE, TOP + DEEP, _water(), HALF_WIDTH)
    puddle.wet = "WATER"
    chosen = {"relief": "OFF", "tread": "0", "tread_pattern": "BARE"} | dict(options or {})
    return crossed(scene, PRESET, "soil", CAMERA, FRAMES, cell_size, chosen, body=BODY)


def claims(built: Built) -> list[Claim]:
    """What the feet took up is left or still on them."""
    return booked(built, (4, 9), (0.5, 8.0))


def shoot(built: Built, folder: Path, samples: int) -> list[Path]:
    """The terrace from behind with the sun ahead, at three times beside each other."""
    scene = bpy.context.scene
    open_air.add_low_sun(scene, radians(-150), radians(24), (1.0, 0.93, 0.84), 4.0, 0.35, open_air.PALE_DUSK)
    modifier = marks_object.of(built.bakes[PRESET].ground).modifiers[0]
    compat.write_input(modifier, inputs_of(modifier)["Time Scale"], DRIES_FASTER)
    size, pictures = (PICTURE[0] // 2, PICTURE[1]), []
    for frame in SHOWN:
        scene.frame_set(frame)
        pictures.append(folder / f"wet_feet_{frame}.png")
        stage.render(scene, scene.camera, pictures[-1], size, samples)
    return [*pictures, stage.contact_sheet(pictures, len(SHOWN), folder / "wet_feet.jpg")]


def _water() -> bpy.types.Material:
    """Shallow water."""
    material = stage.plain_material("Puddle", (0.12, 0.12, 0.11), 0.03)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Alpha"].default_value = 0.45
    return material


if __name__ == "__main__":
    production.main(__name__)
