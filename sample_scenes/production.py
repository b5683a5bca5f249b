"""What all sample scenes have in common: SoftGround switched on, a bake as a user makes it, claims, and the command.

A scene is a module with three functions, called in this order:

- `build(scene, cell_size, options)` makes characters and grounds in the open file, bakes, and returns what it made;
- `claims(built)` measures what the paper's figure promises;
- `shoot(built, folder, samples)` lights it and takes its pictures.

    python -m PACKAGE.NAME [--output DIR] [--set PATH=VALUE ...] [--samples N] [--no-pictures]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np

import softground_addon
from sample_scenes import stage
from softground_addon.blender import jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.characters import contact_editing
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.properties import setting_paths
from softground_addon.core.record.footprints import Footprint, recompose

OUTPUT = Path("build/scenes")

COARSENESS = 2.4
"""Of the figures in the scenes, see `character.create_character`: files stay small."""

Options = Mapping[str, str]
"""Settings below `scene.softground` by their path, as `--set` takes them."""


@dataclass(frozen=True)
class Claim:
    """A number that a figure promises, and the range in which it is what the figure says.

    Attributes
    ----------
    text : str
    value, low, high : float
    """

    text: str
    value: float
    low: float
    high: float

    @property
    def holds(self) -> bool:
        """True if the number is in its range."""
        return self.low <= self.value <= self.high

    def __str__(self) -> str:
        verdict = "ok  " if self.holds else "FAIL"
        return f"{verdict} {self.text}: {self.value:.4g} ({self.low:.4g} to {self.high:.4g})"


@dataclass(frozen=True)
class Walker:
    """Somebody who walks, or a thing that falls or rolls.

    Attributes
    ----------
    armature : bpy.types.Object
        Or the thing's mesh object.
    mass : float
        [kg].
    shoes : mapping
        Objects that print in place of the feet, by "L" and "R".
    with_things : sequence of bpy.types.Object
        Further mesh objects that are one thing with the first, such as the other wheel.
    more : sequence of str
        Bones that print beside the feet, such as hands and forepaws; those that Add Character finds need no naming.
    held : sequence of bpy.types.Object
        Mesh objects that print beside the feet, such as a cane.
    """

    armature: bpy.types.Object
    mass: float
    shoes: Mapping[str, bpy.types.Object] = field(default_factory=dict)
    with_things: Sequence[bpy.types.Object] = ()
    more: Sequence[str] = ()
    held: Sequence[bpy.types.Object] = ()


@dataclass(frozen=True)
class Bake:
    """A baked ground and its record.

    Attributes
    ----------
    ground : bpy.types.Object or None
        The scene's ground; None where nothing was written.
    footprints : tuple of Footprint
        In the order of their first contact.
    report : dict
        See `core.files.report`.
    rim_share : (float, float)
        Least and largest part of the compressed volume that rises as a rim: 2·nu, times what is painted.
    layer_depth : float
        [m].
    """

    ground: bpy.types.Object | None
    footprints: tuple[Footprint, ...]
    report: Mapping[str, Any]
    rim_share: tuple[float, float]
    layer_depth: float

    @property
    def display_mesh(self) -> bpy.types.Object:
        """The object that shows the prints: the ground itself or the detail along the trail."""
        return baked_ground.display_mesh_of(self.ground)

    def of(self, name: str) -> tuple[Footprint, ...]:
        """The footprints of one character."""
        return tuple(step for step in self.footprints if step.character == name)


@dataclass(frozen=True)
class Built:
    """A scene that is built: its bakes, mostly by their presets; scenes with more to measure add it.

    Attributes
    ----------
    bakes : dict of str to Bake
    """

    bakes: dict[str, Bake]


@contextmanager
def addon() -> Iterator[None]:
    """An empty file with SoftGround switched on; off again at the end, or the bpy module would hang on exit."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    softground_addon.register()
    try:
        yield
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()


