"""What a plate measures about its normal."""

import numpy as np


def free_moment(plate):
    """Moment about the normal at the centre of pressure, (S,) [N·m]; NaN where nothing presses."""
    arm = plate.centre_of_pressure() - plate.corners.mean(axis=0)
    return (plate.moment - np.cross(arm, plate.force)) @ plate.normal
