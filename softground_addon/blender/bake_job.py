"""The bake from settings to pressed ground: one generator, driven by a timer, an operator, or the command line.

Everything is read, checked and computed first; the ground is written at the very end. A bake that is closed, fails or
is refused before that has changed nothing.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core import record, report
from ..core.cell_limits import check_cell_size
from ..core.contacts import detect_contacts
from ..core.deformation import GroundMaterial
from ..core.errors import BakeError, InputError
from ..core.footprints import QUANTUM, Footprint
from ..core.heightfield import FlatTerrain, Terrain
from ..core.histories import histories
from ..core.motion import CharacterMotion
from ..core.pressed_ground import PressedGround
from ..core.simulation import CharacterLoads, estimate_loads, simulate
from ..core.terrain import MeshTerrain
from ..core.variation import PaintedSurface
from . import baked_ground, ground_mesh, painted_ground, response_job, settings, staleness
from .character_setup import mapping_of
from .ground_mesh import GroundPlan, GroundSurface
from .materials import ensure_material
from .properties import SoftGroundCharacter
from .rig_sampling import sample_character

PATIENCE = 0.005
"""Longest wait for a computation that runs aside before its driver gets to do something else [s]."""

Array = NDArray[np.float64]
Result = TypeVar("Result")

STAGES = {"sample": 0.6, "simulate": 0.3, "write": 0.1}
"""Stages in their order, and the share of the whole time that each takes about."""

GROUND_MARGIN = 2.0
"""How far a created ground reaches beyond the feet, in lengths of the longest sole."""

LOW_PERCENTILE = 10.0
"""A sole is on its ground for at least this share of a shot, so that its lowest points tell the ground's height."""

COARSEST_SPACING = 0.25
"""Largest spacing of ground vertices under the prints, in lengths of the sole: coarser meshes cannot show a foot."""

DETAIL_FROM = 4.0
"""Spacing of ground vertices under the prints from which the ground is refined along the trail, in cells."""

RIM_TOLERANCE = 1e-6
"""Largest relative error of the rim's volume that passes (MODEL.md, section 4)."""


@dataclass(frozen=True)
class Progress:
    """How far a bake is.

    Attributes
    ----------
    stage : str
        One of `STAGES`.
    fraction : float
        Of this stage, 0 to 1.
    """

    stage: str
    fraction: float

    @property
    def overall(self) -> float:
        """Of the whole bake, 0 to 1."""
        stages = list(STAGES)
        before = sum(STAGES[stage] for stage in stages[: stages.index(self.stage)])
        return before + STAGES[self.stage] * self.fraction


@dataclass(frozen=True)
class BakeResult:
    """What a bake leaves behind, apart from the ground itself.

    Attributes
    ----------
    report : dict
        For JSON (see `core.report`).
    footprints : tuple of Footprint
    """

    report: dict[str, object]
    footprints: tuple[Footprint, ...]


