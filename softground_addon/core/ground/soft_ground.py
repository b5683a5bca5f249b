"""A soft ground before anything presses it: its shape, what it is made of, and how it takes a load."""

from __future__ import annotations

from dataclasses import dataclass

from .heightfield import Terrain
from .material import GroundMaterial, Pressure
from .variation import Variation


@dataclass(frozen=True)
class SoftGround:
    """What a simulation presses.

    Attributes
    ----------
    terrain : Terrain
        The undisturbed ground.
    material : GroundMaterial
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'
        How the force on a sole spreads over its contact.
    variation : Variation or None
        How the ground varies from place to place.
    """

    terrain: Terrain
    material: GroundMaterial
    pressure: Pressure = "UNIFORM"
    variation: Variation | None = None
