"""Fig. 7, craters: a sphere dropped from 2.5 m, by its mass, by the ground's stiffness and by its Poisson's ratio.

One ground, painted: 50 kg on 1 MPa in the middle of each row, tau = 0.2 s everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import plates, production, stage, terrain
from sample_scenes.production import Built, Claim, Options, Walker
from softground_addon.core.record.footprints import Footprint

CELL_SIZE = 0.01  # m
RATE = 48  # Hz
FRAMES = 72  # 1.5 s, of which 0.71 s in flight
DROP = 2.5  # m
RADIUS = 0.20  # m
SPACING = 0.75  # m from sphere to sphere
GRAVITY = 9.81  # m/s²

MASS, MODULUS, POISSON, TAU = 50.0, 1.0e6, 0.3, 0.2  # kg, Pa, 1, s
ROWS: dict[str, tuple[float, ...]] = {
    "mass": (25.0, 50.0, 100.0),  # kg
    "modulus": (0.5e6, 1.0e6, 2.0e6),  # Pa
    "poisson": (0.0, 0.3, 0.5),
}


NAMES = {"mass": "{:g} kg".format, "modulus": lambda pa: f"{pa / 1e6:g} MPa", "poisson": "nu = {:g}".format}


@dataclass(frozen=True)
class Craters(Built):
    """One bake, and the print of each sphere by what is varied and its value."""

    spheres: dict[tuple[str, float], bpy.types.Object]

    def crater(self, row: str, value: float) -> Footprint:
        """The print of one sphere."""
        (crater,) = self.bakes["craters"].of(self.spheres[row, value].name)
        return crater


def place(row: str, value: float) -> np.ndarray:
    """Where a sphere lands: rows side by side, values ahead (x, y) [m]."""
    return SPACING * np.array((ROWS[row].index(value) - 1.0, 1.0 - list(ROWS).index(row)))


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Craters:
    """Nine spheres over one painted ground."""
    scene.render.fps = RATE
    scene.frame_start, scene.frame_end = 1, FRAMES
    spheres = {}
    for row, values in ROWS.items():
        for value in values:
            sphere = _sphere(f"{row} {value:g}")
            sphere.location.xy = place(row, value)
            _drop(sphere)
            spheres[row, value] = sphere
    edge = 1.5 * SPACING
    axis = terrain.spaced(-edge, edge, cell_size)
    painted = {
        "softground_stiffness": lambda x, y: _painted("modulus", x, y) / MODULUS,
        "softground_rim_factor": lambda x, y: _painted("poisson", x, y) / POISSON,
    }
    ground = terrain.add_terrain("Craters", axis, axis, terrain.flat, "sand", scene.collection, painted)
    material = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "characteristic_time": TAU, "layer_depth": 0.6}
    chosen = {"shape_keys": "false"} | {f"material.{field}": f"{value:g}" for field, value in material.items()}
    walkers = [Walker(sphere, value if row == "mass" else MASS) for (row, value), sphere in spheres.items()]
    bake = production.bake(
        scene, walkers, "Paper Dry Sand", cell_size, ground=ground, options=chosen | dict(options or {})
    )
    return Craters({"craters": bake}, spheres)


def _painted(row: str, x: terrain.Array, y: terrain.Array) -> terrain.Array:
    """The varied quantity where its row is, its middle value elsewhere."""
    values = np.array(ROWS[row])
    column = np.clip(np.rint(x / SPACING).astype(int) + 1, 0, 2)
    here = np.rint(1.0 - y / SPACING) == list(ROWS).index(row)
    return np.where(here, values[column], values[1])


def _sphere(name: str) -> bpy.types.Object:
    """A ball of steel."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=RADIUS)
    sphere = bpy.context.active_object
    sphere.name = name
    sphere.data.shade_smooth()
    sphere.data.materials.append(stage.plain_material("SoftGround Sample ball", (0.35, 0.36, 0.38), 0.35))
    return sphere


def _drop(sphere: bpy.types.Object) -> None:
    """Let go at the height of the drop, and lie on the undisturbed ground from the landing on."""
    landing = sqrt(2 * DROP / GRAVITY)
    for frame in range(1, FRAMES + 1):
        time = (frame - 1) / RATE
        fallen = DROP if time >= landing else GRAVITY * time**2 / 2
        sphere.location.z = RADIUS + DROP - fallen
        sphere.keyframe_insert("location", index=2, frame=frame)


def expected_depth(mass: float, modulus: float, layer_depth: float) -> float:
    """Depth of a crater under the paper's force m·(g + v/tau), borne by a spring bed under the sinking cap [m].

    F = E/L0 · pi·(R·d² - d³/3): the volume of the cap under the undisturbed ground times the stiffness per area.
    """
    force = mass * (GRAVITY + sqrt(2 * GRAVITY * DROP) / TAU)
    depths = np.linspace(0.0, RADIUS, 20001)
    borne = modulus / layer_depth * pi * (RADIUS * depths**2 - depths**3 / 3)
    return float(np.interp(force, borne, depths))


def claims(built: Craters) -> list[Claim]:
    """Depth grows with mass and with 1/E and not with nu; the rim grows with nu."""
    depth = {key: built.crater(*key).max_depth_m for key in built.spheres}
    raised = {value: built.crater("poisson", value) for value in ROWS["poisson"]}
    rims = [crater.rim_m3 / crater.compressed_m3 for crater in raised.values()]
    masses, moduli, ratios = ([depth[row, value] for value in ROWS[row]] for row in ROWS)
    expected = expected_depth(MASS, MODULUS, built.bakes["craters"].layer_depth)
    return [
        Claim("Depth at 50 kg over that at 25", masses[1] / masses[0], 1.2, 1.6),
        Claim("Depth at 100 kg over that at 50", masses[2] / masses[1], 1.2, 1.6),
        Claim("Depth on 0.5 MPa over that on 1", moduli[0] / moduli[1], 1.2, 1.6),
        Claim("Depth on 1 MPa over that on 2", moduli[1] / moduli[2], 1.2, 1.6),
        Claim("Spread of depth over Poisson's ratios", float(np.ptp(ratios)) / ratios[1], 0.0, 1e-3),
        Claim("Depth of 50 kg on 1 MPa over what statics ask for", masses[1] / expected, 0.6, 1.1),
        Claim("Rim over crater at nu = 0", rims[0], 0.0, 1e-6),
        Claim("Rim over crater at nu = 0.3", rims[1], 0.599, 0.601),
        Claim("Rim over crater at nu = 0.5", rims[2], 0.999, 1.001),
    ]


def table(built: Craters) -> str:
    """What each sphere left, a line each."""
    lines = [f"{'sphere':<18}{'force':>9}{'depth':>10}{'crater':>10}{'rim':>9}"]
    for (row, value), sphere in built.spheres.items():
        crater = built.crater(row, value)
        lines.append(
            f"{sphere.name:<18}{crater.peak_force_n:>7.0f} N{crater.max_depth_m * 100:>7.1f} cm"
            f"{crater.compressed_m3 * 1e3:>8.2f} l{crater.rim_m3 * 1e3:>7.2f} l"
        )
    return "\n".join(lines)


def shoot(built: Craters, folder: Path, _samples: int) -> list[Path]:
    """The craters from above; prints the table."""
    print(table(built))
    craters = {NAMES[row](value): (built.crater(row, value),) for row, value in built.spheres}
    return [plates.draw_plate(craters, folder / "craters.png")]


if __name__ == "__main__":
    production.main(__name__)
