"""The volumes and depths of prints against the laws that they must obey."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import BakeError
from ..ground.soft_ground import SoftGround
from ..numerics.arrays import Array
from ..record.footprints import QUANTUM, Footprint

RIM_TOLERANCE = 1e-6
"""Largest relative error of the rim's volume that passes (docs/model.md section 4)."""
DEPTH_TOLERANCE = float(np.finfo(np.float32).eps)
"""Rounding of a depth, as the ground is kept in 32-bit floats."""


def check_volumes(footprints: Sequence[Footprint], ground: SoftGround, factors: Array | None = None) -> None:
    """Raise BakeError if a footprint breaks an invariant of docs/model.md section 4.

    Parameters
    ----------
    ground : SoftGround
        That they were baked on. Where a print lies on several materials, its rim's share lies between theirs.
    factors : (V, 3) float array, optional
        What is painted on the ground: there, the rim's share lies between the least and the largest painted.
    """
    depth, rim = np.ones((2, 2)) if factors is None else (np.append(column, 1.0) for column in factors[:, 1:].T)
    for footprint in footprints:
        materials = ground.materials_under(footprint.window, footprint.cell_size)
        ratios = [material.poisson_ratio for material in materials]
        least, most = np.clip(2.0 * np.array([min(ratios), max(ratios)]) * np.array([rim.min(), rim.max()]), 0.0, 1.0)
        deepest = max(material.deepest for material in materials)
        raised = footprint.rim_m3 + footprint.unplaced_rim_m3
        rounding = QUANTUM * footprint.cell_size**2 * (len(footprint.rim.cells) + len(footprint.compression.cells))
        low, high = least * footprint.compressed_m3, most * footprint.compressed_m3
        if not low * (1 - RIM_TOLERANCE) - rounding <= raised <= high * (1 + RIM_TOLERANCE) + rounding:
            fault = f"raised {raised:.6g} m³ where {high:.6g} m³ were displaced"
            raise BakeError(_said(footprint, fault), "wrong_volume", sole=footprint.sole)
        fallen = np.max(footprint.tile(footprint.pressing) - footprint.tile(footprint.compression), initial=0.0)
        if footprint.max_depth_m > (deepest * depth.max() + fallen) * (1 + DEPTH_TOLERANCE):
            raise BakeError(_said(footprint, "is deeper than the layer"), "deeper_than_layer", sole=footprint.sole)


def _said(footprint: Footprint, fault: str) -> str:
    where = f"The print of {footprint.sole} at frame {footprint.start_frame:.0f}"
    return f"{where} {fault}; nothing was written. Please report this as a bug."
