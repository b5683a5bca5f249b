"""Fig. 5, force arrows: weight and momentum under each sole, and the ground's reaction, at moments of a walk.

Orange is the foot's share of the weight, blue what the motion adds to it or takes away, red the force of the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import production, stage
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Built, Claim, Options, Walker
from softground_addon.blender.reading import analysis
from softground_addon.blender.viewport import overlay_shapes
from softground_addon.core.loads.estimate import CharacterLoads

CELL_SIZE = 0.0075  # m
FRAMES = 72  # 3 s
PICTURE = (960, 420)

COLOURS = {"weight": (0.85, 0.30, 0.03), "momentum": (0.03, 0.22, 0.85), "total": (0.75, 0.02, 0.02)}


@dataclass(frozen=True)
class ForceArrows(Built):
    """A walk, its bake, and the forces on its soles at the steps of the simulation."""

    walker: bpy.types.Object
    loads: CharacterLoads


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> ForceArrows:
    """A walk over soil."""
    body = Body()
    walker = create_character("Hiker", body, scene.collection, production.COARSENESS)
    write_action(walker, walk(body, Gait(), FRAMES, scene.render.fps), "Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    options = {"shape_keys": "false"} | dict(options or {})
    bake = production.bake(scene, [Walker(walker, body.mass)], "Paper Soil", cell_size, options=options)
    return ForceArrows({"Soil": bake}, walker, analysis.read(scene).loads[0])


def claims(built: ForceArrows) -> list[Claim]:
    """The soles carry the body: all of it on average, more while it is caught, shared while both stand."""
    loads = built.loads
    weight = loads.motion.mass * loads.motion.gravity
    vertical = loads.forces.forces[..., 2] / weight
    momentum = loads.forces.momentum / weight
    total = vertical.sum(axis=1)
    stride = whole_strides(loads)
    both = (vertical > 0.05).all(axis=1)
    share = vertical / np.maximum(total, 1e-9)[:, None]
    return [
        Claim("Mean force over whole strides [body weights]", float(total[stride].mean()), 0.97, 1.03),
        Claim("Largest force on one sole [body weights]", float(vertical.max()), 1.03, 1.35),
        Claim("Force while the body vaults over one leg [body weights]", float(total[stride].min()), 0.5, 0.9),
        Claim("Smaller share at the middle of double support", float(share[both].min(axis=1).max()), 0.40, 0.5 + 1e-9),
        Claim("What landing adds to the weight, at most [body weights]", float(momentum.max()), 0.05, 0.5),
    ]


def whole_strides(loads: CharacterLoads) -> slice:
    """Whole strides: from the first landing of the left foot in the shot to its last."""
    left = loads.contacts.touching[:, 0]
    landings = np.flatnonzero(left[1:] & ~left[:-1]) + 1
    return slice(int(landings[0]), int(landings[-1]))


def moments(loads: CharacterLoads) -> list[int]:
    """Frames to show: the middle of each time that both feet stand, and of the single support that follows."""
    both = loads.contacts.touching.all(axis=1).astype(int)
    changes = np.flatnonzero(np.diff(both)) + 1
    middles = (changes[:-1] + changes[1:]) // 2
    return sorted({round(float(loads.motion.frames[step])) for step in middles})


def shoot(built: ForceArrows, folder: Path, samples: int) -> list[Path]:
    """The walker at several moments in one picture, with the arrows of each."""
    scene = bpy.context.scene
    materials = {kind: _glowing(f"SoftGround Sample {kind}", colour) for kind, colour in COLOURS.items()}
    frames = moments(built.loads)[::3]  # a metre apart
    for frame in frames:
        for arrow in overlay_shapes.arrows([built.loads], frame):
            stage.add_arrow(arrow.start, arrow.end, materials[arrow.kind], scene.collection)
    copies = stage.freeze(built.walker, frames, scene.collection)
    ghost = _ghost()
    for copy in copies:
        copy.data.materials.clear()
        copy.data.materials.append(ghost)
    heading = built.bakes["Soil"].footprints[0].heading
    stage.add_sun(scene, heading + radians(140), radians(28))
    stage.add_floor(-0.05, scene.collection)
    camera = stage.add_camera(scene, "Side", lens=60.0)
    low, high = stage.bounds(copies)
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    toward = heading + radians(60)
    scene.render.resolution_x, scene.render.resolution_y = PICTURE
    stage.frame_points(camera, corners, (cos(toward), sin(toward), -0.20))
    path = folder / "force_arrows.jpg"
    stage.render(scene, camera, path, PICTURE, samples)
    return [path]


def _ghost() -> bpy.types.Material:
    """Figures that let the arrows through."""
    material = stage.plain_material("SoftGround Sample ghost", (0.10, 0.11, 0.14), 0.9)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Alpha"].default_value = 0.26
    return material


def _glowing(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    """A plain colour that no shadow darkens."""
    material = stage.plain_material(name, (0.0, 0.0, 0.0), 1.0)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Emission Color"].default_value = (*colour, 1.0)
    shader.inputs["Emission Strength"].default_value = 1.0
    return material


if __name__ == "__main__":
    production.main(__name__)
