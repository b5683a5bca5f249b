"""Strain of the loose layer by a stress, and the reverse (docs/model.md section 4).

The paper's spring (Eq. 10) breaks off at the depth of the layer: strain = min(stress/E, 1). Measured ground follows a
power of the strain (Bekker 1969), and packs to a density beyond which it gives way no further:

    x = (stress/E)^(1/exponent),   strain = x/(1 + (x/densest)^4)^(1/4)

With exponent 1 and densest off it is the paper's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .material import FIRM_RATIO, MATERIAL_RANGES, GroundMaterial

PACKED = 1.0 - 1e-9
"""Nearest that a strain comes to the densest packing, under which the ground would bear any stress."""

CRUSHED = 1e3
"""Loose strain, in densest packings, at which the strain is the densest to rounding."""

SOFTEST, STIFFEST = MATERIAL_RANGES["youngs_modulus"]
LEAST_LOAD = 1e-12
"""Of a depth, over the modulus; less is none."""
LEAST_POWER, MOST_POWER = 0.1, 3.0
"""Range of the power by which the load that a depth shows, over the modulus, falls with the modulus."""
FREE_TRIALS = 8
"""Moduli that are tried for a depth before their interval is halved."""


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


def next_modulus(tried: Sequence[tuple[float, float]], depth: float, material: GroundMaterial) -> float:
    """The modulus [Pa] to try next for a depth [m], after others with the depths that they gave; the latest last.

    Follows the law of the material, under the load that the latest two show.

    Examples
    --------
    >>> next_modulus([(2e5, 0.06)], 0.03, GroundMaterial(2e5, 0.05, 0.2))
    400000.0
    >>> next_modulus([(2e5, 0.06)], 0.03, GroundMaterial(2e5, 0.05, 0.2, exponent=2.0))
    800000.0
    """
    modulus, reached = tried[-1]
    wanted, load = (max(float(load_at(at / material.layer_depth, material)), LEAST_LOAD) for at in (depth, reached))
    power = 1.0
    if len(tried) > 1 and tried[-2][0] != modulus and tried[-2][1] and reached:
        before = float(load_at(tried[-2][1] / material.layer_depth, material))
        power = float(np.clip(np.log(before / load) / np.log(modulus / tried[-2][0]), LEAST_POWER, MOST_POWER))
    guess = modulus * (load / wanted) ** (1 / power)
    softer = [before for before, deep in tried if deep > depth]
    stiffer = [before for before, deep in tried if deep < depth]
    low, high = max(softer, default=SOFTEST), min(stiffer, default=STIFFEST)
    if softer and stiffer and (len(tried) >= FREE_TRIALS or not low < guess < high):
        return float(np.sqrt(low * high))
    return float(np.clip(guess, low, high))
