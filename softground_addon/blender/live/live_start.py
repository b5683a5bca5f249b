"""The beginning of live mode: the shot is read, and a ground made ready for it, before anything is changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...core.composers.ground_plan import plan_ground
from ...core.composers.playhead import Playhead
from ...core.composers.pressed_shot import shares_of
from ...core.errors import InputError
from ...core.loads.cell_limits import check_cell_size
from ...core.loads.estimate import CharacterLoads
from ...core.meshing.refinement import refine
from ...core.motion.motion import shortest_sole
from ...core.numerics.arrays import Array, Indices, Mask
from ...core.numerics.cell_keys import among, cells_at, keys_at
from ...core.numerics.slices import Slices
from ...core.settings import BakeSettings
from .. import settings
from ..baking import bake_report
from ..baking.bake_checks import coverage, wants_detail
from ..ground import baked_ground, created_ground, ground_surface, trail_detail
from ..ground.modified_prints import are_undone
from ..jobs import Job, Progress, meanwhile
from ..reading import analysis
from ..reading.shots import Shot, ground_of, settings_of
from ..translation import translated
from .live_ground import LiveGround
from .live_mode import LiveMode
from .live_part import LivePart, touched

PLACING, PRESSING = Progress("simulate", 0.0), Progress("simulate", 0.5)


def bake_in_the_way(options: Any) -> str:
    """Why live mode cannot start on the grounds of a scene, whose bakes it would replace; empty if it can."""
    baked = next(filter(baked_ground.is_baked, settings.grounds_of(options)), None)
    return translated("There is a bake on '{name}': clear it first", name=baked.name) if baked else ""


def starting(scene: bpy.types.Scene) -> Job[LiveMode]:
    """A scene whose grounds follow its timeline from now on. Nothing that the user sees changes before the last step.

    Raises
    ------
    InputError
        If the scene could not be baked either, or a bake is on one of its grounds.
    """
    if fault := bake_in_the_way(scene.softground):
        raise InputError(fault)
    wanted = settings_of(scene)
    known = yield from analysis.reading(scene)
    check_cell_size(known.loads, wanted.fineness, wanted.longest_bake_s)
    sharing = shares_of(wanted, known.shot.motions, known.loads, known.shot.terrain)
    shares = yield from meanwhile(PLACING, sharing)
    numbers = [number for number, loads in enumerate(shares) if touched(loads)] or [0]
    shots = [replace(part, motions=known.shot.motions) for part in known.shot.of_each_ground]
    with ExitStack() as drafts:  # what is made and does not get into the scene is taken away
        ready = []
        for number in numbers:
            of_ground = wanted.of_each_ground[number], shots[number], shares[number]
            ready.append((yield from _ready(drafts, *of_ground)))
        yield PRESSING
        with analysis.own_changes(scene):
            shown = [_put_on(*each, made_with=wanted.of_each_ground[n]) for n, each in zip(numbers, ready, strict=True)]
            bake_report.note_prints(scene.softground)  # for a file that is saved meanwhile
    if wanted.ground is None:
        wanted, known = replace(wanted, ground=settings.name_of(shown[0])), analysis.read(scene)
    owners = wanted.soft_grounds
    parts = [LivePart(owners[n], *each[1:]) for n, each in zip(numbers, ready, strict=True)]
    return LiveMode(wanted, known, parts)


def _ready(
    drafts: ExitStack, wanted: BakeSettings, shot: Shot, loads: Sequence[CharacterLoads]
) -> Job[tuple[baked_ground.Place, LiveGround, Playhead]]:
    """A ground, pressed up to the frame that is shown, before its scene has it."""
    place = yield from _place(drafts, wanted, shot)
    yield PRESSING
    ground = LiveGround(place, wanted.unit_scale_m, wanted.frame)
    playhead = Playhead(loads, ground_of(wanted, shot), wanted.cell_size_m)
    frame = float(settings.scene_named(wanted.scene).frame_current)
    while playhead.advance(frame):
        yield PRESSING
    windows = playhead.ground.tile_windows()
    yield from meanwhile(PRESSING, ground.updating(playhead, windows, wanted.material.blur_sigma))
    return place, ground, playhead


def _put_on(
    place: baked_ground.Place, ground: LiveGround, playhead: Playhead, *, made_with: BakeSettings
) -> bpy.types.Object:
    """Show a ground in its scene; what shows it."""
    shown = ground.put_on(place)
    ground.show(shown, playhead, (), made_with.material.blur_sigma, made_with.frame_rate)
    return shown


def _place(drafts: ExitStack, wanted: BakeSettings, shot: Shot) -> Job[baked_ground.Place]:
    """The ground that takes the prints, a new one, or a copy that is fine where the characters will step.

    Raises
    ------
    InputError
        If the ground is too coarse and is to stay so.
    """
    cell_size, unit_scale, detail, frame = wanted.cell_size_m, wanted.unit_scale_m, wanted.detail, wanted.frame
    placing = partial(meanwhile, PLACING)

    def is_near(x: Array, y: Array) -> Mask:
        low, high = shot.lower, shot.upper
        return np.asarray((x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1]))

    def pressed(vertices: Array, covers: Callable[[Array, Array], Mask]) -> Slices[Indices]:
        return ground_surface.pressed_vertices.slices(vertices, covers, shot.terrain)

    if wanted.ground is None:
        assert shot.plan is not None
        layout = yield from placing(created_ground.laid_out.slices(wanted, shot.plan))
        name = yield from placing(created_ground.created(drafts, wanted, layout))
        index = yield from placing(pressed(layout.vertices, is_near))
        return baked_ground.on_created(wanted, name, index, layout.vertices)

    name, vertices = wanted.ground, shot.surface.vertices if shot.surface else None
    if vertices is None:  # it was made for the shot
        vertices = ground_surface.rest_vertices(settings.resolve(name), unit_scale, frame)
    plan = shot.plan or (yield from placing(plan_ground.slices(shot.motions)))
    if plan.footfalls is not None:
        footfalls = cells_at(plan.footfalls, cell_size)
        cover = yield from placing(coverage.slices(vertices, slice(None), footfalls, cell_size))
        ground = settings.resolve(name)

        def is_under(x: Array, y: Array) -> Mask:
            return among(footfalls, keys_at(np.stack([x, y], axis=-1), cell_size))

        under = yield from placing(pressed(vertices, is_under))
        if wants_detail(ground, cover, detail, cell_size, shortest_sole(shot.motions)) or are_undone(
            ground, vertices, under, shot.terrain, unit_scale=unit_scale, detail=detail, frame=frame
        ):
            reading = trail_detail.coarsest.slices(name, shot.surface, unit_scale, cell_size, frame)
            coarse, level = yield from placing(reading)
            region = trail_detail.region_around(footfalls, cell_size, created_ground.reach_of(wanted.material))
            refinement = yield from placing(refine.slices(coarse, region, cell_size))
            drafting = trail_detail.draft.slices(drafts, settings.resolve(name), coarse, refinement, level)
            drafted = yield from placing(drafting)
            vertices = refinement.at_vertices(coarse, coarse.vertices)
            index = yield from placing(pressed(vertices, is_near))
            return baked_ground.on_detail(settings.resolve(name), settings.resolve(drafted), index, vertices)
    index = yield from placing(pressed(vertices, is_near))
    return baked_ground.on_itself(settings.resolve(name), index, vertices)
