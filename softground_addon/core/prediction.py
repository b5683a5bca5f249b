"""How deep a shot's prints will be, without pressing any cell.

The ground gives way under each point of a sole as under a cell, as long as the sole does not slide (MODEL.md
section 4). What the material does not change - clearance, area and force of each stance - is gathered once; another
material then costs some milliseconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .ground.heightfield import Terrain, Window
from .ground.material import GroundMaterial, Pressure
from .ground.variation import Factors, Variation, layer_factors
from .loads.estimate import CharacterLoads
from .motion.props import posed
from .numerics.intervals import runs
from .pressing.contact_layout import landing_drop
from .pressing.deformation import compress, compression_rate, sink, target_compression, touching_fraction
from .pressing.ground_cells import UndisturbedCells
from .pressing.indentation import Springs, stress
from .pressing.pressure import pressure_field
from .pressing.prop_imprint import ground_under
from .pressing.sole_points import contact_window, places, point_contact, sole_points

Array = NDArray[np.float64]

MATCH_TOLERANCE = 1e-3
"""Relative error of a matched depth."""
MOST_TRIALS = 60
"""Halvings of the interval in which the modulus is searched: its logarithm is then known to rounding."""
POSES = 12
"""Steps of a body's contact that are looked at, and the one that presses hardest."""
SOFTEST, STIFFEST = 1e3, 1e10
"""Range in which a modulus is searched [Pa]."""
TAKES_NO_PRINT = (
    "No stiffness gives a print: the ground takes none under the feet. Look at what is painted on it, and at the crust "
    "of its material."
)


@dataclass(frozen=True)
class StanceLoad:
    """One sole from touching down to leaving, as the ground feels it.

    Attributes
    ----------
    character, sole : str
    frames : (N,) float array
        Scene frame of each step.
    clearance : (N, Q) float array
        Height of Q points of the underside above the ground, less that of the lowest [m].
    area : (N, Q) float array
        Area that each stands for [m²].
    force : (N,) float array
        Normal force [N].
    x, y : (N, Q) float arrays
        Places of the points [m].
    centre : (N, 2) float array
        Centre of pressure [m].
    factors : Factors or None
        How the ground varies, (N, Q) float arrays of what is under each point.
    tolerance : float
        See `deformation.touching_fraction` [m].
    step : float
        Time step [s].
    landing_speed : float
        See `deformation.compression_rate` [m/s].
    """

    character: str
    sole: str
    frames: Array
    clearance: Array
    area: Array
    force: Array
    x: Array
    y: Array
    centre: Array
    factors: Factors | None
    tolerance: float
    step: float
    landing_speed: float

    def depth(self, material: GroundMaterial, pressure: Pressure = "UNIFORM") -> float:
        """Depth of its print [m]: exact for a foot that rolls, too large for one that slides."""
        sinking = sink(
            self.clearance,
            self.area,
            self.force,
            tolerance=self.tolerance,
            step=self.step,
            material=material,
            landing_speed=self.landing_speed,
            softness=self.factors.softness if self.factors else None,
        )
        touching = touching_fraction(self.clearance, sinking.sinkage[:, None], self.tolerance)
        rate = compression_rate(self.step, material, sinking.target, self.landing_speed)
        rate = np.broadcast_to(rate, sinking.target.shape)
        normal_stress = (self.force / np.maximum(sinking.area, 1e-300))[:, None]
        target = sinking.target[:, None]
        if pressure == "CENTRE_OF_PRESSURE":
            field = pressure_field(self.x, self.y, self.area * touching, self.centre, self.tolerance)
            normal_stress = normal_stress * field.at(self.x, self.y)
        if pressure == "CENTRE_OF_PRESSURE" or self.factors:
            target = target_compression(normal_stress, material, **layer_factors(self.factors))
        holds = np.broadcast_to(normal_stress < material.crust_stress, touching.shape)
        compression = np.zeros(self.clearance.shape[1])
        for step in np.flatnonzero(sinking.target):
            compression = compress(compression, touching[step], target[step], rate[step], holds=holds[step])
        return float(compression.max(initial=0.0))


@dataclass(frozen=True)
class PropLoad:
    """One body from touching down to leaving, as the ground feels it at some of its steps.

    Attributes
    ----------
    character, sole : str
    frames : (N,) float array
        Scene frame of each step.
    springs : tuple of Springs
        The ground under it at some steps.
    force : (K,) float array
        Normal force at those [N].
    """

    character: str
    sole: str
    frames: Array
    springs: tuple[Springs, ...]
    force: Array

    def depth(self, material: GroundMaterial, _pressure: Pressure = "UNIFORM") -> float:
        """Depth to which it sinks if it rests there [m]: too large for one that rolls on before the ground gives.

        Its pressure follows from its shape, whatever is chosen for soles.
        """
        loads = zip(self.springs, self.force.tolist(), strict=True)
        return max((_depth_under(springs, force, material) for springs, force in loads), default=0.0)


def _depth_under(springs: Springs, force: float, material: GroundMaterial) -> float:
    """Largest compression under a lasting force, where the crust gives way to it [m]."""
    compression = springs.compression(springs.sinkage(force, material), material)
    loaded = stress(compression, material, stiffness=springs.stiffness, depth=springs.depth)
    return float(compression.max(initial=0.0, where=loaded >= material.crust_stress))


