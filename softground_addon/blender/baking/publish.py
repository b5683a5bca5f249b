"""Publishing of a record on a ground, which then plays it; every record passes through here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import bpy

from ...core.carried.marks import Marks, marks_of
from ...core.composers.relief_plan import BARS, FLESH, relief_at, shod_of
from ...core.debris.debris import Debris, shed_volumes
from ...core.debris.thrown_debris import thrown
from ...core.ground.heightfield import Terrain
from ...core.ground.soft_ground import SoftGround
from ...core.loads.estimate import CharacterLoads
from ...core.numerics.arrays import Array
from ...core.numerics.slices import Slices, sliced
from ...core.plants.tramplings import Tramplings, tramplings
from ...core.playback.playback_curves import playback_curves_at
from ...core.playback.vertex_histories import Movements
from ...core.record.footprints import Footprint
from ...core.record.pressed_ground import GroundSample, sample_at
from ...core.record.record import BakeRecord, dump
from ...core.relief.sole_marks import sole_marks
from ...core.relief.steps import StepRelief, all_together, water_at
from ...core.settings import Acts, BakeSettings
from .. import settings
from ..debris import debris_object
from ..ground import baked_ground, ground_mesh, trampled_ground, under_layer
from ..ground.baked_ground import Place
from ..jobs import Job, Progress, meanwhile
from ..plants import trampling_table
from ..playback import display_key, playback
from ..reading import staleness
from ..reuse import reused
from . import waded_steps


@dataclass(frozen=True)
class Published:
    """The ground of a bake, what carries it, and the largest error of the heights that it plays [m]."""

    ground: bpy.types.Object
    display_mesh: bpy.types.Object
    error: float


def at_the_end(made_with: BakeSettings) -> dict[str, float]:
    """The moment of a bake that the mesh itself shows, as `core.record.pressed_ground` takes it."""
    return {
        "frame": float(made_with.frames[1]),
        "frame_rate": made_with.frame_rate,
        "cell_size": made_with.cell_size_m,
        "blur_sigma": made_with.material.blur_sigma,
    }


READY = Progress("write", 0.95)
"""Progress of `publish` where all is worked out, and nothing in the scene was changed yet."""


def until_ready(publishing: Job[Any]) -> Job[None]:
    """Run the job of a ground up to where it is `READY`."""
    for progress in publishing:
        yield progress
        if progress is READY:
            return


@sliced
def with_debris(
    record: BakeRecord, ground: SoftGround, made_with: BakeSettings, loads: Sequence[CharacterLoads] | None = None
) -> Slices[tuple[BakeRecord, Debris | None]]:
    """A record with the debris of its steps booked, if asked for; see `core.debris.thrown_debris.thrown`."""
    if loads is not None and not made_with.debris:
        return replace(record, throws=()), None
    throwing = thrown.slices(
        record,
        ground,
        surface=made_with.surface,
        cell_size=made_with.cell_size_m,
        gravity=made_with.gravity_m_s2,
        loads=loads,
    )
    return (yield from throwing)


@sliced
def marks_of_record(
    record: BakeRecord,
    terrain: Terrain,
    made_with: BakeSettings,
    loads: Sequence[CharacterLoads],
    debris: Debris | None,
    *,
    brought: Mapping[str, tuple[str, float]],
) -> Slices[Marks | None]:
    """The marks on hard floors, if asked for; see `core.carried.marks.marks_of`."""
    if not made_with.marks:
        return None
    is_bare = made_with.tread_pattern == FLESH
    feet = shod_of(made_with.inputs(), record.footprints) if made_with.tread_m > 0 or is_bare else ()
    return (
        yield from marks_of.slices(
            loads,
            record.steps,
            terrain,
            surface=made_with.surface,
            shed=shed_volumes(debris) if debris is not None else {},
            treads={} if is_bare else dict.fromkeys(feet, made_with.tread_m),
            bare=feet if is_bare else (),
            carried=made_with.carried,
            brought=brought,
        )
    )


def publish(record: BakeRecord, debris: Debris | None, place: Place, made_with: BakeSettings) -> Job[Published]:
    """Let a ground play a record, as the artist's edits leave it. Nothing that the user sees changes before the end.

    Parameters
    ----------
    debris : Debris or None
        What its steps throw, from `with_debris`.
    place : Place
        Where it goes.
    """
    footprints = record.shaping
    stored = yield from meanwhile(Progress("write", 0.2), dump.slices(record))
    x, y = place.position[:, 0], place.position[:, 1]
    sample, relief, known = yield from _shown_by(footprints, x, y, made_with)
    if relief:
        sample = sample.with_relief(*all_together(relief, len(x)).T)
    over_time = playback_curves_at.slices(
        footprints,
        x,
        y,
        blur_sigma=made_with.material.blur_sigma,
        frame_rate=made_with.frame_rate,
        time_stretch=made_with.time_stretch,  # nodes count the animation's frames
        relief=relief,
        known=known,
    )
    spans, lines = yield from meanwhile(Progress("write", 0.6), over_time)
    points = yield from meanwhile(Progress("write", 0.9), lines.position.unpacking())
    with ExitStack() as drafts:  # what is made and does not get into the scene is taken away
        table = settings.name_of(drafts.enter_context(playback.keyframe_tables(lines, points)))
        del lines, points  # they are large, and all is in the table
        yield Progress("write", 0.9)
        marks = _tread(footprints, place.position, made_with, relief)
        yield READY
        yield from baked_ground.write(
            place,
            sample,
            spans,
            table,
            stored,
            unit_scale=made_with.unit_scale_m,
            frame=made_with.frame,
            shape_keys=made_with.shape_keys
            and (made_with.dense_shape_keys or not display_key.is_dense(settings.resolve(place.display_mesh))),
            marks=marks,
            water=water_at(relief, len(x)),
            layer=partial(under_layer.layers, made_with=made_with),
        )
        is_draft, error, show = place.is_draft, spans.error, place.publish
        del (
            place,
            x,
            y,
            sample,
            over_time,
            spans,
            marks,
            stored,
            relief,
            known,
        )  # all is in the mesh, of which Blender makes another
        if is_draft:
            yield Progress("write", 0.95)
        # At the end: Give Way may be pressed meanwhile.
        trampled = yield from _trampled([*footprints, *record.on_floors], made_with)
        shown = show()
    ground = settings.resolve(made_with.ground) if made_with.ground else shown
    of_steps = {
        step.index: step.footprint.surface for step in record.steps if step.footprint and step.footprint.surface
    }
    debris_object.put(ground, debris, surface=made_with.surface, units=made_with, of_steps=of_steps)
    trampled_ground.write(ground, trampled, made_with)
    waded_steps.follow(made_with.scene)
    return Published(ground, shown, error)


def _shown_by(
    footprints: Sequence[Footprint], x: Array, y: Array, made_with: BakeSettings
) -> Job[tuple[GroundSample, list[StepRelief], list[Movements]]]:
    """The ground at places in the end, without relief; relief of footprints there, and what is known of movements.

    All is held with the footprints, which are compared by their identity: those of a bake never change.
    """
    shown, sigma, inputs = Progress("write", 0.3), made_with.material.blur_sigma, made_with.inputs()
    moment = at_the_end(made_with)
    compared, strength = (tuple(map(id, footprints)), x, y, sigma), inputs.pop("relief_strength")
    for name in ("ground", "camera"):  # the second bake has that which the first has made
        del inputs[name]

    def relief_of() -> Job[tuple[Sequence[Footprint], list[StepRelief]]]:
        full = {**inputs, "relief_strength": 1.0}
        work = relief_at.slices(footprints, x, y, full, blur_sigma=sigma)
        return footprints, (yield from meanwhile(shown, work))

    def bare() -> Job[tuple[Sequence[Footprint], GroundSample, list[Movements]]]:
        return footprints, (yield from meanwhile(shown, sample_at.slices(footprints, x, y, **moment))), []

    _, sample, known = yield from reused(shown, "movements", (compared, moment), bare())
    if not strength > 0:
        return sample, [], known
    _, relief = yield from reused(shown, "relief", (compared, inputs), relief_of())
    return sample, [step.scaled(strength) for step in relief], known


def _trampled(footprints: Sequence[Footprint], made_with: BakeSettings) -> Job[Tramplings | None]:
    """Trampling by the soles; None if no plants give way."""
    if made_with.ground is None or trampling_table.of(settings.resolve(made_with.ground)) is None:
        return None
    return (yield from meanwhile(Progress("write", 0.95), tramplings.slices(footprints)))


def sign(
    published: Published,
    made_with: BakeSettings,
    hashes: Mapping[str, str],
    *,
    summary: Mapping[str, float],
    warnings: Sequence[str] = (),
    stamp: str | None = None,
) -> None:
    """Note with what was published what the panel says of it, and what it was made from.

    Parameters
    ----------
    hashes : mapping of str to str
        See `staleness.store`; of an edited bake, as `staleness.store_again` takes them.
    summary : mapping
        From `bake_report`.
    stamp : str, optional
        That of the bake that was edited.
    """
    ground_mesh.mesh_of(published.display_mesh)[ground_mesh.SUMMARY] = dict(summary)
    ground_mesh.note_warnings(published.display_mesh, warnings)
    if stamp is None:
        staleness.store(made_with.inputs(Acts.WRITING), published.ground, hashes)
    else:
        staleness.store_again(published.ground, stamp, made_with.painted, hashes)


def _tread(
    footprints: Sequence[Footprint], position: Array, made_with: BakeSettings, relief: Sequence[StepRelief]
) -> Array | None:
    """What `own_data.SOLE` says of places (K, 3): the bars of those who wear shoes; None if nobody
    does, or relief has the tread in the mesh."""
    in_relief = {(step.character, step.sole) for step, its in zip(footprints, relief, strict=False) if its.tread}
    shod = shod_of(made_with.inputs(), footprints) - in_relief
    is_shod = made_with.tread_m > 0 and made_with.tread_pattern in BARS
    if not is_shod or not any((step.character, step.sole) in shod for step in footprints):
        return None
    marks = sole_marks(footprints, footprints[0].cell_size, shod)
    values: Array = marks.sample(*position[:, :2].T)
    return values.T * (1.0, 1.0, made_with.tread_m)
