"""Free moments: how each sole twists on the ground about the vertical through its centre of pressure.

What turns the body about the vertical is the forces beside its centre of mass and the feet that twist on the ground
(Holden and Cavanagh 1991, "The free moment of ground reaction in distance running and its changes with pronation",
J. Biomechanics 24(10), 10.1016/0021-9290(91)90167-L). The motion shows how the body turns, so that its angular momentum
less the moment of the forces leaves the twist.
"""

from __future__ import annotations

import numpy as np

from ..dynamics.body_dynamics import body_dynamics
from ..dynamics.centre_of_mass import trunk_spin
from ..dynamics.continuation import continued
from ..numerics.arrays import Array
from ..numerics.smoothing_spline import smooth_path
from .estimate import CharacterLoads

GRIP = 0.05
"""Largest free moment of a sole that presses with a force of 1, in leg lengths (32 N·m on an adult's foot that bears
one body weight): friction times how far from its middle a sole presses on average."""


def free_moments(loads: CharacterLoads) -> Array:
    """Moment of the ground on each sole about the upward axis through its centre of pressure, (N, S) [N·m].

    Anticlockwise as seen from above is positive. Soles that bear together twist in proportion to their loads; no sole
    twists by more than its grip, nor in flight.

    Raises
    ------
    ValueError
        Without joints.
    """
    motion = loads.motion
    if not motion.joints or motion.centre is not None:
        raise ValueError("only a body with joints has a free moment")
    longer, given = continued(motion)
    airborne = np.pad(~loads.contacts.touching.any(axis=1), (given.start, len(longer.frames) - given.stop), mode="edge")
    body = body_dynamics(longer, airborne)
    spin = np.zeros((len(longer.frames), 1))
    spin[longer.on_frames] = trunk_spin(longer.at_frames())
    _, turning, _ = smooth_path(spin, longer.time_step, body.cutoff, sampled=longer.on_frames)
    wanted = motion.mass * (longer.gravity * body.moment[given, 2] + turning[given, 0])
    force, load = loads.forces.forces, loads.forces.forces[..., 2]
    arm = np.nan_to_num(loads.forces.centre_of_pressure - body.centre[given][:, None])
    of_forces = (arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0]).sum(axis=1)
    total = load.sum(axis=1)
    share = np.divide(load, total[:, None], out=np.zeros_like(load), where=total[:, None] > 0)
    most = GRIP * motion.leg_length * load
    return np.asarray(np.clip(share * (wanted - of_forces)[:, None], -most, most))