@dataclass(frozen=True)
class Shot:
    """A shot as it was read from the scene.

    Attributes
    ----------
    motions : tuple of CharacterMotion
        At scene frames.
    plan : GroundPlan
        Area and height of the walk.
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


Job = Generator[Progress, None, Result]


def run(job: Job[Result], show: Callable[[Progress], None] | None = None) -> Result:
    """Drive a job to its end."""
    while True:
        try:
            progress = next(job)
        except StopIteration as finished:
            result: Result = finished.value
            return result
        if show:
            show(progress)


def _aside(stage: str, fraction: float, function: Callable[..., Result], *arguments: object) -> Job[Result]:
    """Compute something that knows nothing of Blender in a thread of its own, so that Blender goes on answering."""
    with ThreadPoolExecutor(1) as thread:
        outcome = thread.submit(function, *arguments)
        while not wait([outcome], timeout=PATIENCE).done:
            yield Progress(stage, fraction)
    return outcome.result()


def bake(scene: bpy.types.Scene, *, write: bool = True) -> Job[BakeResult]:  # noqa: PLR0915  (one stage after the other)
    """Bake the scene's characters into its ground.

    Without a ground in the settings, one is created that fits the walk.

    Parameters
    ----------
    scene : bpy.types.Scene
        Its `softground` settings say what to do.
    write : bool
        False computes and reports only, and changes nothing.

    Raises
    ------
    InputError
        If something that the user gave cannot be used; names it and the remedy.
    BakeError
        If the result fails a check.
    """
    started = time.perf_counter()
    options = scene.softground
    characters = [character for character in options.characters if character.armature]
    material, cell_size = settings.material_of(scene), settings.cell_size_of(scene)
    unit_scale = scene.unit_settings.scale_length
    shot = yield from read_shot(scene)
    motions, plan, surface, terrain = shot.motions, shot.plan, shot.surface, shot.terrain
    ground: bpy.types.Object | None = options.ground
    sampled = time.perf_counter()

    loads, footprints, forces, answers = yield from _press(scene, shot)
    simulated = time.perf_counter()

    yield Progress("write", 0.0)
    layers = (yield from _layers(scene, characters, answers)) if write else []
    write_ground = write and options.output != "RESPONSE"
    at_the_end = partial(
        PressedGround.at,
        footprints,
        frame=float(options.frame_end),
        frame_rate=motions[0].frame_rate,
        cell_size=cell_size,
        blur_sigma=material.blur_sigma,
    )
    pressed = yield from _aside("write", 0.1, at_the_end)
    vertices = surface.vertices if surface else None
    index = np.zeros(0, dtype=np.intp)
    refine = False
    if ground and surface and write_ground:
        index = yield from _aside("write", 0.2, surface.pressed_vertices, pressed, terrain)
        refine = _wants_detail(ground, _spacing(surface.vertices[index], pressed), options.detail, cell_size, loads)
    elif write_ground:
        ground = create_ground(scene, plan)
        vertices = ground_mesh.rest_vertices(ground, unit_scale)
        index = np.flatnonzero(pressed.covers(*vertices[:, :2].T))
    inputs = _inputs(scene, characters, material)
    if surface and surface.factors is not None:
        inputs["painted_crc32"] = f"{zlib.crc32(surface.factors.tobytes()):08x}"
    input_hash = yield from _aside("write", 0.3, report.hash_inputs, inputs, motions, vertices)
    playback_error: float | None = None
    if write_ground and ground and vertices is not None:
        about = {"inputs": inputs, "input_hash": input_hash}
        stored = yield from _aside("write", 0.4, record.dump, footprints, about)
        if refine:
            place = baked_ground.on_detail(ground, pressed, terrain, cell_size, unit_scale)
        else:
            place = baked_ground.on_itself(ground, index, vertices)
        fitting = partial(histories, footprints, *place.position[:, :2].T, blur_sigma=material.blur_sigma)
        over_time = yield from _aside("write", 0.6, fitting)
        baked_ground.write(place, pressed, over_time, stored, unit_scale=unit_scale, shape_keys=options.shape_keys)
        playback_error = over_time.error
    if write and options.output != "PRINTS":
        response_job.put_layers(scene, characters, layers)
    finished = time.perf_counter()
    frames = options.frame_end - options.frame_start + 1
    result = report.build(
        inputs=inputs,
        input_hash=input_hash,
        footprints=footprints,
        offsets_mm=_offsets_mm(loads),
        timings={
            "sample": sampled - started,
            "simulate": simulated - sampled,
            "write": finished - simulated,
            "frames_per_second": frames / (finished - started),
        },
        playback_error_m=playback_error,
        warnings=_warnings(footprints) + response_job.warnings(answers),
        forces=forces if options.keep_forces else None,
        gaps_mm=response_job.gap_table(answers),
        worst_gaps=response_job.worst_gaps(answers),
        suggested_speed=response_job.suggested_speeds(motions, footprints),
    )
    if write_ground and ground:
        ground_mesh.mesh_of(baked_ground.carrier_of(ground))[ground_mesh.SUMMARY] = _summary(result)
        staleness.store(_inputs(scene, characters, material), ground, [one.armature for one in characters])
    yield Progress("write", 1.0)
    return BakeResult(result, tuple(footprints))


def _press(
    scene: bpy.types.Scene, shot: Shot
) -> Job[tuple[list[CharacterLoads], list[Footprint], dict[str, object], list[response_job.Answer]]]:
    """Loads, footprints and forces of a shot, and how its characters answer.

    Where bodies lean, the forces are found anew for the leaning bodies, and the ground is pressed by them.
    """
    characters = [character for character in scene.softground.characters if character.armature]
    asked = response_job.options_of(scene)
    if asked:
        response_job.check_characters(characters)
    standing = response_job.standing_on(shot.motions, shot.terrain, asked)
    loads = yield from estimate_shot(scene, replace(shot, motions=standing))
    footprints, forces = yield from _simulate(scene, shot, loads)
    leaning = response_job.leaning(loads, standing, shot.terrain, footprints, asked)
    if leaning:
        loads = yield from estimate_shot(scene, replace(shot, motions=leaning))
        footprints, forces = yield from _simulate(scene, shot, loads)
    check_volumes(footprints, settings.material_of(scene), shot.surface.factors if shot.surface else None)
    return loads, footprints, forces, response_job.answers_of(loads, shot.motions, shot.terrain, footprints, asked)


def _layers(
    scene: bpy.types.Scene, characters: Sequence[SoftGroundCharacter], answers: Sequence[response_job.Answer]
) -> Job[list[response_job.Layer]]:
    """The keys of each character's layer."""
    job = response_job.layers_of(scene, characters, answers)
    while True:
        try:
            yield Progress("write", next(job))
        except StopIteration as finished:
            layers: list[response_job.Layer] = finished.value
            return layers


