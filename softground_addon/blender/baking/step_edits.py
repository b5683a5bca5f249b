"""Edits of single steps of the bake that is on the ground: pressed again and published, and no animation is read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import get_args

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.composers.edited_steps import EditedSteps
from ...core.debris.debris import shed_volumes
from ...core.errors import InputError
from ...core.ground import surfaces
from ...core.ground.material import Pressure
from ...core.ground.presets import validate_material
from ...core.record.edits import UNCHANGED, StepEdit, is_copy, mesh_soles
from ...core.record.footprints import extent
from ...core.record.record import BakeRecord
from ...core.settings import Acts, BakeSettings
from ...core.weather.felt_weather import felt_in
from .. import jobs, settings
from ..carried import marks_object
from ..debris import debris_object
from ..ground import baked_ground, ground_checks, ground_mesh, ground_surface, painted_ground
from ..reading import staleness
from ..reading.shots import Shot, ground_of
from ..weather import weather_regions
from . import bake_job, bake_report
from .publish import sign, with_debris

AROUND = 2.0
"""How far around the prints the ground is looked at, for those that are moved [m]."""
FALLBACK_SOLE = 0.25
"""Length of a sole, of prints that do not say with what they were pressed [m]."""


@dataclass(frozen=True)
class EditableBake:
    """A bake as it is on the ground, with all that its steps are pressed again on.

    Attributes
    ----------
    made_with : BakeSettings
        The scene's settings, but for what the prints were pressed with.
    shot : Shot
        The undisturbed ground; nobody is on it.
    """

    record: BakeRecord
    made_with: BakeSettings
    shot: Shot
    steps: EditedSteps

    def with_edits(self, edits: Mapping[str, StepEdit]) -> BakeRecord:
        """The record with other edits in place of those that it has."""
        return EditedSteps.record_with(self.steps, self.record, edits)


def reading(scene: bpy.types.Scene) -> jobs.Job[EditableBake]:
    """The bake on the scene's ground, to be edited, in steps.

    Raises
    ------
    InputError
        If there is none, or its record does not say what it was made with.
    """
    ground = scene.softground.ground
    record = baked_ground.record_of(ground)
    made_with = _made_with(settings.snapshot(scene), record)
    names = painted_ground.names_of(ground, made_with.painted)
    of_slots, frame = made_with.kinds[1], made_with.frame
    undisturbed = ground_surface.undisturbed_surface.slices(ground, made_with.unit_scale_m, names, of_slots, frame)
    surface = yield from jobs.meanwhile(jobs.Progress("sample", 0.5), undisturbed)
    low, high = _extent(record)
    looking = ground_surface.terrain_of.slices(surface, np.stack([low - AROUND, high + AROUND]))
    terrain = yield from jobs.meanwhile(jobs.Progress("sample", 1.0), looking)
    shot = Shot((), low, high, None, surface, terrain)
    return EditableBake(
        record, made_with, shot, EditedSteps(record.footprints, ground_of(made_with, shot), made_with.cell_size_m)
    )


def editing(bake: EditableBake, edits: Mapping[str, StepEdit]) -> jobs.Job[None]:
    """Show the bake on its ground with other edits, in steps; those that change nothing of a step are dropped.

    Raises
    ------
    InputError
        If a step is to be moved of which the record keeps too little, or the ground cannot be written.
    """
    assert bake.made_with.ground
    ground = settings.resolve(bake.made_with.ground)
    ground_checks.check_writable(ground)
    edits = {name: edit for name, edit in edits.items() if edit != UNCHANGED or is_copy(name)}
    pressing = EditedSteps.record_with.slices(bake.steps, bake.record, edits)
    record = yield from jobs.meanwhile(jobs.Progress("simulate", 0.5), pressing)
    shown, stamp = baked_ground.display_mesh_of(ground), staleness.stamp_of(ground)
    warnings, summary = ground_mesh.warnings_of(shown), ground_mesh.summary_of(shown)
    lengths = [step.pressed_by.pressing.sole.length for step in record.footprints if step.pressed_by]
    sole_length = min(lengths, default=FALLBACK_SOLE)
    is_deleted = bool(record.thrown) and debris_object.of(ground) is None
    throwing = with_debris.slices(record, ground_of(bake.made_with, bake.shot), bake.made_with)
    record, debris = yield from jobs.meanwhile(jobs.Progress("simulate", 1.0), throwing)
    shed = shed_volumes(debris) if debris is not None else {}
    debris = None if is_deleted else debris
    published, _ = yield from bake_job.write_prints(bake.made_with, bake.shot, record, debris, sole_length)
    marks_object.follow(published.ground, record.steps, shed)
    sign(
        published,
        bake.made_with,
        _sole_hashes(settings.scene_named(bake.made_with.scene).objects, stamp, bake, edits),
        summary=summary | bake_report.summary_of_prints(record.edited),
        warnings=warnings,
        stamp=stamp,
    )


def _sole_hashes(
    objects: settings.Objects, stamp: str, bake: EditableBake, edits: Mapping[str, StepEdit]
) -> dict[str, str]:
    """Hashes of the meshes whose soles press steps, of those that were not read again as they were noted."""
    soles, before = mesh_soles(edits), mesh_soles(bake.record.edits)
    noted: dict[str, str] = json.loads(stamp) if stamp else {}
    now = staleness.of_soles(objects, soles)
    same = {f"{staleness.SOLE}:{name}" for name, sole in soles.items() if before.get(name) == sole}
    return {key: noted.get(key, value) if key in same else value for key, value in now.items()}


def _made_with(now: BakeSettings, record: BakeRecord) -> BakeSettings:
    """The settings of now, with those that the prints were pressed and put on the ground with."""
    try:
        inputs = {"under": "AUTO", "grounds": (), **record.about["inputs"]}
        writing = {"under": "AUTO", **now.between(Acts.WRITING, Acts.WRITING)}
        on_ground = {name: type(value)(inputs[name]) for name, value in writing.items()}
        surfaces.find(inputs["surface"])
        if inputs["pressure"] not in get_args(Pressure):
            raise ValueError("there is no such pressure")
        stiffness, layer_depth, rim = map(str, inputs["painted"])
        return replace(
            now,
            **on_ground,
            material=validate_material(inputs["material"], "record"),
            surface=inputs["surface"],
            pressure=inputs["pressure"],
            painted=(stiffness, layer_depth, rim),
            frames=baked_ground.frames_of(inputs),
            cell_size_m=baked_ground.unit_of(inputs, "cell_size_m"),
            **vars(baked_ground.units_of(inputs)),
            shoe_treads=tuple((str(who), str(sole), str(text)) for who, sole, text in inputs["shoe_treads"]),
            weather=felt_in(inputs),
            regions=weather_regions.regions_in(inputs),
        )
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError, InputError):
        raise InputError(
            "The stored record of the footprints does not say what they were pressed with: bake again, and edit then."
        ) from None


def _extent(record: BakeRecord) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of all prints [m]."""
    footprints = (*record.footprints, *record.edited)
    if not footprints:
        raise InputError("The bake has no steps to edit: check that the feet touch the ground, and bake again.")
    return extent(footprints)
