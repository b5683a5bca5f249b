"""The ground law against measured sinkage: `python -m tests.validation.validate_ground DIR` prints a table.

DIR holds `facts.json`: what boots, plates and wheels did to real ground. Soles of that pressure and shape are pressed
through the real solver. Writes build/ground_validation.json, a list of `name`, `depth_cm`, `low_cm`, `high_cm`, `right`
(of ratios, in place of depths, the ratio), and a plot; exits with 1 where a limit is broken.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from sample_scenes import production
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from softground_addon.core.ground import presets
from softground_addon.core.ground.field_tests import DENSITY, PACKED_DENSITY, plates, snow
from softground_addon.core.ground.material import STANDARD_GRAVITY, GroundMaterial
from softground_addon.core.imprints.indentation import stress
from softground_addon.core.record.footprints import Footprint
from tests.validation.ground_presses import sole_depth, wheel_depth
from tests.validation.plots import plot_boots

Fact = dict[str, Any]

BOOT, BOOT_WIDTH, BOOT_LENGTH = 33e3, 0.10, 0.29
SKI, SKI_WIDTH, SKI_LENGTH = 5.5e3, 0.105, 1.6
CLASSES_INSIDE = 11
"""Least number of the twelve classes of hardness whose boots sink within the measured quartiles."""
LARGEST_ERROR = 0.15
"""Of the classes' medians: mean of |ln(depth/median)|."""
PLATE_TOLERANCE, SOLE_TOLERANCE = 0.05, 0.03
MOON = 1.62
WETNESS = {"moist": "wet_snow", "wet": "wet_snow", "very wet": "wet_snow", "slush": "slush", "dry": "settled_snow"}
"""The preset of snow by how wet its top 30 cm are."""
FEET = {
    "mouse": (1.6e3, 0.005, 0.02),
    "snowshoe": (6.9e3, 0.20, 0.65),
    "boot": (BOOT, BOOT_WIDTH, BOOT_LENGTH),
    "elephant": (80e3, 0.38, 0.38),
    "horse": (210e3, 0.12, 0.13),
}
"""Pressure on a foot [Pa], its width and length [m]; placed. By pressure, so nearly by depth in powder."""


