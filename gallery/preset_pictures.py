"""The small pictures of the preset menu: a print on each ground, as the preset has it.

python -m gallery.preset_pictures
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
from PIL import Image

from sample_scenes import four_grounds, stage
from sample_scenes.production import addon
from softground_addon.core.ground import presets

SIZE = 96
"""Width and height: a menu on a fine screen shows 40 [px]."""

COLOURS = 40
SAMPLES = 24
WIDE = {"ground_margin": "1.0"}
"""The picture shows no end of the ground."""
LENS = 62.0
"""Closer than the picture of four grounds: the print fills the picture [mm]."""


def main() -> None:
    """Put the picture of a print beside the file of each preset."""
    files = {presets.load(path).name: path for path in sorted(presets.FOLDER.glob("*.json"))}
    for name, rendered in prints(list(files), SIZE):
        _shrink(rendered, files[name].with_suffix(".png"))


def prints(names: Sequence[str], size: int) -> Iterator[tuple[str, Path]]:
    """Bake a walk on each preset: its name, and a square picture of a print that is there until the next."""
    with addon(), TemporaryDirectory() as folder:
        scene = bpy.context.scene
        built = four_grounds.build(scene, options=WIDE, presets=names)
        stage.set_up_rendering(scene)
        scene.frame_set(scene.frame_end)
        for walker in built.walkers:
            stage.hide(walker)
        first = next(iter(built.bakes.values()))
        four_grounds.light(scene, four_grounds.close_up_of(first.footprints))
        camera = stage.add_camera(scene, "Close-up", LENS)
        for name, bake in built.bakes.items():
            for other in built.bakes.values():  # they lie over each other
                other.ground.hide_render = other is not bake
            four_grounds.aim_at_print(camera, four_grounds.close_up_of(bake.footprints))
            rendered = Path(folder) / "rendered.png"
            stage.render(scene, camera, rendered, (size, size), SAMPLES)
            yield name, rendered


def _shrink(rendered: Path, target: Path) -> None:
    """The picture in few colours: a quarter of its bytes."""
    Image.open(rendered).convert("RGB").quantize(COLOURS).save(target, optimize=True)
    print(target, target.stat().st_size)


if __name__ == "__main__":
    main()
