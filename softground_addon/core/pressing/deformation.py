"""Compression of the ground, step by step (docs/model.md section 4; the paper, Eq. 10-11 corrected). `rim` has its rim.

Functions over arrays: whatever is said of a cell may be a number or an array over cells, so that a material that
varies over the ground only changes what is passed in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.ground_law import loose_strain, packed, strain
from ..ground.material import GroundMaterial
from ..imprints.sole_points import touching_fraction
from ..numerics.arrays import Array, Mask
from .plate import Plate

Fraction = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Sinking:
    """Sinking of a sole into the ground, at each of N steps.

    Attributes
    ----------
    area : (N,) float array
        Area that bears at the moment [m²]: that of contact, or more under a `plate.Plate`.
    target : (N,) float array
        Compression that the stress of the moment would lead to [m].
    sinkage : (N,) float array
        How far the ground had given way under the sole's lowest point when the step began [m].
    reached : float
        The same after the last step [m].
    """

    area: Array
    target: Array
    sinkage: Array
    reached: float


def target_compression(
    stress: Array | float,
    material: GroundMaterial,
    *,
    firmness: Array | float = 1.0,
    stiffness: Array | float = 1.0,
    depth: Array | float = 1.0,
) -> Array:
    """Compression that a lasting stress leads to [m]: the strain of the layer (Eq. 10; `ground_law`) times its depth.

    Parameters
    ----------
    stress : float array of any shape
        Normal stress [Pa]; over cells where the pressure varies under the sole.
    firmness : float
        See `GroundMaterial.firmness`.
    stiffness, depth : float or float array
        Factors on the modulus and on the depth of the layer, and of what is firm below, where the ground varies.

    Examples
    --------
    >>> snow = GroundMaterial(youngs_modulus=0.25e6, poisson_ratio=0.05, characteristic_time=0.2)
    >>> round(float(target_compression(21.9e3, snow)), 5)
    0.02628
    """
    load = np.asarray(stress) / (material.youngs_modulus * firmness * stiffness)
    return np.asarray(strain(load, material) * (material.layer_depth * depth))


def compression_rate(
    step: Any, material: GroundMaterial, target: Any = 0.0, landing_speed: Any = 0.0, plate: Plate | None = None
) -> Any:
    """Fraction of the target by which the ground gives way in a step (Eq. 11).

    Parameters
    ----------
    step : float or float array
        Duration of the step [s].
    target : float or float array
        Compression that the stress leads to [m].
    landing_speed : float or float array
        Speed into the ground at which the sole landed [m/s]; with a `shortest_time`, it sets the pace.
    plate : Plate, optional
        What the sole is in deep ground.
    """
    time: Any = material.characteristic_time
    if material.shortest_time and np.any(landing_speed):
        shortest = min(material.shortest_time, time)
        time = np.minimum(np.maximum(2.0 * target / landing_speed, shortest), time)
    return step / (plate.fall_time(time) if plate else time)


def sink(
    clearance: Array,
    area: Array,
    force: Array,
    *,
    tolerance: float,
    step: float,
    material: GroundMaterial,
    sinkage: float = 0.0,
    landing_speed: float = 0.0,
    firmness: float = 1.0,
    softness: Array | None = None,
    plate: Plate | None = None,
) -> Sinking:
    """Follow a loaded sole into the ground.

    The ground under the sole's lowest point gives way like any cell on untouched ground: it is the cell that is in
    contact all along.

    Parameters
    ----------
    clearance : (N, Q) float array
        Height of Q points of the underside above the undisturbed ground, less that of the lowest [m].
    area : (N, Q) float array
        Horizontal area that each point stands for [m²], 0 where it does not face the ground.
    force : (N,) float array
        Normal force on the sole [N].
    tolerance : float
        See `sole_points.touching_fraction` [m].
    step : float
        Time step [s].
    sinkage : float
        That reached before the first step [m].
    landing_speed : float
        See `compression_rate` [m/s].
    firmness : float
        See `GroundMaterial.firmness`.
    softness : (N, Q) float array, optional
        Compression of the ground under each point per that of the material, where the ground varies.
    plate : Plate, optional
        What the sole is in deep ground.

    Returns
    -------
    Sinking
    """
    steps = len(force)
    bearing_area, target, reached = np.zeros(steps), np.zeros(steps), np.zeros(steps + 1)
    rate = compression_rate(step, material, plate=plate)
    layer, modulus = material.layer_depth, material.youngs_modulus * firmness
    # Rounded as it always was where the ground is the paper's, so that old shots bake to the same bytes.
    per_pascal = layer / modulus if material.exponent == 1.0 and not material.firm_depth else 0.0
    follows_landing = bool(material.shortest_time and landing_speed)
    reached[0] = sinkage
    for k in range(steps):
        touching = touching_fraction(clearance[k], sinkage, tolerance)
        touching_area = bearing_area[k] = touching @ area[k]
        if force[k] > 0 and touching_area > 0:
            if plate:
                bearing_area[k] = plate.bearing(touching_area)
            stress = force[k] / bearing_area[k]
            fresh = stress * per_pascal or float(loose_strain(stress / modulus, material)) * layer
            if softness is not None:
                fresh *= float(touching @ (area[k] * softness[k])) / touching_area
            target[k] = packed(fresh, material, layer)
            if plate:
                target[k] = plate.depth(target[k])
            if follows_landing:
                rate = compression_rate(step, material, target[k], landing_speed, plate)
            if sinkage > 0 or stress >= material.crust_stress:
                sinkage += max(0.0, min(rate * target[k], target[k] - sinkage))
        reached[k + 1] = sinkage
    return Sinking(bearing_area, target, reached[:-1], float(sinkage))


def compress(
    compression: Array,
    coverage: Fraction,
    target: Array | float,
    rate: float,
    *,
    holds: Mask | bool = False,
    compacted: Array | None = None,
    hardening: float = 0.0,
) -> Array:
    """Compression of each cell after one more step [m] (Eq. 11).

    It grows by min(rate·target, target - compression) where that is positive. A cell that the contact covers in part
    is compressed in that part only; what is kept is the mean over the cell.

    A contact that finds a cell compressed by c0 already compresses it further against a modulus that is
    1 + hardening·c0/target times as large: of what the plain law adds beyond c0, it adds one part in so many. First
    prints are as without hardening; ground that carries such a load already gives way no further. (Soils and snow
    answer repeated loading far more stiffly than the first: Wong, Terramechanics and Off-Road Vehicle Engineering.)

    Parameters
    ----------
    compression : (rows, columns) float array
        Mean compression of each cell so far [m].
    coverage : (rows, columns) float array
        Fraction of each cell that is in contact.
    target : float or float array
        Compression that the stress leads to [m].
    rate : float
        From `compression_rate`.
    holds : bool or bool array
        Cells whose crust carries the stress, if it is whole; one that was ever compressed is broken.
    compacted : (rows, columns) float array, optional
        Compression of each cell before this contact [m].
    hardening : float
        See above.

    Returns
    -------
    (rows, columns) float array, nowhere less than before and nowhere raised above the target.

    Examples
    --------
    It never overshoots, however long the step, and never comes back:

    >>> compress(np.array([0.02, 0.04]), np.array([1.0, 1.0]), target=0.03, rate=0.5)
    array([0.03, 0.04])
    """
    aim = np.multiply(coverage, target, dtype=np.float64)
    if holds is not False:
        aim[holds & (compression == 0)] = 0.0
    further = rate * aim
    if compacted is not None and hardening:
        stiffer = 1.0 + hardening * np.divide(compacted, aim, out=np.ones_like(aim), where=aim > compacted)
        aim = compacted + (aim - compacted) / stiffer
        further /= stiffer
    further += compression
    np.minimum(further, aim, out=further)
    return np.maximum(further, compression, out=further)
