"""How deep a load presses a rigid body into the ground, and the shape of the hollow: bowls, ruts, grooves.

A flat sole presses evenly: stress = force/area, and the ground gives way by stress·L0/E (Eq. 10). The same ground under
a body of any shape is a bed of springs, each of which carries E/L0 per metre that the body presses it down (Winkler's
foundation; for wheels, Bekker's with exponent 1). The body sinks until they carry its load, so that

    E/L0 · ∫ compression dA = force,   compression = max(0, sinkage - clearance),

and the mean compression over the contact is what Eq. 10 says. A sphere of radius R that sinks by d touches within
sqrt(2Rd - d²) and leaves a cap of volume pi·d²(3R - d)/3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.material import FIRM_RATIO, GroundMaterial

Array = NDArray[np.float64]


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

    def sinkage(self, force: float, material: GroundMaterial) -> float:
        """How far the lowest sample sinks under a lasting force [N], at most by the layer's depth [m].

        Examples
        --------
        A flat plate of 0.1 m² sinks by force/area·L0/E:

        >>> plate = Springs(np.zeros(10), np.full(10, 0.01))
        >>> round(plate.sinkage(1000.0, GroundMaterial(1e6, 0.2, 0.1, layer_depth=0.3)), 6)
        0.003
        """
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
        return min(_reach(start, gain, force), material.layer_depth * float(np.max(self.depth)))

    def compression(self, sinkage: float, material: GroundMaterial) -> Array:
        """Compression under each sample at a sinkage, (Q,) [m]."""
        return np.clip(sinkage - self.clearance, 0.0, material.layer_depth * np.asarray(self.depth))


def stress(
    compression: Array, material: GroundMaterial, *, stiffness: Array | float = 1.0, depth: Array | float = 1.0
) -> Array:
    """What the ground carries where it is compressed so far [Pa]: the inverse of `deformation.target_compression`."""
    loaded = compression
    if material.firm_depth:
        beyond = np.maximum(compression - material.firm_depth * np.asarray(depth), 0.0)
        loaded = compression + (FIRM_RATIO - 1.0) * beyond
    layer = np.maximum(material.layer_depth * np.asarray(depth), 1e-300)
    return np.asarray(material.youngs_modulus * stiffness * loaded / layer)


def _reach(start: Array, gain: Array, load: float) -> float:
    """Where the sum of gain·max(0, x - start) comes to the load: exact, as it is straight between the starts."""
    order = np.argsort(start, kind="stable")
    start, gain = start[order], np.cumsum(gain[order])
    carried = np.concatenate([[0.0], np.cumsum(gain[:-1] * np.diff(start))])  # at each start
    last = int(np.searchsorted(carried, load, side="right")) - 1
    while last > 0 and gain[last] <= 0:
        last -= 1
    if gain[last] <= 0:
        return np.inf
    return float(start[last] + (load - carried[last]) / gain[last])
