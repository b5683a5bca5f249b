"""Strain of the loose layer by a stress, and the reverse (docs/model.md section 4).

The paper's spring (Eq. 10) breaks off at the depth of the layer: strain = min(stress/E, 1). Measured ground follows a
power of the strain (Bekker 1969), and packs to a density beyond which it gives way no further:

    x = (stress/E)^(1/exponent),   strain = x/(1 + (x/densest)^4)^(1/4)

With exponent 1 and densest off it is the paper's.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .material import FIRM_RATIO, GroundMaterial

PACKED = 1.0 - 1e-9
"""Nearest that a strain comes to the densest packing, under which the ground would bear any stress."""

CRUSHED = 1e3
"""Loose strain, in densest packings, at which the strain is the densest to rounding."""


def strain(load: Any, material: GroundMaterial) -> Any:
    """Strain of the loose layer under a lasting load, its stress over the stiffness of the ground.

    Examples
    --------
    >>> snow = GroundMaterial(137e3, 0.03, 0.2, layer_depth=1.08, exponent=2.0, densest=0.56)
    >>> round(float(strain(11e3 / 137e3, snow)), 3)
    0.279
    """
    return packed(loose_strain(load, material), material)


def loose_strain(load: Any, material: GroundMaterial) -> Any:
    """Strain of a layer that packs without limit; of a number or an array."""
    loose = load if material.exponent == 1.0 else load ** (1.0 / material.exponent)
    if not material.firm_depth:
        return loose
    firm = material.firm_depth / material.layer_depth
    return np.minimum(loose, firm) + np.maximum(loose - firm, 0.0) / FIRM_RATIO


def packed(loose: Any, material: GroundMaterial, layer: float = 1.0) -> Any:
    """A strain within its limit; or a compression, of a layer of that depth [m]."""
    if not material.densest:
        return _least(loose, layer)
    limit = material.densest * layer
    share = _least(loose / limit, CRUSHED)
    squared = share * share
    return limit * share / ((1.0 + squared * squared) ** 0.5) ** 0.5


def _least(values: Any, most: float) -> Any:
    return min(values, most) if isinstance(values, float) else np.minimum(values, most)


def load_at(strain: Any, material: GroundMaterial) -> Any:
    """The inverse of `strain`: stress over the stiffness of the ground; beyond a strain of 1, as if the layer went on.

    Examples
    --------
    >>> clay = GroundMaterial(379e3, 0.45, 0.05, exponent=0.5)
    >>> float(strain(load_at(0.25, clay), clay))
    0.25
    """
    loose = strain
    if material.densest:
        packed = np.minimum(strain / material.densest, PACKED) ** 2
        loose = np.minimum(strain, material.densest) / ((1.0 - packed * packed) ** 0.5) ** 0.5
    if material.firm_depth:
        firm = material.firm_depth / material.layer_depth
        loose = loose + (FIRM_RATIO - 1.0) * np.maximum(loose - firm, 0.0)
    return loose if material.exponent == 1.0 else loose**material.exponent
