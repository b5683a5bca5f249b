"""Depth to which a load presses a rigid body into the ground, and the shape of the hollow: bowls, ruts, grooves.

A flat sole presses evenly, and the ground gives way as `ground_law` says of stress = force/area. The same ground under
a body of any shape is a bed of springs, each of which carries what the law says of how far the body presses it down
(Winkler's foundation; for wheels, Bekker's). The body sinks until they carry its load, so that

    ∫ stress(compression) dA = force,   compression = max(0, sinkage - clearance),

and under the paper's linear law, E/L0 per metre, the mean compression over the contact is what Eq. 10 says. A sphere of
radius R that sinks by d touches within sqrt(2Rd - d²) and leaves a cap of volume pi·d²(3R - d)/3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.ground_law import load_at
from ..ground.material import FIRM_RATIO, GroundMaterial
from ..numerics.arrays import Array

CLOSE = 1e-9
"""Relative error of the load that a body is borne with on ground whose springs are not linear."""
MOST_ROUNDS = 60
"""Trials of a sinkage; five or six suffice."""
TINY = 1e-300
"""Depth that stands for a layer of none [m]."""
SHALLOW = 0.01
"""Sinkage that is tried first where none is known, in parts of the deepest."""


@dataclass(frozen=True)
class Springs:
    """The ground under Q samples of a body's underside.

    Attributes
    ----------
    clearance : (Q,) float array
        Height of each sample above the undisturbed ground, less that of the lowest [m].
    area : (Q,) float array
        Area of ground that each stands for [m²].
    stiffness, depth : (Q,) float arrays or float
        Factors on the modulus and on the depth of the layer, where the ground varies.
    """

    clearance: Array
    area: Array
    stiffness: Array | float = 1.0
    depth: Array | float = 1.0

    def sinkage(self, force: float, material: GroundMaterial, firmness: float = 1.0, near: float = 0.0) -> float:
        """Sinkage of the lowest sample under a lasting force [N], at most by what the layer gives way [m].

        Parameters
        ----------
        firmness : float
            See `GroundMaterial.firmness`.
        near : float
            A sinkage that is likely, as under the pose before [m].

        Examples
        --------
        A flat plate of 0.1 m² sinks by force/area·L0/E:

        >>> plate = Springs(np.zeros(10), np.full(10, 0.01))
        >>> round(plate.sinkage(1000.0, GroundMaterial(1e6, 0.2, 0.1, layer_depth=0.3)), 6)
        0.003
        """
        deepest = material.deepest * float(np.max(self.depth))
        if material.linear:
            return min(self._linear_sinkage(force / firmness, material), deepest)
        return self._searched_sinkage(force, material, firmness, near, deepest)

    def _linear_sinkage(self, force: float, material: GroundMaterial) -> float:
        layer = material.layer_depth * np.asarray(self.depth)
        bears = np.broadcast_to(layer > 0, self.clearance.shape)
        rate = np.divide(
            self.area * material.youngs_modulus * self.stiffness, layer, where=bears, out=np.zeros_like(self.area)
        )
        start, gain = self.clearance, rate
        if material.firm_depth:
            firm = material.firm_depth * np.broadcast_to(self.depth, start.shape)
            start = np.concatenate([start, start + firm])
            gain = np.concatenate([gain, (FIRM_RATIO - 1.0) * rate])
        return _reach(start, gain, force)

    def _searched_sinkage(
        self, force: float, material: GroundMaterial, firmness: float, near: float, deepest: float
    ) -> float:
        """Sinkage by regula falsi in logarithms, in which a power law is a straight line."""
        weight = self.area * self.stiffness * (material.youngs_modulus * firmness) * (np.asarray(self.depth) > 0)
        layer = np.maximum(material.layer_depth * np.asarray(self.depth), TINY)

        def carried(sinkage: float) -> float:
            return float(weight @ load_at(np.maximum(sinkage - self.clearance, 0.0) / layer, material))

        if carried(deepest) <= force:
            return deepest
        low, high = 0.0, deepest
        trial, slope, before = min(near or SHALLOW * deepest, deepest / 2), material.exponent, None
        for _ in range(MOST_ROUNDS):
            bears = carried(trial)
            if abs(bears - force) <= CLOSE * force:
                break
            low, high = (trial, high) if bears < force else (low, trial)
            if before is not None and bears > 0:
                slope = np.log(bears / before[1]) / np.log(trial / before[0])
            if bears > 0:
                before = trial, bears
            trial = trial * float((force / bears) ** (1.0 / slope)) if bears > 0 and slope > 0 else high
            if not low < trial < high:
                trial = (low + high) / 2
        return trial

    def compression(self, sinkage: float, material: GroundMaterial) -> Array:
        """Compression under each sample at a sinkage, (Q,) [m]."""
        return np.clip(sinkage - self.clearance, 0.0, material.deepest * np.asarray(self.depth))


def stress(
    compression: Array,
    material: GroundMaterial,
    *,
    firmness: Array | float = 1.0,
    stiffness: Array | float = 1.0,
    depth: Array | float = 1.0,
) -> Array:
    """Pressure of the ground where it is compressed so far [Pa]: the inverse of `deformation.target_compression`."""
    layer = np.maximum(material.layer_depth * np.asarray(depth), TINY)
    return np.asarray(material.youngs_modulus * firmness * stiffness * load_at(compression / layer, material))


def _reach(start: Array, gain: Array, load: float) -> float:
    """Solution x of sum(gain·max(0, x - start)) = load: exact, as the sum is straight between the starts."""
    order = np.argsort(start, kind="stable")
    start, gain = start[order], np.cumsum(gain[order])
    carried = np.concatenate([[0.0], np.cumsum(gain[:-1] * np.diff(start))])  # at each start
    last = int(np.searchsorted(carried, load, side="right")) - 1
    while last > 0 and gain[last] <= 0:
        last -= 1
    if gain[last] <= 0:
        return np.inf
    return float(start[last] + (load - carried[last]) / gain[last])
