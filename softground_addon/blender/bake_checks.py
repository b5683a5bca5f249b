"""What a bake must fulfil before anything is written."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.deformation import GroundMaterial
from ..core.errors import BakeError, InputError
from ..core.footprints import QUANTUM, Footprint
from ..core.heightfield import Terrain
from ..core.pressed_ground import PressedGround
from ..core.simulation import CharacterLoads
from ..core.terrain import MeshTerrain

Array = NDArray[np.float64]

COARSEST_SPACING = 0.25
"""Largest spacing of ground vertices under the prints, in lengths of the sole: coarser meshes cannot show a foot."""

DETAIL_FROM = 4.0
"""Spacing of ground vertices under the prints from which the ground is refined along the trail, in cells."""

RIM_TOLERANCE = 1e-6
"""Largest relative error of the rim's volume that passes (MODEL.md, section 4)."""


def check_contacts(loads: Sequence[CharacterLoads], terrain: Terrain, ground: bpy.types.Object | None) -> None:
    """Raise InputError if nothing touches the ground, or where the ground has two layers under a foot."""
    place = np.concatenate(
        [
            sole.landmark_positions()[character.contacts.touching[:, number]].reshape(-1, 3)
            for character in loads
            for number, sole in enumerate(character.motion.soles)
        ]
    )
    name = f"'{ground.name}'" if ground else "the ground"
    if not len(place):
        characters = ", ".join(f"'{character.motion.name}'" for character in loads)
        raise InputError(
            f"No foot of {characters} touches {name} in these frames: move the ground under the feet, or correct the "
            "feet in the Character panel."
        )
    if isinstance(terrain, MeshTerrain) and not terrain.is_height_field(place[:, 0], place[:, 1]).all():
        raise InputError(
            f"Ground {name} has several layers one above the other under the feet, such as a bridge or an overhang: "
            "separate the layer that is walked on into an object of its own."
        )


def vertex_spacing(vertices: Array, pressed: PressedGround) -> float:
    """Distance between the ground's vertices under the prints [m], infinite where there are none."""
    compression = pressed.raw.sample(*vertices[:, :2].T)[0]
    cells = sum(int((tile[0] > 0).sum()) for tile in pressed.raw.tiles.values())
    under_prints = cells * pressed.raw.cell_size**2
    return float(np.sqrt(under_prints / max(1e-9, float((compression > 0).sum()))))


def wants_detail(
    ground: bpy.types.Object, spacing: float, detail: str, cell_size: float, loads: Sequence[CharacterLoads]
) -> bool:
    """Whether the ground is to be refined along the trail; InputError if it must be and may not."""
    if detail == "ALWAYS" or (detail == "AUTO" and spacing > DETAIL_FROM * cell_size):
        return True
    length = min(sole.sole.length for character in loads for sole in character.motion.soles)
    if spacing > COARSEST_SPACING * length:
        raise InputError(
            f"Ground '{ground.name}' is too coarse: its vertices are more than {COARSEST_SPACING * length * 100:.0f} "
            f"cm apart under soles of {length * 100:.0f} cm. Set Detail to Automatic in the Ground panel, or Subdivide "
            "the ground."
        )
    return False


def check_volumes(footprints: Sequence[Footprint], material: GroundMaterial, factors: Array | None = None) -> None:
    """Raise BakeError if a footprint breaks an invariant of MODEL.md, section 4.

    Parameters
    ----------
    footprints : sequence of Footprint
    material : GroundMaterial
    factors : (V, 3) float array, optional
        What is painted on the ground: there, the rim's share lies between the least and the largest painted.
    """
    depth, rim = np.ones((2, 2)) if factors is None else (np.append(column, 1.0) for column in factors[:, 1:].T)
    least, most = np.clip(2.0 * material.poisson_ratio * np.array([rim.min(), rim.max()]), 0.0, 1.0)
    for footprint in footprints:
        raised = footprint.rim_m3 + footprint.unplaced_rim_m3
        rounding = QUANTUM * footprint.cell_size**2 * (len(footprint.rim.cells) + len(footprint.compression.cells))
        low, high = least * footprint.compressed_m3, most * footprint.compressed_m3
        if not low * (1 - RIM_TOLERANCE) - rounding <= raised <= high * (1 + RIM_TOLERANCE) + rounding:
            raise BakeError(
                f"The print of {footprint.sole} at frame {footprint.start_frame:.0f} raised {raised:.6g} m³ where "
                f"{high:.6g} m³ were displaced; nothing was written. Please report this shot."
            )
        if footprint.max_depth_m > material.layer_depth * depth.max() * (1 + 1e-9):
            raise BakeError(
                f"The print of {footprint.sole} at frame {footprint.start_frame:.0f} is deeper than the layer; nothing "
                "was written. Please report this shot."
            )
