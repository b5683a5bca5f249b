"""The figures of docs/forces.md: `python -m tests.validation.figures DATA docs/images`."""

from __future__ import annotations

import argparse
from pathlib import Path

from matplotlib import pyplot as plt

from library.softground.trials import read_trial
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.estimate import CharacterLoads, estimate_loads
from tests.validation.through_blender import motion_of_bvh
from tests.validation.validate import validate

MASS = 75.0
SNOW = GroundMaterial(youngs_modulus=0.25e6, poisson_ratio=0.05, characteristic_time=0.2)
OTHERS = {
    "jump from standing": ("jumping.bvh", {"scale": 0.04, "forward": "Y", "up": "Z"}, (1.0, 5.0)),
    "jumping jacks": ("jumping_jacks.bvh", {"scale": 0.056444}, (0.0, 4.1)),
    "hopping dance": ("jesse_dance.bvh", {}, (1.7, 5.8)),
    "shuffling walk": ("zombie.bvh", {"scale": 0.04, "forward": "Y", "up": "Z"}, (1.0, 9.0)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder that holds gait/ and bvh/")
    parser.add_argument("output", type=Path)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    for name, figure in (("walk_subject01", "forces_walk"), ("run_rajagopal", "forces_run")):
        list(validate(read_trial(options.data / "gait" / f"{name}.csv"), options.output))
        (options.output / f"{name}_joints.png").replace(options.output / f"{figure}.png")
        (options.output / f"{name}_bvh.png").unlink()
    figure, axes = plt.subplots(len(OTHERS), 1, figsize=(8, 8), constrained_layout=True)
    for axis, (title, (file, import_options, shown)) in zip(axes, OTHERS.items(), strict=True):
        motion = motion_of_bvh(options.data / "bvh" / file, mass=MASS, **import_options)
        plot_feet(axis, estimate_loads(motion, FlatTerrain(), force_model="WHOLE_BODY", material=SNOW), title, shown)
    axes[0].legend(loc="upper right", ncols=3, fontsize="small")
    axes[-1].set_xlabel("time [s]")
    figure.savefig(options.output / "forces_others.png", dpi=110)


def plot_feet(axis: plt.Axes, loads: CharacterLoads, title: str, shown: tuple[float, float]) -> None:
    """Vertical force on each foot and in total [body weights] over the seconds `shown`."""
    weight = loads.motion.mass * loads.motion.gravity
    vertical = loads.forces.forces[..., 2] / weight
    axis.plot(loads.motion.times, vertical.sum(axis=1), color="black", linewidth=0.8, label="both")
    for foot, (label, colour) in enumerate((("left", "tab:blue"), ("right", "tab:orange"))):
        axis.plot(loads.motion.times, vertical[:, foot], color=colour, label=label)
    axis.set(xlim=shown, ylim=(0, None), ylabel="body weights", title=title)
    axis.grid(alpha=0.3)


if __name__ == "__main__":
    main()