def read_shot(scene: bpy.types.Scene) -> Job[Shot]:
    """What the scene's characters do, and the ground that they do it on.

    Raises
    ------
    InputError
        If the settings, a character or the ground cannot be used; names it and the remedy.
    """
    options = scene.softground
    characters = [character for character in options.characters if character.armature]
    check_settings(scene, characters)
    motions = yield from _sample(scene, characters)
    plan = yield from _aside("sample", 1.0, plan_ground, motions)
    if options.ground is None:
        return Shot(tuple(motions), plan, None, FlatTerrain(plan.height))
    painted = painted_ground.names_of(scene)
    surface = ground_mesh.undisturbed_surface(options.ground, scene.unit_settings.scale_length, painted)
    yield Progress("sample", 1.0)
    terrain = yield from _aside("sample", 1.0, surface.terrain, np.stack([plan.lower, plan.upper]))
    return Shot(tuple(motions), plan, surface, terrain)


def estimate_shot(scene: bpy.types.Scene, shot: Shot) -> Job[list[CharacterLoads]]:
    """The loads of all characters of a shot, with the masses and force models that the scene has now.

    Raises
    ------
    InputError
        If nobody touches the ground.
    """
    material = settings.material_of(scene)
    characters = [character for character in scene.softground.characters if character.armature]
    loads = []
    for motion, character in zip(shot.motions, characters, strict=True):
        moved = replace(motion, mass=settings.typed(character.mass))
        estimate = partial(estimate_loads, force_model=character.force_model, material=material)
        loads.append((yield from _aside("sample", 1.0, estimate, moved, shot.terrain)))
    _check_contacts(loads, shot.terrain, scene.softground.ground)
    return loads


def create_ground(scene: bpy.types.Scene, plan: GroundPlan) -> bpy.types.Object:
    """A new flat ground with the material of the scene's preset, set as the scene's ground."""
    ground = ground_mesh.create_grid(scene, plan, settings.cell_size_of(scene), scene.unit_settings.scale_length)
    ground_mesh.mesh_of(ground).materials.append(ensure_material(scene.softground.material.surface))
    scene.softground.ground = ground
    for layer in scene.view_layers:
        layer.update()
    return ground


def fit_ground(scene: bpy.types.Scene) -> Job[GroundPlan]:
    """The flat ground that fits the walk of the scene's characters.

    Raises
    ------
    InputError
        If the characters cannot be read.
    """
    characters = [character for character in scene.softground.characters if character.armature]
    check_settings(scene, characters)
    motions = yield from _sample(scene, characters)
    return plan_ground(motions)


def plan_ground(motions: Sequence[CharacterMotion]) -> GroundPlan:
    """The flat ground under the lowest positions of the soles, with a margin around all of their paths."""
    paths = [sole.landmark_positions() for motion in motions for sole in motion.soles]
    lower = np.min([path[..., :2].min(axis=(0, 1)) for path in paths], axis=0)
    upper = np.max([path[..., :2].max(axis=(0, 1)) for path in paths], axis=0)
    margin = GROUND_MARGIN * max(_length(sole.sole.outline) for motion in motions for sole in motion.soles)
    low = float(np.median([np.percentile(path[..., 2].min(axis=1), LOW_PERCENTILE) for path in paths]))
    floats = [detect_contacts(motion, FlatTerrain(low)).offset for motion in motions]
    return GroundPlan(lower - margin, upper + margin, low + float(np.median(np.concatenate(floats))))