@dataclass(frozen=True)
class Check:
    """A number, and between what it must lie."""

    name: str
    depth_cm: float
    low_cm: float
    high_cm: float

    @property
    def right(self) -> bool:
        """True if it does."""
        return self.low_cm <= self.depth_cm <= self.high_cm


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, help="folder with facts.json")
    parser.add_argument("--output", type=Path, default=Path("build"), help="folder for the results")
    options = parser.parse_args()
    if not (file := options.directory / "facts.json").is_file():
        parser.error(f"{options.directory} holds no facts.json: give the folder of measured sinkage")
    facts = json.loads(file.read_text(encoding="utf-8"))
    classes = list(boots_by_class(facts))
    checks = [*of_classes(classes, facts), *of_snow(facts), *of_plates(facts), *of_other_ground(), *of_a_walk()]
    options.output.mkdir(parents=True, exist_ok=True)
    rows = [asdict(check) | {"right": check.right} for check in (*classes, *checks)]
    (options.output / "ground_validation.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
    plot_boots(facts, lambda hardness: 100 * boot(snow(hardness)), options.output / "ground_validation.svg")
    for check in (*classes, *checks):
        print(
            f"{check.name:<58}{check.depth_cm:>8.3g}  {check.low_cm:>7.3g} - {check.high_cm:<7.3g}"
            f"{'' if check.right else ' outside'}"
        )
    return int(not all(check.right for check in checks))


def boot(material: GroundMaterial) -> float:
    """How deep a boot sinks [m]."""
    return sole_depth(material, BOOT, BOOT_WIDTH, BOOT_LENGTH)


def boots_by_class(facts: list[Fact]) -> Iterator[Check]:
    """Boots in snow of each class of hardness, and the quartiles."""
    for fact in facts:
        if fact["kind"] == "measured" and fact.get("hardness"):
            depth = sole_depth(snow(fact["hardness"]), *_sole(fact))
            yield Check(fact["name"], 100 * depth, fact["depth_low_cm"], fact["depth_high_cm"])


def of_classes(classes: list[Check], facts: list[Fact]) -> Iterator[Check]:
    """What all classes must be together."""
    medians = [fact["depth_median_cm"] for fact in facts if fact["kind"] == "measured" and fact.get("hardness")]
    inside = sum(check.right for check in classes)
    yield Check("classes of hardness inside the quartiles", inside, CLASSES_INSIDE, len(classes))
    error = np.abs(np.log([check.depth_cm for check in classes] / np.array(medians))).mean()
    yield Check("mean |ln| of the medians of classes", float(error), 0.0, LARGEST_ERROR)


def of_snow(facts: list[Fact]) -> Iterator[Check]:
    """Boots in wet snow, skis, heavier boots, wheels and the feet of animals."""
    for fact in facts:
        wetness = fact["state"].removesuffix(" top 30 cm")
        if fact["kind"] == "measured" and wetness in WETNESS:
            depth = sole_depth(presets.find(WETNESS[wetness]).material, *_sole(fact))
            yield Check(f"{fact['name']}: {WETNESS[wetness]}", 100 * depth, fact["depth_low_cm"], fact["depth_high_cm"])
        if fact["kind"] == "limit" and fact["densest_kg_m3"] and fact["pressure_kpa"]:
            yield from _packed_by_a_wheel(fact)
    settled = presets.find("settled_snow").material
    ski = sole_depth(settled, SKI, SKI_WIDTH, SKI_LENGTH)
    yield Check("boot over ski", boot(settled) / ski, 1.8, 3.3)
    twice = sole_depth(settled, 2 * BOOT, BOOT_WIDTH, BOOT_LENGTH)
    yield Check("twice the pressure of a boot over once", twice / boot(settled), 1.25, 1.6)
    yield _wheel_on_springs(settled)
    powder, before = presets.find("powder").material, 0.0
    for name, foot in FEET.items():
        depth = 100 * sole_depth(powder, *foot)
        yield Check(f"{name} on powder, deeper than the one before", depth, before, 100 * powder.deepest)
        before = 0.9 * depth  # an elephant bears less on a wider foot than a horse


def _packed_by_a_wheel(fact: Fact) -> Iterator[Check]:
    """Snow under a wheel, which is not packed further than it was measured."""
    for density, layer in ((110.0, 0.37), (250.0, 0.10)):
        hardness = float(np.interp(density, DENSITY, np.arange(1, 6)))
        depth = sole_depth(snow(hardness, layer), 1e3 * fact["pressure_kpa"], 0.2, 0.3)
        deepest = 100 * layer * (1.0 - density / max(fact["densest_kg_m3"], PACKED_DENSITY))
        name = f"wheel of {fact['pressure_kpa']} kPa on {100 * layer:.0f} cm of snow of {density:.0f} kg/m³"
        yield Check(name, 100 * depth, 0.7 * deepest, deepest)


def _wheel_on_springs(material: GroundMaterial) -> Check:
    """A wheel on the bed of springs that the law is, against its integral."""
    force, radius, width = 1000.0, 0.33, 0.2

    def carried(sinkage: float) -> float:
        def along(x: float) -> float:
            pressed = max(sinkage - (radius - np.sqrt(radius**2 - x**2)), 0.0)
            return width * float(stress(np.array(pressed), material, firmness=material.firmness(width)))

        reach = np.sqrt(2 * radius * sinkage - sinkage**2)
        return float(quad(along, -reach, reach)[0])

    expected = 100 * brentq(lambda sinkage: carried(sinkage) - force, 1e-4, 0.3)
    depth = 100 * wheel_depth(material, force, radius, width)
    return Check("wheel of 1 kN in settled snow", depth, 0.97 * expected, 1.03 * expected)


def of_plates(facts: list[Fact]) -> Iterator[Check]:
    """Plates on soils whose parameters were measured, and a sole of another shape."""
    soils = {
        fact["state"]: plates(1e3 * fact["kc"], 1e3 * fact["kphi"], fact["exponent"])
        for fact in facts
        if fact["kind"] == "parameters" and fact.get("kphi") and fact["name"] == "plate law"
    }
    for fact in facts:
        if fact["kind"] == "plate" and fact["state"] in soils:
            width = fact["width_cm"] / 100
            depth = 100 * sole_depth(soils[fact["state"]], 1e3 * fact["pressure_kpa"], width, 3 * width)
            low, high = ((1 + side * PLATE_TOLERANCE) * fact["depth_median_cm"] for side in (-1, 1))
            yield Check(f"{fact['name']}: {fact['state']}", depth, low, high)
    for name, soil in soils.items():
        for pressure, width in ((40e3, 0.09), (40e3, 0.35)):
            load = pressure / (soil.youngs_modulus * soil.firmness(width))
            expected = 100 * soil.layer_depth * load ** (1 / soil.exponent)
            depth = 100 * sole_depth(soil, pressure, width, 3 * width)
            label = f"sole {100 * width:.0f} cm wide by its plate law: {name}"
            yield Check(label, depth, (1 - SOLE_TOLERANCE) * expected, (1 + SOLE_TOLERANCE) * expected)


def of_other_ground() -> Iterator[Check]:
    """The Moon, and dry sand against wet."""
    regolith, dune, beach = (presets.find(name).material for name in ("lunar_regolith", "dune", "wet_beach"))
    astronaut = 180.0 * MOON / 0.033
    yield Check("astronaut on the Moon", 100 * sole_depth(regolith.under(MOON), astronaut, 0.10, 0.33), 0.3, 2.5)
    dry, wet = (sole_depth(ground, 38e3, BOOT_WIDTH, BOOT_LENGTH) for ground in (dune, beach))
    yield Check("dune over wet beach, 38 kPa", dry / wet, 5.0, 9.0)
    light = replace(dune, cohesionless=1.0).under(MOON)
    same = sole_depth(light, BOOT * MOON / STANDARD_GRAVITY, BOOT_WIDTH, BOOT_LENGTH) / boot(dune)
    yield Check("loose sand on the Moon over on the Earth", same, 0.99, 1.01)


def of_a_walk() -> Iterator[Check]:
    """An adult who walks in settled snow, baked as in the panel."""
    with production.addon():
        scene, body = bpy.context.scene, Body()
        figure = create_character("Walker", body, scene.collection, production.COARSENESS)
        scene.render.fps, scene.frame_start, scene.frame_end = 24, 1, 96
        write_action(figure, walk(body, Gait(), 96, 24), "Walk")
        bake = production.bake(scene, [production.Walker(figure, body.mass)], "settled_snow", 0.005, write=False)
        footprints = bake.footprints[1:-1]
    deepest = 100 * float(np.median([footprint.max_depth_m for footprint in footprints]))
    yield Check("sample walk in settled snow", deepest, 32.0, 38.0)
    floors = 100 * np.median([_floors(footprint) for footprint in footprints], axis=0)
    yield Check("sample walk in settled snow: toes below the heel", float(floors[1] - floors[0]), 2.0, 6.0)


def _floors(footprint: Footprint) -> tuple[float, float]:
    """Deepest compression of the heel's third of a print, and of the toes' [m]."""
    depth = footprint.tile(footprint.compression)
    x, y = np.meshgrid(*footprint.window.centres(footprint.cell_size))
    along = x * np.cos(footprint.heading) + y * np.sin(footprint.heading)
    low, high = along[depth > 0.1 * depth.max()].min(), along[depth > 0.1 * depth.max()].max()
    share = (along - low) / (high - low)
    return float(depth[share < 1 / 3].max()), float(depth[share > 2 / 3].max())


def _sole(fact: Fact) -> tuple[float, float, float]:
    return 1e3 * fact["pressure_kpa"], fact["width_cm"] / 100, fact["length_cm"] / 100


if __name__ == "__main__":
    sys.exit(main())
