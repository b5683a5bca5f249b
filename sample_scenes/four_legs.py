"""A dog walks, and another trots: the order of the paws, and how they share the weight."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import plates, production
from sample_scenes.character import create_character
from sample_scenes.dog import FRONT_SHARE, Dog
from sample_scenes.four_legged import TROT, WALK, go_on_four_legs
from sample_scenes.keys import write_action
from sample_scenes.production import Built, Claim, Options, Walker
from softground_addon.blender.reading import analysis
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.record.footprints import Footprint

CELL_SIZE = 0.005  # m
FRAMES = 60  # 2.5 s
FOREPAWS = ("hand.L", "hand.R")
SEQUENCE = ("foot.L", "hand.L", "foot.R", "hand.R")
"""Order of a walk: each hind paw is followed by the forepaw of its side (Hildebrand 1965)."""
DIAGONALS = {"foot.L": "hand.R", "foot.R": "hand.L", "hand.L": "foot.R", "hand.R": "foot.L"}
APART = 0.9  # m between their ways


@dataclass(frozen=True)
class FourLegs(Built):
    """Two dogs on one ground, and the loads of each."""

    dogs: dict[str, bpy.types.Object]
    loads: dict[str, CharacterLoads]


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> FourLegs:
    """Side by side over mud."""
    body = Dog()
    dogs = {}
    scene.frame_start, scene.frame_end = 1, FRAMES
    for number, (name, gait) in enumerate({"walk": WALK, "trot": TROT}.items()):
        dog = create_character(f"Dog {name}", body, scene.collection)
        write_action(dog, go_on_four_legs(body, gait, FRAMES, scene.render.fps), name.title())
        dog.location.x = number * APART
        dogs[name] = dog
    walkers = [Walker(dog, body.mass, more=FOREPAWS) for dog in dogs.values()]
    chosen = {"shape_keys": "false"} | dict(options or {})
    bake = production.bake(scene, walkers, "Mud", cell_size, options=chosen)
    loads = dict(zip(dogs, analysis.read(scene).loads, strict=True))
    return FourLegs({"Mud": bake}, dogs, loads)


def steps_of(built: FourLegs, name: str) -> list[Footprint]:
    """The prints of a dog by their first contact, without those of the first half second, some of which had begun."""
    steps = built.bakes["Mud"].of(built.dogs[name].name)
    return sorted((step for step in steps if step.start_frame > 12), key=lambda step: step.start_frame)


def claims(built: FourLegs) -> list[Claim]:
    """Steps alternate in the right order and share the weight."""
    walk, trot = (steps_of(built, name) for name in ("walk", "trot"))
    following = [SEQUENCE[(SEQUENCE.index(a.sole) + 1) % 4] == b.sole for a, b in pairwise(walk)]
    apart = [
        min((abs(step.start_frame - o.start_frame) for o in trot if o.sole == DIAGONALS[step.sole]), default=np.inf)
        for step in trot[:-2]
    ]
    result = [
        Claim("Steps of the walk that follow in lateral sequence", float(np.mean(following)), 1.0, 1.0),
        Claim("Steps of the walk", float(len(walk)), 8, 20),
        Claim("Frames between the landings of a diagonal pair of the trot", float(np.max(apart)), 0.0, 1.5),
    ]
    for name, loads in built.loads.items():
        weight = loads.motion.mass * loads.motion.gravity
        vertical = loads.forces.forces[..., 2].mean(axis=0) / weight
        load = dict(zip((sole.sole.name for sole in loads.motion.soles), vertical, strict=True))
        front = (load["hand.L"] + load["hand.R"]) / vertical.sum()
        left = (load["hand.L"] + load["foot.L"]) / vertical.sum()
        result += [
            Claim(f"Mean force of the {name} [body weights]", float(vertical.sum()), 0.95, 1.05),
            Claim(f"Share of the forepaws in the {name}", float(front), FRONT_SHARE - 0.1, FRONT_SHARE + 0.1),
            Claim(f"Share of the left paws in the {name}", float(left), 0.45, 0.55),
        ]
    return result


def shoot(built: FourLegs, folder: Path, _samples: int) -> list[Path]:
    """Both tracks from above."""
    bake = built.bakes["Mud"]
    tracks = {name: bake.of(dog.name) for name, dog in built.dogs.items()}
    return [plates.draw_plate(tracks, folder / "four_legs.png")]


if __name__ == "__main__":
    production.main(__name__)
