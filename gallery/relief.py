"""The same prints on five grounds, without relief and with Close-Up."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy

from gallery.ground_sheets import GROUNDS
from sample_scenes import four_grounds, production, stage
from sample_scenes.four_grounds import FourGrounds
from sample_scenes.production import Bake, Claim, Options

CELL_SIZE: float | None = None
"""Fitted to the soles."""

PICTURE = (320, 240)


@dataclass(frozen=True)
class Relief:
    """A row of grounds without relief, and one with it."""

    rows: dict[str, FourGrounds]

    @property
    def bakes(self) -> dict[str, Bake]:
        """All bakes."""
        return {f"{row} {preset}": bake for row, built in self.rows.items() for preset, bake in built.bakes.items()}


def build(scene: bpy.types.Scene, cell_size: float | None = CELL_SIZE, options: Options | None = None) -> Relief:
    """One walk on ten grounds."""
    chosen = [{"relief": relief} | dict(options or {}) for relief in ("OFF", "CLOSE_UP")]
    built = [four_grounds.build(scene, cell_size, each, GROUNDS, row) for row, each in enumerate(chosen)]
    return Relief(dict(zip(("Plain", "Close-Up"), built, strict=True)))


def claims(built: Relief) -> list[Claim]:
    """Relief is of the display: what is pressed is the same, but for where the cells lie."""
    pressed = [[bake.report["totals"]["compressed_m3"] for bake in row.bakes.values()] for row in built.rows.values()]
    return [
        Claim(f"Volume pressed in {preset.lower()} with relief over that without", more / plain, 0.998, 1.002)
        for preset, plain, more in zip(GROUNDS, *pressed, strict=True)
    ]


def shoot(built: Relief, folder: Path, samples: int) -> list[Path]:
    """One print of each, those without relief above."""
    plain, close_up = built.rows.values()
    four_grounds.light(bpy.context.scene, four_grounds.close_up_of(plain.bakes["Snow"].footprints))
    pictures = [
        picture
        for row, grounds in (("plain", plain), ("close_up", close_up))
        for picture in four_grounds.close_ups(grounds, folder / f"relief_{row}", PICTURE, samples)
    ]
    return [*pictures, stage.contact_sheet(pictures, len(GROUNDS), folder / "relief.jpg")]


if __name__ == "__main__":
    production.main(__name__)
