"""How a step sounds on each ground: its spectrogram under its force, in one picture.

    python -m tests.validation.spectrograms [PICTURE]

Dashed: between which resonances of the ground are published; see `core.ground.surfaces`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
from matplotlib import pyplot as plt

from softground_addon.core.events import sound, wave_file
from softground_addon.core.events.events import events
from softground_addon.core.ground.presets import find
from softground_addon.core.record.edits import step_id
from tests.core.walkers import pressed, walk

GROUNDS = {"snow": (1000, 4000), "dry_sand": (2000, 7000), "mud": (200, 1200), "soil": (500, 3000)}
"""Presets, and between which frequencies they sound [Hz]."""


def draw(picture: Path) -> None:
    """A column for each ground."""
    loads = walk(steps=4)
    figure, axes = plt.subplots(2, len(GROUNDS), figsize=(14, 6), height_ratios=(1, 3), sharex=True, sharey="row")
    for (preset, band), (upper, lower) in zip(GROUNDS.items(), axes.T, strict=True):
        ground = find(preset)
        _, footprints = pressed(loads, ground.material, cell_size=0.03)
        table = events([loads], footprints, surface=ground.surface, first_frame=1.0)
        named = dict(zip(map(step_id, footprints), footprints, strict=True))
        step = sound.steps_of(named, table, frame_rate=30.0, first_frame=1.0)[1]
        begin, heard = sound.step_sound(step)
        upper.plot(step.time - begin / wave_file.RATE, step.force, "k")
        upper.set_title(preset.replace("_", " "))
        lower.specgram(heard + 1e-9, NFFT=512, Fs=wave_file.RATE, noverlap=448, vmin=-150, vmax=-60)
        lower.hlines(band, 0, len(heard) / wave_file.RATE, "w", "dashed", lw=0.8)
        lower.set(yscale="log", ylim=(60, 20_000), xlabel="s")
    axes[0, 0].set_ylabel("N")
    axes[1, 0].set_ylabel("Hz")
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=100, bbox_inches="tight")


if __name__ == "__main__":
    draw(Path(sys.argv[1] if len(sys.argv) > 1 else "build/spectrograms.png"))