def stance_loads(
    loads: Sequence[CharacterLoads], terrain: Terrain, cell_size: float, variation: Variation | None = None
) -> list[StanceLoad | PropLoad]:
    """Every stance of the characters, in the order of their first contact.

    Parameters
    ----------
    loads : sequence of CharacterLoads
    terrain : Terrain
        The undisturbed ground.
    cell_size : float
        Side of a cell [m]: the ground's height is looked up once per cell.
    variation : Variation, optional
        How the ground varies from place to place.
    """
    cells = UndisturbedCells(terrain, variation, cell_size)
    stances: list[StanceLoad | PropLoad] = []
    for character in loads:
        for index, sole in enumerate(character.motion.soles):
            load = _prop_loads if sole.sole.prop else _sole_loads
            stances += load(character, index, cells)
    return sorted(stances, key=lambda stance: float(stance.frames[0]))


def _contacts_of(character: CharacterLoads, index: int) -> Iterator[slice]:
    """The steps of each contact of a sole, without the first of all: that is a state, it presses nothing."""
    for first, end in zip(*runs(character.contacts.touching[:, index]), strict=True):
        if end > max(first, 1):
            yield slice(max(int(first), 1), int(end))


def _sole_loads(character: CharacterLoads, index: int, cells: UndisturbedCells) -> Iterator[StanceLoad]:
    """Every contact of a foot."""
    motion = character.motion
    sole = motion.soles[index]
    points = sole_points(sole.sole, sole.transforms)
    divisions = points.cell_divisions(cells.cell_size)
    for steps in _contacts_of(character, index):
        poses, normals = sole.transforms[steps], character.contacts.normal[steps, index]
        window = contact_window(points, poses, cells.cell_size)
        contact = point_contact(points, poses, cells.surface(window, divisions))
        x, y = places(points, poses)
        factors = cells.factors(window)
        if factors:
            under = window.cells_under(x, y, cells.cell_size)
            factors = Factors(*(factor[under] for factor in factors))
        landing = sole.transforms[max(0, steps.start - 2) : steps.start + 1]
        force = np.einsum("ni,ni->n", character.forces.forces[steps, index], normals)
        yield StanceLoad(
            character=motion.name,
            sole=sole.sole.name,
            frames=motion.frames[steps],
            clearance=contact.clearance,
            area=contact.area / normals[:, 2:],
            force=np.maximum(force, 0.0),
            x=x,
            y=y,
            centre=character.forces.centre_of_pressure[steps, index, :2],
            factors=factors,
            tolerance=points.tolerance,
            step=motion.time_step,
            landing_speed=landing_drop(sole.sole, landing, normals[0]) / motion.time_step,
        )


def _prop_loads(character: CharacterLoads, index: int, cells: UndisturbedCells) -> Iterator[PropLoad]:
    """Every contact of a body."""
    motion = character.motion
    sole, force = motion.soles[index], character.forces.forces[:, index]
    prop = sole.sole.prop
    assert prop is not None, sole.sole.name
    normal_force = np.maximum(np.einsum("ni,ni->n", force, character.contacts.normal[:, index]), 0.0)
    for contact in _contacts_of(character, index):
        steps = np.arange(contact.start, contact.stop)
        chosen = np.unique([*np.linspace(steps[0], steps[-1], POSES).astype(int), steps[normal_force[steps].argmax()]])
        springs, pressing = [], []
        for step in chosen:
            pose = sole.transforms[step, 0]
            place = posed(prop.vertices, pose)[:, :2]
            window = Window.around(place.min(axis=0), place.max(axis=0), cells.cell_size)
            under = ground_under(prop, pose, cells.surface(window), np.inf, cells.factors(window))
            if under is not None:
                springs.append(under.springs)
                pressing.append(normal_force[step])
        yield PropLoad(motion.name, sole.sole.name, motion.frames[steps], tuple(springs), np.array(pressing))


def deepest(
    stances: Sequence[StanceLoad | PropLoad], material: GroundMaterial, pressure: Pressure = "UNIFORM"
) -> float:
    """Depth of the deepest print [m], 0 if there is none."""
    return max((stance.depth(material, pressure) for stance in stances), default=0.0)


def matching_modulus(
    stances: Sequence[StanceLoad | PropLoad], material: GroundMaterial, depth: float, pressure: Pressure = "UNIFORM"
) -> float:
    """The modulus [Pa] at which the deepest print gets a depth, everything else being equal.

    Parameters
    ----------
    stances : sequence of StanceLoad or PropLoad
    material : GroundMaterial
    depth : float
        Wanted depth of the deepest print [m].
    pressure : 'UNIFORM' or 'CENTRE_OF_PRESSURE'

    Raises
    ------
    InputError
        If no modulus gives that depth.
    """
    low, high = SOFTEST, STIFFEST
    if not deepest(stances, replace(material, youngs_modulus=high), pressure) <= depth <= material.layer_depth:
        raise InputError(
            f"No stiffness gives prints of {depth * 100:.3g} cm: choose a depth between 0 and the layer's, "
            f"{material.layer_depth * 100:.3g} cm."
        )
    if not deepest(stances, replace(material, youngs_modulus=low), pressure) > 0:
        raise InputError(TAKES_NO_PRINT)
    for _ in range(MOST_TRIALS):
        modulus = float(np.sqrt(low * high))
        reached = deepest(stances, replace(material, youngs_modulus=modulus), pressure)
        if abs(reached - depth) <= MATCH_TOLERANCE * depth:
            return modulus
        low, high = (modulus, high) if reached > depth else (low, modulus)
    raise InputError(
        f"Prints of {depth * 100:.3g} cm cannot be reached with feet that rest so briefly on the ground: shorten the "
        "ground's time, or choose a smaller depth."
    )
