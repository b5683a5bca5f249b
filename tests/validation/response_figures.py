"""The curves of docs/response.md: `python -m tests.validation.response_figures`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from softground_addon.core.response.tilt import AUTHORS_TORQUES, PAPER_TORQUES, TiltGains, body_gains, lean
from tests.core.response.test_tilt import torques

IMAGES = Path(__file__).parents[2] / "docs" / "images"


def tilt_curves() -> None:
    """What the two gains do, and that neither the frame rate nor the size of the body matters."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 3, figsize=(12, 3.4), sharey=True)

    def run(gains: TiltGains, rate: float = 120.0, seconds: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
        times = np.arange(round(seconds * rate) + 1) / rate
        slope = np.radians(12.0) * np.clip((times - 0.5) / 0.4, 0, 1)
        slope -= np.radians(24.0) * np.clip((times - 4.5) / 0.4, 0, 1)
        return times, np.degrees(lean(np.stack([slope, 0 * slope], axis=-1), frame_rate=rate, gains=gains)[:, 0])

    for frequency in (0.3, 0.6, 1.2):
        axes[0].plot(*run(TiltGains(frequency, 0.85)), label=f"{frequency} Hz")
    axes[0].set_title("frequency, at damping 0.85")
    for damping in (0.2, 0.5, 0.85, 1.5):
        axes[1].plot(*run(TiltGains(0.6, damping)), label=f"damping {damping}")
    axes[1].set_title("damping, at 0.6 Hz")
    for label, mass, arm in (("mouse", 0.03, 0.03), ("adult", 77.5, 1.0), ("giant", 2000.0, 3.0)):
        gains = TiltGains()
        alpha, beta = torques(gains, mass * arm**2, arm)
        axes[2].plot(*run(TiltGains.from_torques(alpha, beta, inertia=mass * arm**2, arm=arm)), label=label)
    axes[2].plot(*run(TiltGains(), rate=24), "k:", label="24 fps")
    axes[2].plot(*run(body_gains(*AUTHORS_TORQUES, mass=77.5, arm=1.0)), "--", label="paper's scene")
    axes[2].plot(*run(body_gains(*PAPER_TORQUES, mass=77.5, arm=1.0)), "--", label="paper as printed")
    axes[2].set_title("size, frame rate, the paper's gains")
    for axis in axes:
        axis.set_xlabel("time (s): level, 12° up, 12° down")
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    axes[0].set_ylabel("lean (°)")
    figure.tight_layout()
    figure.savefig(IMAGES / "response_tilt.png", dpi=110)


if __name__ == "__main__":
    tilt_curves()
