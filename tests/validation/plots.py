"""Measured and estimated forces over time, in the style of the paper's Fig. 6."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

mpl.use("Agg")
from matplotlib import pyplot as plt

from library.softground.trials import Trial

Array = NDArray[np.float64]

MEASURED = {"color": "black", "linewidth": 2.0, "label": "force plates"}
STYLES = {
    "WHOLE_BODY": {"color": "tab:red", "linewidth": 1.6, "label": "whole body"},
    "IMPULSE": {"color": "tab:blue", "linewidth": 1.2, "linestyle": "--", "label": "impulse (the paper)"},
}
LONGEST = 2.6
"""Seconds of a trial that a plot shows: a few strides, so that one can see their shape."""


def plot_trial(trial: Trial, path: str, curves: dict[str, Array], deviation: Array, scored: Array, file: Path) -> None:
    """Vertical force per foot and in total: plates, whole-body model, and the impulse model nearest to them.

    `deviation` (F, 2) is the standard deviation of the whole-body model's forces [N].
    """
    weight = trial.mass * 9.81
    time = np.arange(len(trial.forces)) / trial.rate
    shown = time <= LONGEST
    impulse = min(
        (name for name in curves if name.startswith("IMPULSE")),
        key=lambda name: float(((curves[name] - trial.forces)[scored, :, 2] ** 2).mean()),
    )
    figure, axes = plt.subplots(3, 1, figsize=(8, 7), sharex=True, constrained_layout=True)
    pick = {"left foot": lambda f: f[:, 0, 2], "right foot": lambda f: f[:, 1, 2], "both": lambda f: f[..., 2].sum(1)}
    for axis, band in zip(axes, deviation.T, strict=False):
        foot = curves["WHOLE_BODY"][:, list(axes).index(axis), 2]
        low, high = (np.maximum(foot + sign * band, 0.0)[shown] / weight for sign in (-1, 1))
        axis.fill_between(time[shown], low, high, color="tab:red", alpha=0.2, linewidth=0)
    for axis, (what, vertical) in zip(axes, pick.items(), strict=True):
        axis.plot(time[shown], vertical(trial.forces)[shown] / weight, **MEASURED)
        for name in (impulse, "WHOLE_BODY"):
            style = STYLES[name.split()[0]]
            axis.plot(time[shown], vertical(curves[name])[shown] / weight, **style)
        axis.set_ylabel(f"{what}\nvertical force [body weights]")
        axis.grid(alpha=0.3)
        axis.set_ylim(bottom=0)
    source = "joint centres" if path == "joints" else "BVH through Blender"
    axes[0].set_title(f"{trial.name}, from {source}; {impulse.replace('IMPULSE', 'impulse model at')} s")
    axes[0].set_ylim(top=1.25 * axes[0].get_ylim()[1])  # room for the legend
    axes[0].legend(loc="upper right", ncols=3, fontsize="small")
    axes[-1].set_xlabel("time [s]")
    figure.savefig(file, dpi=110)
    plt.close(figure)


def plot_boots(facts: list[dict[str, Any]], depth_cm: Callable[[float], float], file: Path) -> None:
    """Measured boots by the hand hardness of the snow, as grey bands from quartile to quartile, and ours as a line."""
    classes = [fact for fact in facts if fact["kind"] == "measured" and fact.get("hardness")]
    figure, axes = plt.subplots(figsize=(7, 4), constrained_layout=True)
    for number, fact in enumerate(classes):
        low, high = fact["hardness_low"], min(fact["hardness_high"], 5.0)
        axes.fill_between([low, high], fact["depth_low_cm"], fact["depth_high_cm"], color="0.85", linewidth=0)
        label = "measured: median, quartiles" if number == 0 else None
        axes.plot([low, high], [fact["depth_median_cm"]] * 2, color="0.45", linewidth=2.0, label=label)
    hardness = np.linspace(1.0, 5.0, 41)
    axes.plot(hardness, [depth_cm(each) for each in hardness], color="tab:red", linewidth=1.8, label="SoftGround")
    axes.set_xticks(range(1, 6), ["fist", "four fingers", "one finger", "pencil", "knife"])
    axes.set(xlabel="hand hardness of the snow", ylabel="depth of a boot, 33 kPa [cm]", ylim=(0, None))
    axes.legend(frameon=False)
    figure.savefig(file, metadata={"Date": None})
    plt.close(figure)
