"""Fig. 6, ground reaction force: a walk at 1.65 m/s, from the whole body's motion and from the paper's impulse."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import matplotlib as mpl
import numpy as np

from sample_scenes import production
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.force_arrows import whole_strides
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import Built, Claim, Options, Walker
from softground_addon.blender.reading import analysis
from softground_addon.core.loads.estimate import CharacterLoads

mpl.use("Agg")
from matplotlib import pyplot

CELL_SIZE = 0.02  # m
RATE = 60  # Hz
FRAMES = 4 * RATE
SPEED = 1.65  # m/s


@dataclass(frozen=True)
class WalkForces(Built):
    """The walk's bake, and its forces from each model."""

    loads: dict[str, CharacterLoads]


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> WalkForces:
    """A brisk walk, keyed at 60 Hz."""
    body = Body()
    scene.render.fps = RATE
    walker = create_character("Hiker", body, scene.collection, production.COARSENESS)
    write_action(walker, walk(body, Gait(speed=SPEED), FRAMES, RATE), "Brisk Walk")
    scene.frame_start, scene.frame_end = 1, FRAMES
    options = {"shape_keys": "false"} | dict(options or {})
    bake = production.bake(scene, [Walker(walker, body.mass)], "Paper Dry Sand", cell_size, options=options)
    loads = {}
    for model in ("IMPULSE", "WHOLE_BODY"):
        scene.softground.characters[0].force_model = model
        loads[model] = analysis.read(scene).loads[0]
    return WalkForces({"Dry Sand": bake}, loads)


def claims(built: WalkForces) -> list[Claim]:
    """Two humps of a good body weight per step, a trough between them, and the weight on average."""
    loads = built.loads["WHOLE_BODY"]
    stride = whole_strides(loads)
    vertical = _vertical(loads)[stride]
    total = vertical.sum(axis=1)
    return [
        Claim("Mean force over whole strides [body weights]", float(total.mean()), 0.97, 1.03),
        Claim("Largest force on one sole [body weights]", float(vertical.max()), 1.1, 1.6),
        Claim("Trough between the humps [body weights]", float(total.min()), 0.3, 0.8),
        Claim("Force of the impulse model, at least [body weights]", float(_impulse_floor(built)), 0.99, 1.01),
    ]


def _impulse_floor(built: WalkForces) -> float:
    """The impulse model knows of weight and landings only: it never falls below the weight."""
    loads = built.loads["IMPULSE"]
    return float(_vertical(loads)[whole_strides(loads)].sum(axis=1).min())


def _vertical(loads: CharacterLoads) -> np.ndarray:
    """Vertical force on each sole, (N, S) [body weights]."""
    forces: np.ndarray = loads.forces.forces[..., 2] / (loads.motion.mass * loads.motion.gravity)
    return forces


def shoot(built: WalkForces, folder: Path, _samples: int) -> list[Path]:
    """The curves of both models."""
    figure, axes = pyplot.subplots(2, 1, figsize=(8, 5), sharex=True, sharey=True, constrained_layout=True)
    titles = {"WHOLE_BODY": "whole body", "IMPULSE": "impulse (the paper)"}
    for axis, (model, title) in zip(axes, titles.items(), strict=True):
        loads = built.loads[model]
        stride = whole_strides(loads)
        time = loads.motion.times[stride] - loads.motion.times[stride][0]
        vertical = _vertical(loads)[stride]
        axis.plot(time, vertical.sum(axis=1), color="black", linewidth=0.8, label="both feet")
        for column, (sole, colour) in enumerate(zip(loads.motion.soles, ("tab:blue", "tab:orange"), strict=True)):
            axis.plot(time, vertical[:, column], color=colour, label=sole.sole.name)
        axis.set(ylim=(0, None), ylabel="body weights", title=f"walk at {SPEED} m/s, {title}")
        axis.grid(alpha=0.3)
    axes[0].legend(loc="upper right", ncols=3, fontsize="small")
    axes[-1].set_xlabel("time [s]")
    path = folder / "walk_forces.png"
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    return [path]


if __name__ == "__main__":
    production.main(__name__)
