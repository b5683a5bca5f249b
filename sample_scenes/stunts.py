"""Fig. 10, a dance, a kick and a cartwheel in sand: whatever bears the body prints, the hands too."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import plates, production
from sample_scenes.body import Body
from sample_scenes.cartwheel import cartwheel
from sample_scenes.character import copy_character, create_character
from sample_scenes.keys import write_action
from sample_scenes.production import Built, Claim, Options, Walker
from sample_scenes.showpieces import dance, kick
from softground_addon.blender.reading import analysis
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.record.footprints import Footprint

CELL_SIZE = 0.0075  # m
FRAMES = 100
PLACES = {"dance": (-1.1, 1.0), "kick": (1.1, 1.3), "cartwheel": (-1.6, -0.9)}  # m
SHOWN = {"dance": 62, "kick": 28, "cartwheel": 31}
"""Frames of a step aside, the kick, and upside down."""
HANDS = ("hand.L", "hand.R")


@dataclass(frozen=True)
class Stunts(Built):
    """One ground under three performers, and the loads of each."""

    performers: dict[str, bpy.types.Object]
    loads: dict[str, CharacterLoads]


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Stunts:
    """Each at a place of their own, all facing the same way."""
    body, rate = Body(), scene.render.fps
    scene.frame_start, scene.frame_end = 1, FRAMES
    motions = {
        "dance": dance(body, FRAMES, rate),
        "kick": kick(body, 60, rate),
        "cartwheel": cartwheel(body, None, rate),
    }
    performers: dict[str, bpy.types.Object] = {}
    for name, motion in motions.items():
        if performers:
            performers[name] = copy_character(performers["dance"], name.title(), scene.collection)
        else:
            performers[name] = create_character(name.title(), body, scene.collection, production.COARSENESS)
        performers[name].location.xy = PLACES[name]
        write_action(performers[name], motion, name.title())
    walkers = [
        Walker(performer, body.mass, more=HANDS if name == "cartwheel" else ())
        for name, performer in performers.items()
    ]
    chosen = {"shape_keys": "false", "tread": "0.002"} | dict(options or {})
    bake = production.bake(scene, walkers, "Loose Dry Sand", cell_size, options=chosen)
    loads = dict(zip(performers, analysis.read(scene).loads, strict=True))
    return Stunts({"sand": bake}, performers, loads)


def claims(built: Stunts) -> list[Claim]:
    """Hands bear the body while it is upside down; one leg bears it while the other kicks."""
    bake = built.bakes["sand"]
    steps = {name: bake.of(performer.name) for name, performer in built.performers.items()}
    hands = [step for step in steps["cartwheel"] if step.sole in HANDS]
    turned = [built.loads["cartwheel"].motion.frames, _vertical(built.loads["cartwheel"])]
    upside_down = np.abs(turned[0] - SHOWN["cartwheel"]) < 2.0
    on_hands = turned[1][upside_down][:, 2:].sum(axis=1).mean() / turned[1][upside_down].sum(axis=1).mean()
    kicking = np.abs(built.loads["kick"].motion.frames - SHOWN["kick"]) < 1.5
    return [
        Claim("Prints of hands", float(len(hands)), 2, 2),
        Claim("Supports of the cartwheel in the order foot, hand, hand, foot, foot", float(_in_order(steps)), 1, 1),
        Claim("Part of the force on the hands while upside down", float(on_hands), 0.95, 1.0),
        Claim(
            "Force on one leg during the kick [body weights]",
            float(_vertical(built.loads["kick"])[kicking].max()),
            0.8,
            1.4,
        ),
        Claim(
            "Mean force of the dance [body weights]",
            float(_vertical(built.loads["dance"]).sum(axis=1).mean()),
            0.95,
            1.05,
        ),
        Claim("Prints of the dance", float(len(steps["dance"])), 6, 30),
    ]


def _in_order(steps: dict[str, tuple[Footprint, ...]]) -> bool:
    """True if the prints that begin after the start are those of a cartwheel to the left."""
    later = sorted((step for step in steps["cartwheel"] if step.start_frame > 4), key=lambda step: step.start_frame)
    return [step.sole for step in later] == ["foot.L", "hand.L", "hand.R", "foot.R", "foot.L"]


def _vertical(loads: CharacterLoads) -> np.ndarray:
    """Vertical force on each sole, (N, S) [body weights]."""
    forces: np.ndarray = loads.forces.forces[..., 2] / (loads.motion.mass * loads.motion.gravity)
    return forces


def shoot(built: Stunts, folder: Path, _samples: int) -> list[Path]:
    """The prints of all three from above."""
    tracks = {name: built.bakes["sand"].of(performer.name) for name, performer in built.performers.items()}
    return [plates.draw_plate(tracks, folder / "stunts.png")]


if __name__ == "__main__":
    production.main(__name__)
