"""The bake from settings to pressed ground: one generator, driven by a timer, an operator, or the command line.

Everything is read, checked and computed first; the ground is written at the very end. A bake that is closed, fails or
is refused before that has changed nothing.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core import record, report
from ..core.cell_limits import check_cell_size
from ..core.footprints import Footprint
from ..core.histories import histories
from ..core.pressed_ground import PressedGround
from ..core.simulation import CharacterLoads, simulate
from . import bake_report, baked_ground, ground_mesh, response_job, settings, staleness
from .bake_checks import check_volumes, vertex_spacing, wants_detail
from .character_setup import characters_of, movers_of
from .ground_mesh import GroundPlan
from .jobs import Job, Progress, aside
from .materials import ensure_material
from .properties import SoftGroundCharacter
from .shots import Shot, check_settings, estimate_shot, plan_ground, read_shot, sample_characters

Array = NDArray[np.float64]


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


def bake(  # noqa: PLR0915  (one stage after the other)
    scene: bpy.types.Scene, *, write: bool = True, response_only: bool = False
) -> Job[BakeResult]:
    """Bake the scene's characters into its ground.

    Without a ground in the settings, one is created that fits the walk.

    Parameters
    ----------
    scene : bpy.types.Scene
        Its `softground` settings say what to do.
    write : bool
        False computes and reports only, and changes nothing.
    response_only : bool
        Leave the ground as it is, whatever the settings say.

    Raises
    ------
    InputError
        If something that the user gave cannot be used; names it and the remedy.
    BakeError
        If the result fails a check.
    """
    started = time.perf_counter()
    options = scene.softground
    characters = characters_of(scene)
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
    write_ground = write and not response_only and options.output != "RESPONSE"
    at_the_end = partial(
        PressedGround.at,
        footprints,
        frame=float(options.frame_end),
        frame_rate=motions[0].frame_rate,
        cell_size=cell_size,
        blur_sigma=material.blur_sigma,
    )
    pressed = yield from aside("write", 0.1, at_the_end)
    vertices = surface.vertices if surface else None
    index = np.zeros(0, dtype=np.intp)
    refine = False
    if ground and surface and write_ground:
        index = yield from aside("write", 0.2, surface.pressed_vertices, pressed, terrain)
        refine = wants_detail(
            ground, vertex_spacing(surface.vertices[index], pressed), options.detail, cell_size, loads
        )
    elif write_ground:
        ground = create_ground(scene, plan)
        vertices = ground_mesh.rest_vertices(ground, unit_scale)
        index = np.flatnonzero(pressed.covers(*vertices[:, :2].T))
    inputs = bake_report.inputs_of(scene)
    if surface and surface.factors is not None:
        inputs["painted_crc32"] = f"{zlib.crc32(surface.factors.tobytes()):08x}"
    created = surface is None and write_ground
    input_hash = yield from aside("write", 0.3, report.hash_inputs, inputs, motions, vertices, written=created)
    playback_error: float | None = None
    if write_ground and ground and vertices is not None:
        about = {"inputs": inputs, "input_hash": input_hash}
        stored = yield from aside("write", 0.4, record.dump, footprints, about, written=created)
        fitting = partial(histories, footprints, blur_sigma=material.blur_sigma)
        if refine:
            place = baked_ground.on_detail(ground, pressed, terrain, cell_size, unit_scale)
            over_time = fitting(*place.position[:, :2].T)
        else:
            over_time = yield from aside("write", 0.6, fitting, *vertices[index, :2].T, written=created)
            place = baked_ground.on_itself(ground, index, vertices)
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
        offsets_mm=bake_report.offsets_mm(loads),
        timings={
            "sample": sampled - started,
            "simulate": simulated - sampled,
            "write": finished - simulated,
            "frames_per_second": frames / (finished - started),
        },
        playback_error_m=playback_error,
        warnings=bake_report.warnings(footprints, loads, cell_size) + response_job.warnings(answers),
        forces=forces if options.keep_forces else None,
        gaps_mm=response_job.gap_table(answers) or response_job.gaps_left(loads, motions, terrain, footprints),
        worst_gaps=response_job.worst_gaps(answers),
        suggested_speed=response_job.suggested_speeds(motions, footprints),
    )
    if write_ground and ground:
        ground_mesh.mesh_of(baked_ground.carrier_of(ground))[ground_mesh.SUMMARY] = bake_report.summary(result)
        staleness.store(bake_report.inputs_of(scene), ground, movers_of(scene))
    yield Progress("write", 1.0)
    return BakeResult(result, tuple(footprints))


def _press(
    scene: bpy.types.Scene, shot: Shot
) -> Job[tuple[list[CharacterLoads], list[Footprint], dict[str, object], list[response_job.Answer]]]:
    """Loads, footprints and forces of a shot, and how its characters answer.

    Where bodies lean, the forces are found anew for the leaning bodies, and the ground is pressed by them, until the
    lean that the pressed ground gives is the lean that pressed it.
    """
    characters = characters_of(scene)
    asked = response_job.options_of(scene)
    if asked:
        response_job.check_characters(characters)
    standing = response_job.standing_on(shot.motions, shot.terrain, asked)
    loads = yield from estimate_shot(scene, replace(shot, motions=standing))
    footprints, forces = yield from _simulate(scene, shot, loads)
    leaning = None
    for _ in range(response_job.LEAN_PASSES):
        before = leaning
        leaning = response_job.leaning(loads, standing, shot.terrain, footprints, asked)
        if not response_job.leans_anew(leaning, before):
            break
        loads = yield from estimate_shot(scene, replace(shot, motions=leaning.motions))
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
    characters = characters_of(scene)
    check_settings(scene, characters)
    motions = yield from sample_characters(scene, characters)
    return plan_ground(motions)


def _simulate(
    scene: bpy.types.Scene, shot: Shot, loads: Sequence[CharacterLoads]
) -> Job[tuple[list[Footprint], dict[str, object]]]:
    """The footprints in the order of their first contact, and the force on each sole at each frame [N]."""
    footprints: list[Footprint] = []
    check_cell_size(loads, settings.cell_size_of(scene))
    frames: list[float] = []
    forces: list[tuple[Array, ...]] = []
    count = max(len(motion.frames) for motion in shot.motions)
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
        yield Progress("simulate", len(frames) / count)
    footprints.sort(
        key=lambda footprint: (footprint.start_frame, footprint.end_frame, footprint.character, footprint.sole)
    )
    return footprints, bake_report.force_table(loads, frames, forces)
