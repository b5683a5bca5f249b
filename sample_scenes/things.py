"""Any contact: in soft snow a crate and an iron ball drop, a sled slides, somebody walks with a cane, another falls."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import plates, production, stage, terrain
from sample_scenes.body import Body
from sample_scenes.cane import create_cane, with_cane
from sample_scenes.character import copy_character, create_character
from sample_scenes.fall import LIMBS, fall_back
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import object_curves, write_action, write_curve
from sample_scenes.plain_objects import BOX, Look, add_object, box_corners
from sample_scenes.production import Built, Claim, Options, Walker
from sample_scenes.rolling_things import create_ball, drop, write_poses
from sample_scenes.snowshoe import snowshoe_mesh
from softground_addon.blender.reading import analysis
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.record.footprints import Footprint, recompose

CELL_SIZE = 0.015  # m
FRAMES = 56  # 2.3 s
MODULUS = 0.25e6  # Pa, the soft end of the paper's snow
SIDE, CRATE_MASS = 0.40, 30.0  # m, kg
RADIUS, BALL_MASS = 0.10, 30.0
DROP = 1.2  # m
SINKAGE = 0.002  # m over which crate and ball are stopped: the ground's time is longer
RUNNER, WIDTH, GAUGE = 1.3, 0.07, 0.46  # m of a sled's runners: length, width, distance
SLED_MASS, SPEED = 70.0, 1.1  # kg, m/s
SPACING = 0.08  # m between the vertices of the ground; the bake makes it finer where something prints
LOW, HIGH = (-3.2, -2.4), (2.2, 2.4)  # m
PLACES = {
    "walker": (0.1, 1.5),
    "sled": (1.25, 1.3),
    "crate": (-0.85, 0.75),
    "ball": (-0.85, -0.35),
    "faller": (-1.9, -1.3),
}
"""Where each starts [m]; walker and sled go toward -y, who falls backward falls toward +y."""


@dataclass(frozen=True)
class Things(Built):
    """One ground, who and what was on it, and their loads."""

    things: dict[str, bpy.types.Object]
    loads: dict[str, CharacterLoads]

    def prints(self, name: str) -> tuple[Footprint, ...]:
        """What one of them left."""
        return self.bakes["snow"].of(self.things[name].name)


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Things:
    """Five contacts of five kinds on one ground."""
    body, rate = Body(), scene.render.fps
    scene.frame_start, scene.frame_end = 1, FRAMES
    walker, cane = _walker(body, rate, scene.collection)
    faller = copy_character(walker, "Faller", scene.collection)
    faller.location.xy = PLACES["faller"]
    write_action(faller, fall_back(body, FRAMES, rate), "Fall")
    crate = _box("Crate", (SIDE, SIDE, SIDE), ("SoftGround Sample wood", (0.30, 0.17, 0.07), 0.7), scene.collection)
    crate.rotation_euler.z = radians(24)
    ball = create_ball("Ball", scene.collection, RADIUS)
    for thing, half in ((crate, SIDE / 2), (ball, RADIUS)):
        thing.location = (*PLACES[thing.name.lower()], half + DROP)
        drop(thing, DROP, SINKAGE, FRAMES, rate)
    sled, runners = _sled(rate, scene.collection)
    walkers = [
        Walker(walker, body.mass, held=[cane]),
        Walker(faller, body.mass, more=LIMBS),
        Walker(crate, CRATE_MASS),
        Walker(ball, BALL_MASS),
        Walker(runners[0], SLED_MASS, with_things=runners[1:]),
    ]
    x, y = (terrain.spaced(LOW[axis], HIGH[axis], SPACING) for axis in (0, 1))
    ground = terrain.add_terrain("Snow", x, y, terrain.flat, "snow", scene.collection)
    chosen = {"shape_keys": "false", "detail": "ALWAYS", "material.youngs_modulus": f"{MODULUS:g}"}
    bake = production.bake(scene, walkers, "Paper Snow", cell_size, ground=ground, options=chosen | dict(options or {}))
    things = {"walker": walker, "faller": faller, "crate": crate, "ball": ball, "sled": sled}
    return Things({"snow": bake}, things, dict(zip(things, analysis.read(scene).loads, strict=True)))


def _walker(body: Body, rate: float, collection: bpy.types.Collection) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Somebody with a cane in the left hand, and the cane."""
    walker = create_character("Walker", body, collection, production.COARSENESS)
    motion, tip, turn = with_cane(body, walk(body, Gait(speed=1.0), FRAMES, rate))
    write_action(walker, motion, "Walk")
    cane = create_cane("Cane.L", body, collection)
    for thing in (walker, cane):
        thing.location.xy = PLACES["walker"]
    bpy.context.view_layer.update()
    write_poses(cane, tip, turn, 1)
    return walker, cane