def check_settings(scene: bpy.types.Scene, characters: Sequence[SoftGroundCharacter]) -> None:
    """Raise InputError, naming the remedy, if the scene's settings cannot be baked."""
    options = scene.softground
    if not characters:
        raise InputError("No character is set up: select an animated armature and press Add Character.")
    if options.frame_end <= options.frame_start:
        raise InputError(
            f"The frame range {options.frame_start}-{options.frame_end} is empty: set End after Start in the Bake "
            "panel."
        )
    if options.ground is not None:
        ground_mesh.check_usable(options.ground)


def _sample(scene: bpy.types.Scene, characters: Sequence[SoftGroundCharacter]) -> Job[list[CharacterMotion]]:
    """The motion of each character."""
    motions = []
    options = scene.softground
    count = options.frame_end - options.frame_start + 1
    for number, character in enumerate(characters):
        job = sample_character(
            scene,
            character.armature,
            mapping_of(character),
            frame_start=options.frame_start,
            frame_end=options.frame_end,
            mass=settings.typed(character.mass),
        )
        while True:
            try:
                read = next(job)
            except StopIteration as finished:
                motions.append(finished.value)
                break
            yield Progress("sample", (number + read / count) / len(characters))
    return motions


def _simulate(
    scene: bpy.types.Scene, shot: Shot, loads: Sequence[CharacterLoads]
) -> Job[tuple[list[Footprint], dict[str, object]]]:
    """The footprints in the order of their first contact, and the force on each sole at each frame [N]."""
    footprints: list[Footprint] = []
    check_cell_size(loads, settings.cell_size_of(scene))
    frames: list[float] = []
    forces: list[tuple[Array, ...]] = []
    count = max(len(character.motion.frames) for character in loads)
    results = simulate(
        loads,
        shot.terrain,
        settings.material_of(scene),
        settings.cell_size_of(scene),
        pressure=scene.softground.pressure,
        variation=shot.variation,
    )
    for result in results:
        footprints += result.footprints
        frames.append(result.frame)
        forces.append(result.forces)
        yield Progress("simulate", min(1.0, len(frames) * _steps_per_frame(loads) / count))
    footprints.sort(
        key=lambda footprint: (footprint.start_frame, footprint.end_frame, footprint.character, footprint.sole)
    )
    return footprints, _force_table(loads, frames, forces)


def _steps_per_frame(loads: Sequence[CharacterLoads]) -> float:
    frames = loads[0].motion.frames
    return 1.0 / float(frames[1] - frames[0])


def _force_table(
    loads: Sequence[CharacterLoads], frames: list[float], forces: list[tuple[Array, ...]]
) -> dict[str, object]:
    characters: dict[str, dict[str, list[list[float]]]] = {}
    for number, character in enumerate(loads):
        of_character = np.array([at_frame[number] for at_frame in forces])
        names = [sole.sole.name for sole in character.motion.soles]
        characters[character.motion.name] = {
            name: np.round(of_character[:, sole], 3).tolist() for sole, name in enumerate(names)
        }
    return {"frames": frames, "characters": characters}


def _check_contacts(loads: Sequence[CharacterLoads], terrain: Terrain, ground: bpy.types.Object | None) -> None:
    """Raise InputError if nothing touches the ground, or where the ground has two layers under a foot."""
    place = np.concatenate(
        [
            sole.landmark_positions()[character.contacts.touching[:, number]].reshape(-1, 3)
            for character in loads
            for number, sole in enumerate(character.motion.soles)
        ]
    )
    name = f"'{ground.name}'" if ground else "the ground"
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


def _spacing(vertices: Array, pressed: PressedGround) -> float:
    """Distance between the ground's vertices under the prints [m], infinite where there are none."""
    compression = pressed.raw.sample(*vertices[:, :2].T)[0]
    cells = sum(int((tile[0] > 0).sum()) for tile in pressed.raw.tiles.values())
    under_prints = cells * pressed.raw.cell_size**2
    return float(np.sqrt(under_prints / max(1e-9, float((compression > 0).sum()))))


def _wants_detail(
    ground: bpy.types.Object, spacing: float, detail: str, cell_size: float, loads: Sequence[CharacterLoads]
) -> bool:
    """Whether the ground is to be refined along the trail; InputError if it must be and may not."""
    if detail == "ALWAYS" or (detail == "AUTO" and spacing > DETAIL_FROM * cell_size):
        return True
    length = min(_length(sole.sole.outline) for character in loads for sole in character.motion.soles)
    if spacing > COARSEST_SPACING * length:
        raise InputError(
            f"Ground '{ground.name}' is too coarse: its vertices are more than {COARSEST_SPACING * length * 100:.0f} "
            f"cm apart under soles of {length * 100:.0f} cm. Set Detail to Automatic in the Ground panel, or Subdivide "
            "the ground."
        )
    return False


