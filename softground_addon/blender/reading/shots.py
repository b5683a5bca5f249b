"""A shot as it is read from the scene: what its characters do, and the ground that they do it on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.ground.heightfield import Terrain
from ...core.ground.soft_ground import SoftGround
from ...core.ground.terrain import MeshTerrain
from ...core.ground.variation import PaintedSurface
from ...core.ground_plan import GroundPlan, plan_ground
from ...core.loads.estimate import CharacterLoads, estimate_loads
from ...core.motion.motion import CharacterMotion
from .. import settings
from ..characters.character_setup import characters_of, mapping_of, title_of
from ..characters.prop_extraction import check_things
from ..characters.rig_sampling import sample_character, sample_thing
from ..ground import ground_checks, ground_mesh, painted_ground
from ..ground.ground_mesh import GroundSurface
from ..jobs import Job, Progress, counted, meanwhile
from ..properties import SoftGroundCharacter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shot:
    """A shot as it was read from the scene.

    Attributes
    ----------
    motions : tuple of CharacterMotion
        At scene frames.
    plan : GroundPlan
        Where the walk goes, and the ground that fits it.
    surface : GroundSurface or None
        The scene's ground, if it has one.
    terrain : Terrain
        The undisturbed ground.
    """

    motions: tuple[CharacterMotion, ...]
    plan: GroundPlan
    surface: GroundSurface | None
    terrain: Terrain

    @property
    def variation(self) -> PaintedSurface | None:
        """How the ground varies from place to place, where it is painted."""
        painted = self.surface is not None and self.surface.factors is not None
        return PaintedSurface(self.terrain) if painted and isinstance(self.terrain, MeshTerrain) else None


def read_shot(scene: bpy.types.Scene) -> Job[Shot]:
    """What the scene's characters do, and the ground that they do it on.

    Raises
    ------
    InputError
        If the settings, a character or the ground cannot be used; names it and the remedy.
    """
    options = scene.softground
    characters = characters_of(scene)
    check_settings(scene, characters)
    motions = yield from sample_characters(scene, characters)
    plan = yield from meanwhile(Progress("sample", 1.0), plan_ground.slices(motions))
    if options.ground is None:
        return Shot(tuple(motions), plan, None, plan.terrain)
    painted = painted_ground.names_of(scene)
    surface = ground_mesh.undisturbed_surface(options.ground, scene.unit_settings.scale_length, painted)
    yield Progress("sample", 1.0)
    work = ground_mesh.terrain_of.slices(surface, np.stack([plan.lower, plan.upper]))
    terrain = yield from meanwhile(Progress("sample", 1.0), work)
    return Shot(tuple(motions), plan, surface, terrain)


def ground_of(scene: bpy.types.Scene, shot: Shot) -> SoftGround:
    """The ground of a shot, with the material and the spread of pressure that the scene has now."""
    return SoftGround(shot.terrain, settings.material_of(scene), scene.softground.pressure, shot.variation)


def estimate_shot(scene: bpy.types.Scene, shot: Shot) -> Job[list[CharacterLoads]]:
    """The loads of all characters of a shot, with the masses and force models that the scene has now.

    Raises
    ------
    InputError
        If nobody touches the ground.
    """
    material = settings.material_of(scene)
    characters = characters_of(scene)
    loads = []
    for motion, character in zip(shot.motions, characters, strict=True):
        moved = replace(motion, mass=settings.typed(character.mass))
        work = estimate_loads.slices(moved, shot.terrain, force_model=character.force_model, material=material)
        loads.append((yield from meanwhile(Progress("sample", 1.0), work)))
    ground = scene.softground.ground
    yield Progress("sample", 1.0)
    check_contacts(loads, shot.terrain, ground and ground.name)
    return loads


def check_contacts(loads: Sequence[CharacterLoads], terrain: Terrain, ground: str | None) -> None:
    """Raise InputError if nothing touches the ground of that name, or it lies overhead or in layers under a foot."""
    place = np.concatenate(
        [
            sole.landmark_positions()[character.contacts.touching[:, number]].reshape(-1, 3)
            for character in loads
            for number, sole in enumerate(character.motion.soles)
        ]
    )
    name = f"'{ground}'" if ground else "the ground"
    if not len(place):
        characters = ", ".join(f"'{character.motion.name}'" for character in loads)
        raise InputError(
            f"No foot of {characters} touches {name} in these frames: move the ground under the feet, or correct the "
            "feet in the Character panel."
        )
    if isinstance(terrain, MeshTerrain) and not terrain.is_height_field(place[:, 0], place[:, 1]).all():
        raise InputError(
            f"Ground {name} has several layers one above the other under the feet, such as a bridge or an overhang: "
            "separate the layer that is walked on into an object of its own."
        )
    for character in loads:
        contacts, leg = character.contacts, character.motion.leg_length
        below = -(contacts.clearance + contacts.offset)[contacts.touching]
        if len(below) and (depth := float(np.median(below))) > leg:
            raise InputError(
                f"The feet of '{character.motion.name}' are {depth:.2g} m below {name}: move the ground down to them. "
                "Where it is a room, let its faces look inward (Edit Mode, Mesh > Normals > Recalculate Inside)."
            )


def fit_ground(scene: bpy.types.Scene) -> Job[GroundPlan]:
    """The ground that fits the walk of the scene's characters.

    Raises
    ------
    InputError
        If the characters cannot be read.
    """
    characters = characters_of(scene)
    check_settings(scene, characters)
    motions = yield from sample_characters(scene, characters)
    return (yield from meanwhile(Progress("sample", 1.0), plan_ground.slices(motions)))


def check_settings(scene: bpy.types.Scene, characters: Sequence[SoftGroundCharacter]) -> None:
    """Raise InputError, naming the remedy, if the scene's settings cannot be baked."""
    settings.forget_deleted_ground(scene)
    options = scene.softground
    for character in options.characters:
        if character.armature is None and character.soles and not any(s.object or s.bone for s in character.soles):
            raise InputError(
                f"The object of '{character.name}' is gone: choose another one in Soles, or remove '{character.name}' "
                "from the characters."
            )
    if not characters:
        raise InputError(
            "No character is set up: select an animated armature, or objects that fall or roll, and press Add "
            "Character."
        )
    for character in characters:
        check_things(scene, title_of(character), mapping_of(character).soles)
    if options.frame_end <= options.frame_start:
        raise InputError(
            f"The frame range {options.frame_start}-{options.frame_end} is empty: set End after Start in the Bake "
            "panel."
        )
    if options.ground is not None:
        ground_checks.check_usable(options.ground)


def sample_characters(scene: bpy.types.Scene, characters: Sequence[SoftGroundCharacter]) -> Job[list[CharacterMotion]]:
    """The motion of each character."""
    motions = []
    options = scene.softground
    frames = range(options.frame_start, options.frame_end + 1)
    for number, character in enumerate(characters):
        mapping, mass = mapping_of(character), settings.typed(character.mass)
        if character.armature:
            job = sample_character(scene, character.armature, mapping, mass=mass, frames=frames)
        else:
            job = sample_thing(scene, character.name, mapping, mass=mass, frames=frames)
        motions.append((yield from counted(job, "sample", len(frames), part=number, parts=len(characters))))
    return motions
