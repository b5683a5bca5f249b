"""From a record and a place to the ground that plays it: the only code that does this, whatever the record is from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.composers.relief_plan import BARS, relief_at, shod_of
from ...core.playback.playback_curves import playback_curves_at
from ...core.record import record
from ...core.record.footprints import Footprint
from ...core.record.pressed_ground import sample_at
from ...core.record.sole_marks import sole_marks
from ...core.relief.steps import StepRelief, all_together, water_at
from ...core.settings import BakeSettings
from .. import settings
from ..ground import baked_ground, display_key, ground_mesh, playback
from ..ground.baked_ground import Place
from ..jobs import Job, Progress, meanwhile
from ..reading import staleness

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Published:
    """What carries a bake, and the largest error of the heights that it plays [m]."""

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


def publish(left: record.BakeRecord, place: Place, made_with: BakeSettings) -> Job[Published]:
    """Let a ground play a record, as the artist's edits leave it. Nothing that the user sees changes before the end.

    Parameters
    ----------
    left : BakeRecord
    place : Place
        Where it goes.
    made_with : BakeSettings
    """
    footprints = left.edited
    stored = yield from meanwhile(Progress("write", 0.5), record.dump.slices(left))
    x, y = place.position[:, 0], place.position[:, 1]
    moment = at_the_end(made_with)
    sample = yield from meanwhile(Progress("write", 0.6), sample_at.slices(footprints, x, y, **moment))
    sigma, inputs = made_with.material.blur_sigma, made_with.inputs()
    relief_of = relief_at.slices(footprints, x, y, inputs, blur_sigma=sigma)
    relief = yield from meanwhile(Progress("write", 0.65), relief_of)
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
    )
    spans, lines = yield from meanwhile(Progress("write", 0.7), over_time)
    with ExitStack() as drafts:  # what is made and does not get into the scene is taken away
        table = settings.name_of(drafts.enter_context(playback.keyframe_tables(lines)))
        del lines  # they are large, and all is in the table
        yield Progress("write", 0.8)
        marks = _tread(footprints, place.position, made_with, relief)
        yield Progress("write", 0.9)
        yield from baked_ground.write(
            place,
            sample,
            spans,
            table,
            stored,
            unit_scale=made_with.unit_scale_m,
            shape_keys=made_with.shape_keys
            and (made_with.dense_shape_keys or not display_key.is_dense(settings.found(place.display_mesh))),
            marks=marks,
            water=water_at(relief, len(x)),
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
        )  # all is in the mesh, of which Blender makes another
        if is_draft:
            yield Progress("write", 0.9)
        shown = show()
    return Published(shown, error)


def sign(
    display_mesh: bpy.types.Object,
    ground: bpy.types.Object,
    inputs: Mapping[str, Any],
    hashes: Mapping[str, str],
    *,
    summary: Mapping[str, float],
    warnings: Sequence[str] = (),
) -> None:
    """Note with what was published what the panel says of it, and what it was made from.

    Parameters
    ----------
    display_mesh, ground : bpy.types.Object
        What carries it, and the ground that it is of.
    inputs, hashes
        See `staleness.store`.
    summary : mapping
        From `bake_report`.
    warnings : sequence of str
    """
    ground_mesh.mesh_of(display_mesh)[ground_mesh.SUMMARY] = dict(summary)
    ground_mesh.note_warnings(display_mesh, warnings)
    staleness.store(inputs, ground, hashes)


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
