"""Relief keeps the volume of each print, on every ground, under every kind of foot, whatever the mesh shows."""

from functools import cache

import numpy as np
import pytest

from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.motion.sole_motion import Sole
from softground_addon.core.record.pressed_ground import sample_at
from softground_addon.core.relief import amounts
from softground_addon.core.relief.steps import ReliefSettings, relief_of_steps
from softground_addon.core.relief.tread import SoleTread, bare, hiking
from tests.core.prop_bodies import rolling
from tests.core.relief.test_steps import MATERIALS
from tests.core.walkers import patch_of, pressed, standing, walk

TREADS = {"boot": hiking, "bare": bare}


def sole_of(distance, reach):
    """A flat sole about its origin, by the distance from its outline."""
    patch = patch_of(distance, lambda x, y: 0 * (x + y), (-reach, -reach), (reach, reach), 0.002)
    angle = np.arange(48) / 48 * 2 * np.pi
    outline = reach * np.stack([np.cos(angle), np.sin(angle)], -1)
    return Sole("foot.L", "L", (patch,), np.zeros((1, 3)), np.zeros(1, int), outline)


def paw(x, y):
    """A pad and four toes."""
    pads = [(-0.02, 0.0, 0.02), (0.018, -0.03, 0.011), (0.033, -0.012, 0.012), (0.033, 0.012, 0.012),
            (0.018, 0.03, 0.011)]  # fmt: skip
    return np.min([np.hypot(x - ahead, y - left) - radius for ahead, left, radius in pads], axis=0)


def hoof(x, y):
    """Half an oval to each side of a cleft."""
    return np.maximum(np.hypot(x / 1.3, y) - 0.045, 0.004 - np.abs(y))


@cache
def prints(look, kind):
    """Some prints of a kind of foot."""
    material = MATERIALS[look]
    if kind == "wheel":
        return pressed(rolling(24, seconds=0.75, force=900.0, width=0.12), material, 0.01)[1]
    if kind in TREADS:
        return pressed(walk(steps=4, heading=0.5), material, 0.005)[1]
    sole, force = (sole_of(paw, 0.05), 120.0) if kind == "paw" else (sole_of(hoof, 0.06), 1500.0)
    cell = 0.00125 if kind == "paw" else 0.005  # as a bake fits them to the soles
    return pressed(standing(sole, [(0.0, 0.0, 0.0), (0.4013, 0.1507, 0.0)], force, heading=0.7), material, cell)[1]


@pytest.mark.parametrize("spacing", [0.0025, 0.005])
@pytest.mark.parametrize(
    "kind", ["boot", "paw", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("bare", "hoof", "wheel"))]
)
@pytest.mark.parametrize("look", SURFACES)
def test_each_print_keeps_its_volume_to_a_percent(look, kind, spacing):
    blur = MATERIALS[look].blur_sigma
    for step in prints(look, kind):
        far = 8 * step.cell_size
        x, y = (
            np.arange(places[0] - far, places[-1] + far, min(spacing, step.cell_size))
            for places in step.window.centres(step.cell_size)
        )
        place = np.stack(np.meshgrid(x, y)).reshape(2, -1)
        treads = {(step.character, step.sole): SoleTread(TREADS[kind])} if kind in TREADS else {}
        (of_step,) = relief_of_steps(
            [step], *place, ReliefSettings(amounts.of_look(look), 1.0, treads), blur_sigma=blur
        )
        shown = sample_at([step], *place, frame=1e4, frame_rate=30.0, cell_size=step.cell_size, blur_sigma=blur)
        assert abs(of_step.change[:, 0].sum()) < 0.01 * shown.compression.sum()
        assert np.abs(of_step.change[:, 0]).max() > 0.0005
