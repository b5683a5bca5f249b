"""A shot as it is read from the scene: what its characters do, and the ground that they do it on."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.carving.responded_skin import WornSkin
from ...core.composers.ground_plan import GroundPlan, extent, plan_ground
from ...core.composers.relief_plan import IMAGE
from ...core.composers.shot_loads import loads_of_shot
from ...core.errors import InputError
from ...core.findings import Finding
from ...core.ground.hard_ground import soft_ground
from ...core.ground.heightfield import FlatTerrain, Terrain
from ...core.ground.regions import MOST as MOST_KINDS
from ...core.ground.regions import Regions
from ...core.ground.soft_ground import SoftGround
from ...core.ground.terrain import MeshTerrain, plane_of
from ...core.ground.variation import PaintedSurface
from ...core.legs.grounding import with_legs
from ...core.loads.cell_limits import check_frames
from ...core.loads.estimate import CharacterLoads
from ...core.motion.ground_frame import GroundFrame
from ...core.motion.motion import CharacterMotion
from ...core.numerics.arrays import Array
from ...core.rig.mapping import RigMapping
from ...core.settings import BakeSettings
from ...core.weather.felt_weather import weathering_of
from .. import ground_slots, settings, tread_images
from ..animation_layer.constraint_layer import LayerKind
from ..characters.import_fixes import extent_of
from ..ground import created_ground, ground_checks, ground_surface, painted_ground
from ..ground.ground_surface import GroundSurface
from ..jobs import Job, Progress, counted, meanwhile
from ..properties import setting_paths
from ..response.character_keys import ReadRig, controls_of, mapping_with_legs
from ..reuse import reused
from ..rigs.rig_mapping import require_armature
from ..sampling.body_sampling import sample_body
from ..sampling.prop_extraction import check_props
from ..sampling.rig_checks import check_rig
from ..sampling.rig_sampling import RigPoses, sample_character, sample_prop
from ..sampling.take import Take
from ..weather import ground_weather as weather
from . import ground_frames, hard_ground


@dataclass(frozen=True)
class Shot:
    """A shot as it was read from the scene.

    Attributes
    ----------
    motions : tuple of CharacterMotion
        At scene frames.
    lower, upper : (2,) float arrays
        Around all paths of the soles [m].
    plan : GroundPlan or None
        The ground that fits the walk, where the scene has none.
    layout : Layout or None
        That of it.
    surface : GroundSurface or None
        The scene's ground, if it has one.
    terrain : Terrain
        The undisturbed ground, with the hard objects on it.
    rigs : tuple of ReadRig
        Of the characters that have one, where they are to respond.
    findings : tuple of Finding
        What the user should know of how it was read.
    frame : GroundFrame or None
        That all of this is in, instead of the world.
    parts : tuple of Shot
        Where there are several grounds, each of them by itself, without motions: the others stand on it like hard
        objects. Then `terrain` is all of them, and `surface` that of the first.
    """

    motions: tuple[CharacterMotion, ...]
    lower: Array
    upper: Array
    plan: GroundPlan | None
    surface: GroundSurface | None
    terrain: Terrain
    rigs: tuple[ReadRig, ...] = ()
    findings: tuple[Finding, ...] = ()
    frame: GroundFrame | None = None
    parts: tuple[Shot, ...] = ()
    layout: created_ground.Layout | None = None

    @property
    def of_each_ground(self) -> tuple[Shot, ...]:
        """Its grounds, one by one."""
        return self.parts or (self,)

    @property
    def responding(self) -> tuple[CharacterMotion, ...]:
        """The motions with all legs that can respond."""
        legs = {rig.name: rig.legs for rig in self.rigs}
        return tuple(with_legs(each, legs.get(each.name, {})) for each in self.motions)

    @property
    def skins(self) -> dict[str, WornSkin]:
        """The skins of the characters that may carve, by their names."""
        return {rig.poses.skin.character: rig.poses.skin for rig in self.rigs if rig.poses.skin}

    @property
    def variation(self) -> PaintedSurface | None:
        """Variation of the ground from place to place, if it is painted."""
        painted, ground = self.surface is not None and self.surface.factors is not None, soft_ground(self.terrain)
        return PaintedSurface(ground) if painted and isinstance(ground, MeshTerrain) else None

    def regions(self, wanted: BakeSettings) -> Regions | None:
        """Regions of the ground with other materials."""
        ground = soft_ground(self.terrain)
        if self.surface is None or self.surface.kinds is None or not isinstance(ground, MeshTerrain):
            return None
        return Regions(wanted.kinds[0], ground)


def settings_of(scene: bpy.types.Scene, *, grounded: bool = False) -> BakeSettings:
    """The scene's settings as they are now (`settings.snapshot`), if they can be baked.

    Raises
    ------
    InputError
        If not; names what is wrong and the remedy.
    """
    settings.forget_deleted_ground(scene.softground)
    setting_paths.check_stored(scene.softground)
    for character in scene.softground.characters:
        rig = character.armature or character.body
        if rig is None and character.soles and not any(s.object or s.bone for s in character.soles):
            raise InputError(
                f"The object of '{character.name}' was deleted: choose another one in Contacts, or remove "
                f"'{character.name}' from the characters."
            )
    tread_images.forget()
    wanted = weather.felt(settings.snapshot(scene, grounded=grounded))
    if wanted.tread_pattern == IMAGE and wanted.relief_look and wanted.tread_m > 0:
        tread_images.check(scene.softground.tread_image)
    if not wanted.characters:
        raise InputError(
            "No character is set up: select an animated armature, or objects that fall or roll, and press Add "
            "Character."
        )
    ground = settings.resolve(wanted.ground) if wanted.ground else None
    for printing in wanted.characters:
        if printing.armature:
            require_armature(settings.resolve(printing.armature))
        check_props(scene.objects, printing.name, printing.soles, ground)
    start, end = wanted.frames
    if end <= start:
        raise InputError(f"The frame range {start}-{end} is empty: set End after Start in the Bake panel.")
    for of_ground in wanted.of_each_ground if ground else ():
        _check_ground(of_ground)
    beside = [(name, "in Hard Ground") for name in wanted.hard_grounds]
    for name, where in [*beside, *((name, "beside the ground") for name in wanted.soft_grounds[1:])]:
        if fault := ground_checks.hard_fault(settings.resolve(name), ground, where):
            raise InputError(fault)
    return ground_frames.framed(wanted)


def _check_ground(wanted: BakeSettings) -> None:
    """Raise InputError if the ground of the settings cannot be used."""
    assert wanted.ground
    ground = settings.resolve(wanted.ground)
    ground_checks.check_usable(ground)
    ground_slots.check(ground)
    if len(wanted.kinds[0]) > MOST_KINDS:
        raise InputError(
            f"The materials of ground '{ground.name}' name more than {MOST_KINDS - 1} presets: give some of them "
            "the same one."
        )


def read_shot(wanted: BakeSettings, below: LayerKind = LayerKind.RESPONSE) -> Job[Shot]:
    """Motions of the characters of a scene below a response layer, and their ground.

    Raises
    ------
    InputError
        If a character or the ground cannot be used; names it and the remedy.
    """
    take, now, with_hard = _take(wanted, below), Progress("sample", 1.0), hard_ground.with_hard_objects.slices
    motions, rigs = yield from sample_characters(wanted, take)
    lower, upper = extent(motions)
    if wanted.ground is None:
        plan = yield from meanwhile(now, plan_ground.slices(motions))
        layout = yield from meanwhile(now, created_ground.laid_out.slices(wanted, plan))
        plane = layout.plane if isinstance(plan.terrain, FlatTerrain) else plan.terrain
        terrain, _, missing = yield from meanwhile(now, with_hard(wanted, motions, [plane], np.stack([lower, upper])))
        made = Shot(tuple(motions), lower, upper, plan, None, terrain, rigs, (*take.findings, *missing), wanted.frame)
        return replace(made, layout=layout)
    yield now
    # What rests without a sole is seen on the ground too.
    skins = [motion.skin.position[..., :2].reshape(-1, 2) for motion in motions if motion.skin is not None]
    places = np.concatenate([[lower, upper], *skins])
    bounds = np.stack([places.min(axis=0), places.max(axis=0)])
    surfaces, soft, hard_parts = [], [], []
    for of_ground in wanted.of_each_ground:
        surface, terrain, hard = yield from _looked_at(of_ground, bounds)
        surfaces.append(surface)
        soft.append(terrain)
        hard_parts += hard
    terrain, apart, missing = yield from meanwhile(now, with_hard(wanted, motions, soft, bounds, hard_parts))
    shot = Shot(
        tuple(motions), lower, upper, None, surfaces[0], terrain, rigs, (*take.findings, *missing), wanted.frame
    )
    alone = replace(shot, motions=(), rigs=(), findings=())
    parts = [
        replace(alone, surface=surface, terrain=terrain, frame=of_ground.frame)
        for surface, terrain, of_ground in zip(surfaces, apart, wanted.of_each_ground, strict=False)
    ]
    return replace(shot, parts=tuple(parts))


def _looked_at(wanted: BakeSettings, bounds: Array) -> Job[tuple[GroundSurface, Terrain, list[MeshTerrain]]]:
    """The surface of the ground of the settings, and what of it is soft and is hard within bounds in the plane [m]."""
    assert wanted.ground
    now, ground = Progress("sample", 1.0), settings.resolve(wanted.ground)
    painted = painted_ground.names_of(ground, wanted.painted)
    of_slots = wanted.kinds[1]
    looking = ground_surface.undisturbed_surface.slices(ground, wanted.unit_scale_m, painted, of_slots, wanted.frame)
    surface = yield from meanwhile(now, looking)
    if not wanted.grounds and surface.factors is None and surface.kinds is None:
        plane = yield from meanwhile(now, plane_of.slices(surface.surface_vertices, surface.triangles))
        if plane and (bounds[1] >= plane.low).all() and (bounds[0] <= plane.high).all():
            # As of a ground that was made, whose prints the next bake then takes over.
            return surface, plane, []
    binning = ground_surface.terrain_of.slices(surface, bounds, is_one_of_several=bool(wanted.grounds))
    name = surface.name if wanted.grounds else ""
    soft = yield from reused(now, "terrain", (surface, bounds), meanwhile(now, binning), of=name)
    hard_parts = yield from meanwhile(now, ground_surface.hard_part.slices(surface, bounds))
    return surface, soft, hard_parts


def ground_of(wanted: BakeSettings, shot: Shot) -> SoftGround:
    """The ground of a shot, with the material and the spread of pressure that are wanted."""
    regions = shot.regions(wanted)
    return SoftGround(
        shot.terrain,
        wanted.material,
        wanted.pressure,
        shot.variation,
        weathering_of(wanted.weather, wanted.material.layer_depth, regions),
        wanted.gravity_m_s2,
        regions,
    )


def estimate_shot(wanted: BakeSettings, shot: Shot) -> Job[list[CharacterLoads]]:
    """The loads of all characters of a shot (`loads_of_shot`)."""
    work = loads_of_shot.slices(wanted, shot.motions, shot.terrain)
    return (yield from meanwhile(Progress("sample", 1.0), work))


def fit_ground(wanted: BakeSettings) -> Job[GroundPlan]:
    """The ground that fits the walk of the scene's characters.

    Raises
    ------
    InputError
        If the characters cannot be read.
    """
    motions, _ = yield from sample_characters(replace(wanted, response=None), _take(wanted))
    return (yield from meanwhile(Progress("sample", 1.0), plan_ground.slices(motions)))


def _take(wanted: BakeSettings, below: LayerKind = LayerKind.RESPONSE) -> Take:
    """The frames of a bake, read below a layer."""
    # What was read is compared later, and is not all settings.
    return Take(wanted.scene, range(wanted.frames[0], wanted.frames[1] + 1), wanted.units, below)


def sample_characters(wanted: BakeSettings, take: Take) -> Job[tuple[list[CharacterMotion], tuple[ReadRig, ...]]]:
    """The motion of each character; where they are to respond, also how the bones stand that this is keyed on."""
    check_frames(*wanted.frames, len(wanted.characters), wanted.longest_bake_s)
    motions, rigs = [], []
    for number, character in enumerate(wanted.characters):
        mapping, poses = RigMapping(character.joints, character.soles, "settings"), None
        job: Generator[int | None, None, CharacterMotion]
        if character.armature:
            armature = settings.resolve(character.armature)
            if wanted.response:
                check_rig(take.scene.objects, armature, mapping, character.mass_kg)
                with_all = mapping_with_legs(character)
                legs = {joint: bone for joint, (bone, _) in with_all.joints.items() if joint not in mapping.joints}
                controls = controls_of(take.scene.view_layers[0], armature, with_all)
                poses = RigPoses([*(control.bone for control in controls), *legs.values()], with_skin=wanted.carves)
            extent = extent_of(wanted.unit_scale_m, armature)
            grown = extent / character.size_m if character.size_m else 1.0
            skin_mass = character.skin_mass_kg * grown**3
            job = sample_character(take, armature, mapping, mass=character.mass_kg, skin_mass=skin_mass, poses=poses)
        elif character.body:
            mass, skin_mass = character.mass_kg, character.skin_mass_kg
            job = sample_body(take, character.body, mapping, mass=mass, skin_mass=skin_mass)
        else:
            job = sample_prop(take, character.name, mapping, mass=character.mass_kg)
        motion = yield from counted(job, "sample", len(take.frames), part=number, parts=len(wanted.characters))
        motions.append(replace(motion, ride=wanted.frame.ride) if wanted.frame else motion)
        if poses:
            ends = {joint: (poses.world @ poses.matrices[bone])[:, :3, 3] for joint, bone in legs.items()}
            metres = {joint: wanted.unit_scale_m * end for joint, end in ends.items()}
            rigs.append(ReadRig(motion.name, controls, poses, metres))
    return motions, tuple(rigs)
