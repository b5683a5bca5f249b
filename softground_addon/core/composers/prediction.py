"""How deep a shot's prints will be, without pressing any cell: the typical one, and the deepest.

What the material does not change is gathered once for each contact: how large it is at any sinkage, how high its
underside is over the ground. Another material then follows all contacts at once, step by step, into the ground under
their lowest points; those into which it gives way the furthest are followed under all of their soles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..ground.heightfield import Terrain
from ..ground.material import GroundMaterial, Pressure
from ..ground.variation import Variation
from ..loads.estimate import CharacterLoads
from ..numerics.slices import Slices, sliced
from ..pressing.ground_cells import UndisturbedCells
from ..pressing.prop_imprint import GroundUnder
from ..record.typical_depth import main_contacts, median_depth
from .resting_props import depth_under, prop_poses
from .sinking_soles import ContactTable, SinkingSoles
from .sole_contacts import NEVER_LANDS, SoleContact, sole_contacts, square_sizes

Array = NDArray[np.float64]

FEW = 6
"""Contacts that are followed under all of their soles where an estimate will do, and poses of bodies."""
TYPICAL = 24
"""Contacts that tell the depth of the typical one."""
FINEST_CELL = 1 / 240
"""Finer cells tell no more of the depth, in lengths of the shortest sole: 1.1 mm for an adult."""
MATCH_TOLERANCE = 2e-3
"""Relative error of a matched depth."""
FREE_TRIALS = 6
"""Guesses of the modulus before it is searched by halving."""
MOST_TRIALS = 60
"""Halvings of the interval in which the modulus is searched: its logarithm is then known to rounding."""
SOFTEST, STIFFEST = 1e3, 1e10
"""Range in which a modulus is searched [Pa]."""
TAKES_NO_PRINT = (
    "No stiffness gives a print: the ground takes none under the feet. Check the masks, and the crust "
    "in Advanced > Layers."
)


@dataclass(frozen=True)
class ContactLoads:
    """Every contact of a shot, as the ground feels it.

    Attributes
    ----------
    soles : tuple of SoleContact
        Those of the most steps first.
    poses : tuple of (GroundUnder, float)
        The ground under bodies at some steps, and the normal force at those [N]; the hardest first.
    table : ContactTable or None
        Of the soles, if there are any.
    """

    soles: tuple[SoleContact, ...]
    poses: tuple[tuple[GroundUnder, float], ...]
    table: ContactTable | None

    def deepest(self, material: GroundMaterial, pressure: Pressure = "UNIFORM", most: int | None = None) -> float:
        """Depth of the deepest print [m], 0 if there is none.

        Parameters
        ----------
        material : GroundMaterial
        pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'
            Of soles; that of bodies follows from their shape.
        most : int, optional
            Look at so many contacts only, where the ground gives way the furthest, with as many that they lie on; and
            at so many poses of bodies, which press the hardest.
        """
        depth = max((depth_under(under, force, material) for under, force in self.poses[:most]), default=0.0)
        if self.table is None:
            return depth
        sinking = self.table.sink(material)
        furthest = np.argsort(-sinking.reached, kind="stable")[:most]
        furthest = furthest[sinking.reached[furthest] > 0]
        if most is not None:
            furthest = self.table.with_those_under(furthest, 2 * most)
        return max(depth, float(_depths(self.table, furthest, sinking, material, pressure).max()))

    def typical(self, material: GroundMaterial, pressure: Pressure = "UNIFORM") -> float:
        """Depth of the typical print [m]; see `typical_depth`."""
        return typical_depth(self, material, pressure)

    def modulus_for(self, material: GroundMaterial, share: float) -> float:
        """The modulus [Pa] with which prints are about so many times as deep: by how far the ground gives way under
        the lowest points alone, which is known at once."""
        if (table := self.table) is None:
            return material.youngs_modulus / share
        main = main_contacts(table.impulse())

        def reached(modulus: float) -> float:
            return float(np.median(table.sink(replace(material, youngs_modulus=modulus)).reached[main]))

        modulus = material.youngs_modulus
        aim = share * reached(modulus)
        for _ in range(FREE_TRIALS):
            modulus = float(np.clip(modulus * reached(modulus) / max(aim, NEVER_LANDS), SOFTEST, STIFFEST))
        return modulus


@sliced
def typical_depth(contacts: ContactLoads, material: GroundMaterial, pressure: Pressure = "UNIFORM") -> Slices[float]:
    """Depth of the typical print [m]; see `record.typical_depth`. Of bodies alone, that of the deepest.

    Of many contacts, those are looked at into which the ground gives way about as far as into the median one.

    Parameters
    ----------
    contacts : ContactLoads
    material : GroundMaterial
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'
    """
    if (table := contacts.table) is None:
        return contacts.deepest(material, pressure, most=FEW)
    sinking = table.sink(material)
    main = np.flatnonzero(main_contacts(table.impulse()))
    main = main[np.argsort(sinking.reached[main], kind="stable")]
    beside = max(0, (len(main) - TYPICAL) // 2)
    chosen = main[beside : len(main) - beside]
    together = table.with_those_under(chosen, 2 * TYPICAL)
    yield
    depths = yield from table.pressing(together, sinking, material, pressure)
    return median_depth(depths[chosen])


@sliced
def _depths(
    table: ContactTable, chosen: NDArray[np.intp], sinking: SinkingSoles, material: GroundMaterial, pressure: Pressure
) -> Slices[Array]:
    return (yield from table.pressing(chosen, sinking, material, pressure))


@sliced
def contact_loads(
    loads: Sequence[CharacterLoads], terrain: Terrain, cell_size: float, variation: Variation | None = None
) -> Slices[ContactLoads]:
    """Every contact of the characters.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    terrain : Terrain
        The undisturbed ground.
    cell_size : float
        Side of a cell [m]: the ground's height is looked up once per cell, or `FINEST_CELL`.
    variation : Variation, optional
        How the ground varies from place to place.
    """
    shortest = min((sole.sole.length for one in loads for sole in one.motion.soles), default=0.0)
    cell_size = max(cell_size, FINEST_CELL * shortest)
    cells = UndisturbedCells(terrain, variation, cell_size)
    of_size = {cell_size: cells}
    soles: list[SoleContact] = []
    poses: list[tuple[GroundUnder, float]] = []
    sizes = square_sizes(loads, cell_size)
    yield
    for number, (character, size) in enumerate(zip(loads, sizes, strict=True)):
        squares = of_size.setdefault(size, UndisturbedCells(terrain, None, size))
        for index, sole in enumerate(character.motion.soles):
            if sole.sole.prop:
                for pose in prop_poses(character, index, cells):
                    poses.append(pose)
                    yield
            else:
                soles += yield from sole_contacts(character, number, index, cells, squares)
    soles.sort(key=lambda contact: -len(contact.force))
    poses.sort(key=lambda pose: -pose[1])
    table = (yield from ContactTable.of(soles)) if soles else None
    return ContactLoads(tuple(soles), tuple(poses), table)


def matching_modulus(
    contacts: ContactLoads, material: GroundMaterial, depth: float, pressure: Pressure = "UNIFORM"
) -> float:
    """The modulus [Pa] at which the typical print gets a depth, everything else being equal.

    Parameters
    ----------
    contacts : ContactLoads
    material : GroundMaterial
    depth : float
        Wanted depth of the typical print [m].
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'

    Raises
    ------
    InputError
        If no modulus gives that depth.
    """

    def reached(modulus: float) -> float:
        return contacts.typical(replace(material, youngs_modulus=modulus), pressure)

    modulus = material.youngs_modulus
    for _ in range(FREE_TRIALS):
        found = reached(modulus)
        if abs(found - depth) <= MATCH_TOLERANCE * depth:
            return modulus
        if not found > 0:
            break
        modulus = float(np.clip(modulus * found / depth, SOFTEST, STIFFEST))  # depths are about inverse to it
    low, high = SOFTEST, STIFFEST
    if not reached(high) <= depth <= material.layer_depth:
        raise InputError(
            f"No stiffness gives prints of {depth * 100:.3g} cm: choose a depth between 0 and the layer's, "
            f"{material.layer_depth * 100:.3g} cm."
        )
    if not reached(low) > 0:
        raise InputError(TAKES_NO_PRINT)
    for _ in range(MOST_TRIALS):
        modulus = float(np.sqrt(low * high))
        found = reached(modulus)
        if abs(found - depth) <= MATCH_TOLERANCE * depth:
            return modulus
        low, high = (modulus, high) if found > depth else (low, modulus)
    raise InputError(
        f"The feet touch the ground too briefly for prints of {depth * 100:.3g} cm: lower Settling Time in Advanced > "
        "Realism, or choose a smaller depth."
    )
