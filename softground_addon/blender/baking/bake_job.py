"""The bake from settings to pressed ground: one generator, driven by a timer, an operator, or the command line.

Everything is read, checked and computed first; the ground is written at the very end. A bake that is closed, fails or
is refused before that has changed nothing.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...core.carving.fineness import fineness
from ...core.composers.pressed_shot import edit_findings
from ...core.composers.relief_plan import asked_of, reach_of_relief, with_shoe_treads
from ...core.composers.responses import response_findings, suggested_speeds, worst_gaps
from ...core.debris.debris import Debris
from ...core.files import report
from ...core.findings import Finding
from ...core.meshing.refinement import refine
from ...core.meshing.region import Region
from ...core.motion.motion import shortest_sole
from ...core.numerics.cell_keys import cells_of
from ...core.record.edits import StepEdit, mesh_soles
from ...core.record.footprints import Footprint
from ...core.record.pressed_ground import PressedGround, Trail
from ...core.record.record import BakeRecord
from ...core.relief.steps import with_broken
from ...core.settings import Acts, BakeSettings
from .. import jobs, settings
from ..carried import marks_object
from ..ground import baked_ground, created_ground, ground_surface, trail_detail
from ..ground.baked_ground import EVENTS
from ..ground.modified_prints import are_undone, undone_prints
from ..jobs import Job, Progress, meanwhile
from ..placement import events_in_world
from ..reading import staleness
from ..reading.shots import Shot, read_shot, settings_of
from ..remedies import worded
from ..response import response_job
from ..reuse import reused
from ..weather import ground_weather as weather
from ..weather.weather_keys import WeatherBefore
from . import bake_report, step_soles
from .bake_checks import check_motion, coverage, coverage_findings, wants_detail
from .publish import Published, at_the_end, publish, sign, until_ready
from .scene_findings import scene_findings
from .shot_prints import GroundPrints, shot_prints


@dataclass(frozen=True)
class BakeResult:
    """Result of a bake, apart from the ground itself.

    Attributes
    ----------
    report : dict
        For JSON (see `core.files.report`).
    """

    report: dict[str, object]
    footprints: tuple[Footprint, ...]


def bake(
    scene: bpy.types.Scene,
    *,
    write: bool = True,
    wanted: BakeSettings | None = None,
    edits: Mapping[str, StepEdit] | None = None,
) -> Job[BakeResult]:
    """Bake the scene's characters into its ground.

    Without a ground in the settings, one is created that fits the walk.

    Parameters
    ----------
    write : bool
        False computes and reports only, and changes nothing.
    wanted : BakeSettings, optional
        What to do, from `shots.settings_of`; by default what the scene's settings say as the bake begins.
    edits : mapping of step id to StepEdit, optional
        What is changed of single steps; by default what was changed of those of the bake that is on the ground.

    Raises
    ------
    InputError
        If something that the user gave cannot be used; names it and the remedy.
    BakeError
        If the result fails a check.
    """
    asked = wanted or settings_of(scene)
    wanted, refused = response_job.without_sinking(scene.view_layers[0], asked)
    started = time.perf_counter()
    shot, said = yield from _read(wanted, write=write)
    surfaces = [part.surface for part in shot.of_each_ground if part.surface]
    edits = step_soles.edits_with_soles(scene.objects, wanted, edits)
    soles = staleness.of_soles(scene.objects, mesh_soles(edits))
    movers = [staleness.of_movers(scene.objects, each) | soles for each in wanted.of_each_ground]
    vertices = [surface.vertices for surface in surfaces]
    shot_hash = yield from meanwhile(
        Progress("sample", 1.0),
        report.hash_inputs.slices(shot.motions, vertices if len(vertices) > 1 else next(iter(vertices), None)),
    )
    sampled = time.perf_counter()

    wanted = with_shoe_treads(wanted, shot.motions)
    frames = wanted.frames[1] - wanted.frames[0] + 1
    prints = yield from shot_prints(wanted, shot, edits)
    footprints = [step for each in prints.grounds for step in each.record.footprints]  # with all of their rims
    simulated = time.perf_counter()

    of_grounds = [_inputs(each, part) for each, part in zip(wanted.of_each_ground, shot.of_each_ground, strict=True)]
    painted = "".join(each.get("painted_crc32", "") + each.get("regions_crc32", "") for each in of_grounds)
    input_hash = report.hash_inputs(wanted.inputs(Acts.WRITING), painted, shot_hash)
    findings = [*prints.findings, *said, *response_job.keyed_responses(wanted)]
    findings += [finding for each in prints.grounds for finding in edit_findings(each.record)]
    of_responses = response_findings(prints.responses)
    build_report = partial(
        report.build,
        inputs=of_grounds[0],
        input_hash=input_hash,
        steps=prints.steps,
        carves=[carve for each in prints.grounds for carve in each.record.laid_carves.values()],
        edits={name: edit for each in prints.grounds for name, edit in each.record.edits.items()},
        **prints.reported,
        worst_gaps=worst_gaps(prints.responses),
        suggested_speed=suggested_speeds(shot.motions, footprints),
        events=prints.events,
        carried_kg=vars(prints.carried) if prints.carried else None,
    )
    steps = [step for step, _ in prints.steps]
    sole_length = shortest_sole(shot.motions)
    layers = (yield from response_job.layers_of(wanted, shot.rigs, prints.responses)) if write else []
    # They are as long as the animation, and from here on only the ground counts.
    shot = replace(shot, motions=(), rigs=())
    published: list[Published | None] = []
    if write and wanted.output != "RESPONSE":
        to_write = [
            replace(
                each,
                record=each.record.with_about({"inputs": inputs, "input_hash": input_hash, EVENTS: each.happened}),
            )
            for each, inputs in zip(prints.grounds, of_grounds, strict=True)
        ]
        del prints
        published, of_writing = yield from _write_all(shot, to_write, sole_length)
        findings += of_writing
    if write and wanted.output != "PRINTS":
        response_job.put_layers(scene.softground, wanted, layers)
    finished = time.perf_counter()
    result = build_report(
        timings={
            "sample": sampled - started,
            "simulate": simulated - sampled,
            "write": finished - simulated,
            "frames_per_second": frames / (finished - started),
        },
        playback_error_m=max((each.error for each in published if each), default=None),
        findings=worded([*findings, *of_responses, *refused]),
    )
    place = settings.find(wanted.ground) if wanted.ground else None
    for table in ("steps", "events"):
        result[table] = events_in_world(result[table], wanted.frame, place, wanted.unit_scale_m)
    summary = bake_report.summary(result)
    for each, made_with, moved in zip(published, asked.of_each_ground, movers, strict=False):
        if each:
            sign(each, made_with, moved, summary=summary, warnings=result["warnings"])
    if published:
        bake_report.note_prints(scene.softground)
    yield Progress("write", 1.0)
    return BakeResult(result, tuple(step.footprint or step.baked for step in steps if not step.is_copy))


def _inputs(made_with: BakeSettings, shot: Shot) -> dict[str, Any]:
    """The settings of a ground for the report, with checksums of what is painted on it and of its regions."""
    inputs, surface = made_with.inputs(), shot.surface
    if surface and surface.factors is not None:
        inputs["painted_crc32"] = f"{zlib.crc32(surface.factors.tobytes()):08x}"
    if surface and surface.kinds is not None:
        inputs["regions_crc32"] = f"{zlib.crc32(surface.kinds.tobytes()):08x}"
    return inputs


def _write_all(
    shot: Shot, prints: list[GroundPrints], sole_length: float
) -> Job[tuple[list[Published | None], list[Finding]]]:
    """Put the prints on their grounds; what the scene shows is changed of all of them at once, in the last step.

    Of several grounds, those without a print and without weather are as without a bake, and None is returned for them.
    """
    published: list[Published | None] = []
    findings: list[Finding] = []
    writing = [
        write_prints(each.made_with, part, each.record, each.debris, sole_length)
        if each.record.footprints or len(prints) == 1 or _has_weather(each.made_with)
        else None
        for each, part in zip(prints, shot.of_each_ground, strict=True)
    ]
    marks = [(each.made_with, each.marks) for each in prints]
    prints.clear()
    for waiting in filter(None, writing):
        yield from until_ready(waiting)
    for made_with, _ in marks:  # or one of them would be written, and another one refused
        if made_with.ground:
            baked_ground.check_writable(settings.resolve(made_with.ground))
    for job, (made_with, its_marks) in zip(writing, marks, strict=True):
        if job is None:  # no step is on it
            assert made_with.ground
            baked_ground.clear(settings.resolve(made_with.ground))
            published.append(None)
            continue
        on_ground, of_ground = (yield from job) if len(writing) == 1 else jobs.run(job)
        kind = its_marks.floors.kind if its_marks else made_with.surface
        marks_object.put(on_ground.ground, its_marks, surface=kind, units=made_with)
        marks_object.follow_weather(on_ground.ground, on_ground.display_mesh)
        published.append(on_ground)
        findings += of_ground
    return published, findings


def _has_weather(made_with: BakeSettings) -> bool:
    """True if weather is on the ground of the settings, which goes with a bake."""
    ground = settings.find(made_with.ground) if made_with.ground else None
    return ground is not None and bool(weather.values_of(ground))


def _read(wanted: BakeSettings, *, write: bool) -> Job[tuple[Shot, list[Finding]]]:
    """A shot, and what the user should know of what it was read from; InputError if nobody moves in what is written."""
    scene = settings.scene_named(wanted.scene)
    moving = bake_report.ground_findings(settings.resolve(wanted.ground) if wanted.ground else None, wanted.frames[0])
    shot = yield from read_shot(wanted)
    if write:
        check_motion(wanted, shot.motions)
    skins = [
        *bake_report.hidden_skins(scene.objects, wanted, shot.motions),
        *bake_report.shapes_left_out(scene.objects, wanted),
    ]
    moving += bake_report.unlisted_findings(scene.softground, wanted)
    return shot, [*moving, *scene_findings(wanted, shot), *skins]


def write_prints(
    wanted: BakeSettings, shot: Shot, record: BakeRecord, debris: Debris | None, sole_length: float
) -> Job[tuple[Published, list[Finding]]]:
    """Put the prints on the ground, all of them in the last step; with what the user should know of that.

    Parameters
    ----------
    shot : Shot
        Of its ground; the motions are not needed.
    record : BakeRecord
        The inputs that it is about are told the name of a ground that is created.
    debris : Debris or None
        What its steps throw.
    sole_length : float
        Of the shortest sole [m].
    """
    weather_before = weather.before(settings.resolve(wanted.ground)) if wanted.ground else WeatherBefore()
    now, footprints, moment = Progress("write", 0.05), record.shaping, at_the_end(wanted)

    asked = asked_of(wanted.inputs(), footprints)

    def trail_of() -> Job[tuple[list[Footprint], Trail]]:
        # The pressed ground takes as much memory as its mesh, and is soon made again.
        pressed = yield from meanwhile(now, PressedGround.at.slices(footprints, **moment))
        yield now
        trail = pressed.trail(trail_detail.FLOOR)
        return footprints, (yield from meanwhile(now, with_broken.slices(trail, footprints, asked)))

    with ExitStack() as drafts:  # what is made and does not get into the scene is taken away
        compared = tuple(map(id, footprints)), moment, asked and asked.plates
        _, trail = yield from reused(now, "trail", compared, trail_of())
        findings: list[Finding] = []
        if shot.surface is None:
            place = yield from _created(drafts, wanted, shot, trail)
            record.about["inputs"]["ground"] = place.display_mesh.name
        else:
            place, findings = yield from _given(drafts, wanted, shot, shot.surface, footprints, trail, sole_length)
        del trail
        publishing = publish(record, debris, place, wanted)
        del place  # it is as large as what is pressed, and not needed to the end
        published = yield from publishing
    weather.renew(published.ground, weather_before, record)
    return published, findings


def _created(drafts: ExitStack, wanted: BakeSettings, shot: Shot, trail: Trail) -> Job[baked_ground.Place]:
    """A draft of a ground that fits the walk, as the place for a bake; fine as well where legs ploughed."""
    now, cell_size, layout, plan = Progress("write", 0.1), wanted.cell_size_m, shot.layout, shot.plan
    assert layout is not None
    assert plan is not None
    cover = yield from meanwhile(now, coverage.slices(layout.vertices, slice(None), trail.printed, cell_size))
    if cover.is_coarse(cell_size):
        plan = plan.with_prints(trail.printed, cell_size)
        layout = yield from meanwhile(now, created_ground.laid_out.slices(wanted, plan))
    name = yield from meanwhile(now, created_ground.created(drafts, wanted, layout))
    yield now
    index = np.flatnonzero(trail.covers(*layout.vertices[:, :2].T))
    return baked_ground.on_created(wanted, name, index, layout.vertices)


CLOSE_UP_FROM = 1.5
"""Grounds whose vertices lie further apart than this many spacings of a close-up get a copy that is finer."""


def _closer(wanted: BakeSettings, trail: Trail) -> tuple[Region, float] | None:
    """Part of a trail that a close-up shows from near, and the distance of vertices there [m]; None without any.

    They are as close as asked for, if there are not too many then.
    """
    spacing, cell_size = wanted.spacing_m, wanted.cell_size_m
    if wanted.relief != "CLOSE_UP":
        return None
    near = trail.moved
    if wanted.camera and not (wanted.frame and wanted.frame.moves):
        near = near[wanted.camera.is_near((cells_of(near) + 0.5) * cell_size, spacing)]
    while spacing < cell_size and len(near) * (cell_size / spacing) ** 2 > wanted.relief_vertices:
        spacing = min(2.0 * spacing, cell_size)
    return (Region(near, cell_size), spacing) if len(near) else None


def _given(
    drafts: ExitStack,
    wanted: BakeSettings,
    shot: Shot,
    surface: ground_surface.GroundSurface,
    footprints: list[Footprint],
    trail: Trail,
    sole_length: float,
) -> Job[tuple[baked_ground.Place, list[Finding]]]:
    """The user's ground, or a draft of it that is fine along the trail, as the place for a bake; what it lacks."""
    assert wanted.ground is not None
    name, vertices = wanted.ground, surface.vertices
    detail, cell_size, unit_scale, frame = wanted.detail, wanted.cell_size_m, wanted.unit_scale_m, wanted.frame
    index = yield from meanwhile(
        Progress("write", 0.1), ground_surface.pressed_vertices.slices(vertices, trail.covers, shot.terrain)
    )
    cover = yield from meanwhile(Progress("write", 0.1), coverage.slices(vertices, index, trail.printed, cell_size))
    ground = settings.resolve(name)
    findings = coverage_findings(ground, cover, detail, cell_size)
    closer = _closer(wanted, trail)
    too_coarse = detail == "AUTO" and closer is not None and cover.spacing > CLOSE_UP_FROM * wanted.spacing_m
    if not too_coarse and not wants_detail(ground, cover, detail, cell_size, sole_length):
        if not are_undone(ground, vertices, index, shot.terrain, unit_scale=unit_scale, detail=detail, frame=frame):
            return baked_ground.on_itself(ground, index, vertices), findings
        findings = [*findings, undone_prints(ground)]
    reading = trail_detail.coarsest.slices(name, surface, unit_scale, cell_size, frame)
    coarse, level = yield from meanwhile(Progress("write", 0.1), reading)
    fine = Region(trail.moved, cell_size), cell_size, closer
    if closer is None and not reach_of_relief(wanted.inputs()):  # cracks of a crust are as fine as cells
        fine = fineness(trail.moved, footprints, cell_size)
    refinement = yield from meanwhile(Progress("write", 0.1), refine.slices(coarse, *fine))
    drafting = trail_detail.draft.slices(drafts, settings.resolve(name), coarse, refinement, level)
    drafted_name = yield from meanwhile(Progress("write", 0.15), drafting)
    vertices = refinement.at_vertices(coarse, coarse.vertices)
    del refinement
    index = yield from meanwhile(
        Progress("write", 0.15), ground_surface.pressed_vertices.slices(vertices, trail.covers, shot.terrain)
    )
    ground, draft = settings.resolve(name), settings.resolve(drafted_name)
    return baked_ground.on_detail(ground, draft, index, vertices), [*findings, *trail_detail.copy_findings(ground)]
