"""Ground reaction forces from motion alone, and the footprints that they leave in soft ground.

Everything is in seconds, metres, newtons and kilograms, Z up. All numbers are computed by the core of the SoftGround
extension for Blender, which is part of this package and needs NumPy alone.

Examples
--------
A body of 70 kg on one spot, whose feet bear its weight:

>>> import numpy as np
>>> import softground
>>> standing = {"hip": 0.9, "knee": 0.5, "ankle": 0.09, "heel": 0.03, "ball": 0.03, "toe": 0.03}
>>> along = {"heel": -0.06, "ball": 0.13, "toe": 0.2}
>>> joints = {
...     f"{joint}_{side}": np.tile([along.get(joint, 0.0), y, height], (60, 1))
...     for side, y in (("l", 0.1), ("r", -0.1))
...     for joint, height in standing.items()
... }
>>> loads = softground.estimate_loads(softground.Body.from_joints(joints, 60.0, mass=70.0))
>>> weight = sum(sole.force[:, 2] for sole in loads.soles)
>>> bool(np.allclose(weight, 70.0 * 9.81))
True
>>> prints = softground.press(loads, softground.Ground(softground.snow("four fingers")), cell_size=0.01)
>>> [each.sole for each in prints.prints]
['foot.L', 'foot.R']
"""

from ._core.capture.skeleton import Bone, Skeleton
from ._core.errors import BakeError, InputError, SoftGroundError
from ._core.ground.heightfield import Terrain
from ._core.ground.material import GroundMaterial
from .body import Body
from .forces import Loads, SoleLoads, estimate_loads
from .plates import PlateLoads, plates_on_feet
from .prints import Ground, Print, Prints, presets, press, snow
from .readers import read_amass, read_bvh, read_c3d, read_trc
from .tables import to_csv, to_opensim

__all__ = [
    "BakeError",
    "Body",
    "Bone",
    "Ground",
    "GroundMaterial",
    "InputError",
    "Loads",
    "PlateLoads",
    "Print",
    "Prints",
    "Skeleton",
    "SoftGroundError",
    "SoleLoads",
    "Terrain",
    "estimate_loads",
    "plates_on_feet",
    "presets",
    "press",
    "read_amass",
    "read_bvh",
    "read_c3d",
    "read_trc",
    "snow",
    "to_csv",
    "to_opensim",
]