def bake(
    scene: bpy.types.Scene,
    walkers: Sequence[Walker],
    preset: str,
    cell_size: float | None,
    *,
    ground: bpy.types.Object | None = None,
    options: Options | None = None,
    write: bool = True,
) -> Bake:
    """Bake walkers into a ground as a user does it in the panel; without a ground, one is made that fits the walk.

    Without a cell size, the cells fit the soles. Without writing, the prints are computed and the ground stays as it
    is.
    """
    shot = scene.softground
    shot.ground = ground
    shot.characters.clear()
    shot.ground_margin = 0.0  # grounds lie side by side
    shot.relief = "OFF"  # figures show what is computed
    shot.sink_feet = False  # scenes ask for a response where they show one
    if cell_size:
        shot.cell_size = cell_size
    for walker in walkers:
        make_active(walker.armature)
        for thing in walker.with_things:
            thing.select_set(True)
        bpy.ops.softground.add_character()
        shot.characters[-1].mass = walker.mass
        for sole in shot.characters[-1].soles:
            if shoe := walker.shoes.get(sole.side[:1]):
                sole.object = shoe
        bones = {sole.bone for sole in shot.characters[-1].soles}
        if more := [bone for bone in walker.more if bone not in bones]:
            contact_editing.add_bone_contacts(shot.characters[-1], more)
        if walker.held:
            contact_editing.add_object_contacts(scene.softground, shot.characters[-1], walker.held)
    bpy.ops.softground.load_preset(name=preset)
    for path, value in (options or {}).items():
        setting_paths.assign(shot, path, value)
    if ground is None and write:
        bpy.ops.object.select_all(action="DESELECT")  # a selected mesh would be taken as the ground
        bpy.ops.softground.create_ground()
    result = jobs.run(bake_job.bake(scene, write=write))
    materials = [kind.material for kind in settings.snapshot(scene).kinds[0]]
    ratios = [material.poisson_ratio for material in materials]
    displaced = 2 * np.array([min(ratios), max(ratios)]) * _painted_range(shot.ground, shot.painted.rim)
    share = float(np.clip(displaced[0], 0, 1)), float(np.clip(displaced[1], 0, 1))
    deepest = max(material.layer_depth for material in materials)
    return Bake(shot.ground, result.footprints, result.report, share, deepest)


def _painted_range(ground: bpy.types.Object | None, name: str) -> np.ndarray:
    """Smallest and largest factor that is painted on a ground; 1 where nothing is."""
    attribute = ground.data.attributes.get(name) if ground else None
    if attribute is None:
        return np.ones(2)
    values = np.empty(len(attribute.data), dtype=np.float32)
    attribute.data.foreach_get("value", values)
    return np.array((values.min(), values.max()))


def make_active(thing: bpy.types.Object) -> None:
    """Select an object alone."""
    for other in bpy.context.selected_objects:
        other.select_set(False)
    thing.select_set(True)
    bpy.context.view_layer.objects.active = thing


def remove_character(armature: bpy.types.Object) -> None:
    """Take an armature and what hangs on it out of the file."""
    for thing in (*armature.children_recursive, armature):
        bpy.data.objects.remove(thing)


def invariants(bake: Bake) -> list[Claim]:
    """What holds on every ground, whatever is switched on."""
    ground = recompose(bake.footprints)
    compressed, raised = ground.volumes()
    placed = raised + sum(step.unplaced_rim_m3 for step in bake.footprints) + bake.report["totals"]["thrown_m3"]
    low, high = (share * compressed for share in bake.rim_share)
    smallest = min((int(step.compression.amounts.min(initial=0)) for step in bake.footprints), default=0)
    deepest = max((float(tile[0].max()) for tile in ground.tiles.values()), default=0.0)
    return [
        Claim("Volume of the rims and of what was thrown [m³]", placed, low * (1 - 1e-6), high * (1 + 1e-6)),
        Claim("Smallest change of compression [nm]", float(smallest), 0, np.inf),
        Claim("Deepest compression over the layer's depth", deepest / bake.layer_depth, 0, 1 + 1e-6),
    ]


def run(module: ModuleType, arguments: Sequence[str] | None = None) -> int:
    """Build a scene, check its claims, save it and take its pictures; returns the exit code of the process."""
    path = Path(str(module.__file__))
    name = path.stem
    options = _parser(f"{path.parent.name}.{name}", str(module.__doc__)).parse_args(arguments)
    started = time.perf_counter()
    folder: Path = options.output
    folder.mkdir(parents=True, exist_ok=True)
    given: dict[str, Any] = {"options": dict(pair.split("=", 1) for pair in options.set)}
    if options.cell_size:
        given["cell_size"] = options.cell_size
    pictures: list[Path] = []
    with addon():
        built = module.build(bpy.context.scene, **given)
        claims: list[Claim] = module.claims(built)
        for claim in claims:
            print(claim)
        if not options.no_pictures:
            stage.set_up_rendering(bpy.context.scene)
            pictures = module.shoot(built, folder.resolve(), options.samples)
            stage.put_back()
        blend = folder / f"{name}.blend"
        bpy.context.preferences.filepaths.save_version = 0  # no backup beside it
        bpy.ops.wm.save_as_mainfile(filepath=str(blend.resolve()), compress=True)
    for path in (blend, *pictures):
        print(path)
    print(f"{name}: {time.perf_counter() - started:.0f} s")
    return 0 if all(claim.holds for claim in claims) else 3


def _parser(command: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"python -m {command}", description=description.splitlines()[0])
    parser.add_argument("--output", type=Path, default=OUTPUT, metavar="DIR")
    parser.add_argument("--cell-size", type=float, metavar="M", help="size of the ground's cells")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE", help="a setting of SoftGround")
    parser.add_argument("--samples", type=int, default=6, metavar="N", help="render samples of the pictures")
    parser.add_argument("--no-pictures", action="store_true", help="build, bake and check only")
    return parser


def main(module_name: str) -> None:
    """Run the scene that is the main module."""
    code = run(sys.modules[module_name])
    sys.stdout.flush()
    sys.exit(code)
