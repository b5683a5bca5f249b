"""Steps on hard floors, which take no print: where and when soles tread, for what lies and grows there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ground.hard_ground import HardOnSoft
from ..ground.heightfield import Terrain
from ..ground.material import GroundMaterial
from ..ground.soft_ground import SoftGround
from ..ground.terrain import SAME_LAYER
from ..loads.estimate import CharacterLoads
from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from ..plants.tramplings import side_of
from ..record.footprints import Changes, Footprint
from .simulation import simulate

FLOOR = GroundMaterial(2e5, 0.0, 1e-3, layer_depth=0.02, rim_reach=0.0, blur_sigma=0.0)
"""The underside of a shoe, which gives way in place of the floor: 10 MPa/m, 4 mm under a person."""
HIGHEST = 0.5
"""Height over soft ground above which a floor is a deck or a bridge: what grows below is not trodden on [m]."""


@dataclass(frozen=True, eq=False)
class _Floor:
    """What is hard of a terrain."""

    terrain: HardOnSoft

    def heights(self, x: Array, y: Array) -> Array:
        """Heights at world positions [m], NaN where soft ground lies over it, or it is a deck above."""
        hard = self.terrain.hard_heights(x, y)
        floor = ~np.isnan(hard)
        soft = self.terrain.ground.heights(x[floor], y[floor])
        hard[floor] = np.where((soft > hard[floor] + SAME_LAYER) | (hard[floor] > soft + HIGHEST), np.nan, hard[floor])
        return hard


@sliced
def floor_prints(loads: Sequence[CharacterLoads], terrain: Terrain, cell_size: float) -> Slices[list[Footprint]]:
    """Footprints that change no heights, of all contacts with hard floors.

    Parameters
    ----------
    terrain : Terrain
        On which the loads were found; only a `HardOnSoft` has hard floors.
    cell_size : float
        Side of a cell of the ground [m]; those of the prints are as plants need them.
    """
    treading = [
        replace(character, contacts=replace(character.contacts, touching=character.contacts.hard))
        for character in loads
        if character.contacts.hard is not None and character.contacts.hard.any()
    ]
    prints: list[Footprint] = []
    if not isinstance(terrain, HardOnSoft) or not treading:
        return prints
    nothing = Changes(np.empty(0), np.zeros(1, np.int32), np.empty(0, np.int32), np.empty(0, np.int32))
    for result in simulate(treading, SoftGround(_Floor(terrain), FLOOR), side_of(cell_size)):
        prints += (
            replace(each, compression=nothing, rim=nothing, compressed_m3=0.0, rim_m3=0.0, unplaced_rim_m3=0.0)
            for each in result.footprints
        )
        yield
    return prints