def _sled(rate: float, collection: bpy.types.Collection) -> tuple[bpy.types.Object, list[bpy.types.Object]]:
    """A box on two runners that slides along, and the runners, which print."""
    deck = _box("Sled", (GAUGE + 0.06, 0.9, 0.26), ("SoftGround Sample sled", (0.03, 0.14, 0.20), 0.5), collection)
    runners = []
    for side in (-1, 1):
        vertices, faces = snowshoe_mesh(RUNNER, WIDTH)
        mesh = bpy.data.meshes.new("Runner")
        mesh.from_pydata((vertices[:, [1, 0, 2]] * (1, -1, 1)).tolist(), [], faces[:, ::-1].tolist())
        mesh.materials.append(stage.plain_material("SoftGround Sample steel", (0.6, 0.6, 0.6), 0.3))
        runner = bpy.data.objects.new(f"Runner.{'LR'[side < 0]}", mesh)
        collection.objects.link(runner)
        runner.parent, runner.location = deck, (side * GAUGE / 2, -0.18, -0.16)
        runners.append(runner)
    lowest = min(vertex.co.z for vertex in runners[0].data.vertices)
    deck.location = (*PLACES["sled"], 0.16 - lowest)
    frames = np.arange(1.0, FRAMES + 1)
    _, curves = object_curves(deck, "Slide")
    write_curve(curves, "location", 1, frames, PLACES["sled"][1] - SPEED * (frames - 1) / rate)
    return deck, runners


def _box(name: str, size: tuple[float, float, float], look: Look, collection: bpy.types.Collection) -> bpy.types.Object:
    """A box around its origin."""
    half = np.array(size) / 2
    return add_object(name, box_corners(-half, half), BOX, look, collection)


def claims(built: Things) -> list[Claim]:
    """Everything presses by its own mass and with what touches."""
    bake = built.bakes["snow"]
    ground = recompose(bake.footprints)
    depth = {name: max(step.max_depth_m for step in built.prints(name)) for name in built.things if name != "sled"}
    tip = [step for step in built.prints("walker") if step.sole.startswith("Cane")]
    feet = [step for step in built.prints("walker") if not step.sole.startswith("Cane")]
    limbs = [step for step in built.prints("faller") if step.sole in LIMBS]
    weight = Body().mass * 9.81
    lying = built.loads["faller"].forces.forces[-4:, :, 2].mean(axis=0)
    runners = [step for step in bake.footprints if step.sole.startswith("Runner")]
    x, y = PLACES["sled"]
    along = np.arange(y - 0.4, y - SPEED * (FRAMES - 1) / 24.0, -CELL_SIZE / 2)
    ruts = [ground.sample(np.full(len(along), x + side * GAUGE / 2), along)[0] for side in (-1, 1)]
    spring = MODULUS / bake.layer_depth
    crate_force = max(step.peak_force_n for step in built.prints("crate"))
    return [
        Claim("Depth under the crate over force·L0/(E·A)", depth["crate"] * spring * SIDE**2 / crate_force, 0.5, 1.05),
        Claim(
            "Depth under the ball over that under the crate, of the same mass", depth["ball"] / depth["crate"], 2, 12
        ),
        Claim("Part of the sled's way with ruts", float(np.mean(np.array(ruts) > 1e-3)), 0.99, 1.0),
        Claim("Depth of the left rut over that of the right", float(ruts[0].mean() / ruts[1].mean()), 0.9, 1.1),
        Claim("Prints of the runners", float(len(runners)), 2, 12),
        Claim("Prints of the cane", float(len(tip)), 2, 4),
        Claim(
            "Area of the cane in its hole over that of its tip", max(s.area_m2 for s in tip) / (pi * 0.017**2), 0.9, 3.0
        ),
        Claim("Largest force on the cane [body weights]", max(s.peak_force_n for s in tip) / weight, 0.01, 0.6),
        Claim("Limbs that print under the one who fell", float(len({s.sole for s in limbs})), 5, len(LIMBS)),
        Claim("Force on the one who lies [body weights]", float(lying.sum() / weight), 0.9, 1.1),
        Claim(
            "Mean depth under the trunk of the one who lies over that of the walker's feet",
            _mean_depth([s for s in limbs if s.sole in ("hips", "chest")]) / _mean_depth(feet),
            0.05,
            0.8,
        ),
    ]


def _mean_depth(steps: list[Footprint]) -> float:
    """Mean depth of some prints, each by its largest area [m]."""
    return float(np.mean([step.compressed_m3 / step.area_m2 for step in steps]))


def shoot(built: Things, folder: Path, _samples: int) -> list[Path]:
    """All prints from above."""
    return [plates.draw_plate({name: built.prints(name) for name in built.things}, folder / "things.png")]


if __name__ == "__main__":
    production.main(__name__)