def check_volumes(footprints: Sequence[Footprint], material: GroundMaterial, factors: Array | None = None) -> None:
    """Raise BakeError if a footprint breaks an invariant of MODEL.md, section 4.

    Parameters
    ----------
    footprints : sequence of Footprint
    material : GroundMaterial
    factors : (V, 3) float array, optional
        What is painted on the ground: there, the rim's share lies between the least and the largest painted.
    """
    depth, rim = np.ones((2, 2)) if factors is None else (np.append(column, 1.0) for column in factors[:, 1:].T)
    least, most = np.clip(2.0 * material.poisson_ratio * np.array([rim.min(), rim.max()]), 0.0, 1.0)
    for footprint in footprints:
        raised = footprint.rim_m3 + footprint.unplaced_rim_m3
        rounding = QUANTUM * footprint.cell_size**2 * (len(footprint.rim.cells) + len(footprint.compression.cells))
        low, high = least * footprint.compressed_m3, most * footprint.compressed_m3
        if not low * (1 - RIM_TOLERANCE) - rounding <= raised <= high * (1 + RIM_TOLERANCE) + rounding:
            raise BakeError(
                f"The print of {footprint.sole} at frame {footprint.start_frame:.0f} raised {raised:.6g} m³ where "
                f"{high:.6g} m³ were displaced; nothing was written. Please report this shot."
            )
        if footprint.max_depth_m > material.layer_depth * depth.max() * (1 + 1e-9):
            raise BakeError(
                f"The print of {footprint.sole} at frame {footprint.start_frame:.0f} is deeper than the layer; nothing "
                "was written. Please report this shot."
            )


def _warnings(footprints: Sequence[Footprint]) -> list[str]:
    unplaced = sum(footprint.unplaced_rim_m3 for footprint in footprints)
    if unplaced <= 0:
        return []
    return [f"{unplaced * 1e6:.0f} cm³ of displaced ground found no room at the edge of the ground: make it larger."]


def _summary(result: dict[str, Any]) -> dict[str, float]:
    """What the panel shows of a bake."""
    totals, timings = result["totals"], result["timings"]
    seconds = sum(timings[stage] for stage in STAGES)
    return {key: totals[key] for key in ("steps", "max_depth_m", "peak_force_n")} | {"seconds": seconds}


def _offsets_mm(loads: Sequence[CharacterLoads]) -> dict[str, dict[str, float]]:
    return {
        character.motion.name: {
            sole.sole.name: round(float(offset) * 1e3, 3)
            for sole, offset in zip(character.motion.soles, character.contacts.offset, strict=True)
        }
        for character in loads
    }


def stale_reasons(scene: bpy.types.Scene) -> tuple[str, ...]:
    """What has changed since the bake on the scene's ground, for the user to read; nothing if it is up to date."""
    options = scene.softground
    if options.ground is None:
        return ()
    characters = [character for character in options.characters if character.armature]
    inputs = _inputs(scene, characters, settings.material_of(scene))
    return staleness.reasons(inputs, options.ground, [character.armature for character in characters])


def _inputs(
    scene: bpy.types.Scene, characters: Sequence[SoftGroundCharacter], material: GroundMaterial
) -> dict[str, object]:
    options = scene.softground
    return {
        "file": bpy.data.filepath,
        "scene": scene.name,
        "ground": options.ground.name if options.ground else None,
        "characters": [
            {
                "armature": character.armature.name,
                "mass_kg": settings.typed(character.mass),
                "force_model": character.force_model,
                "joints": {joint: list(place) for joint, place in mapping_of(character).joints.items()},
                "soles": [asdict(source) for source in mapping_of(character).soles],
            }
            for character in characters
        ],
        "preset": options.material.preset,
        "material": asdict(material),
        "pressure": options.pressure,
        "painted": [options.painted.stiffness, options.painted.layer_depth, options.painted.rim],
        "cell_size_m": settings.cell_size_of(scene),
        "frames": [options.frame_start, options.frame_end],
        "frame_rate": scene.render.fps / scene.render.fps_base,
        "response": asdict(asked) if (asked := response_job.options_of(scene)) else None,
    }


def _length(outline: Array) -> float:
    return float(np.ptp(outline[:, 0]))
