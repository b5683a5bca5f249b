"""Edits of single steps of the bake that is on the ground: pressed again and published, and no animation is read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import get_args

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.after.felt_weather import felt_in
from ...core.after.thrown_debris import thrown_again
from ...core.composers.edited_steps import EditedSteps
from ...core.errors import InputError
from ...core.ground.material import Pressure
from ...core.ground.presets import SURFACES, validate_material
from ...core.record import record
from ...core.record.edits import UNCHANGED, StepEdit, is_copy, mesh_soles
from ...core.record.footprints import extent
from ...core.settings import Acts, BakeSettings
from .. import jobs, settings
from ..after import debris_object
from ..ground import baked_ground, ground_mesh, painted_ground
from ..reading import staleness
from ..reading.shots import Shot, ground_of
from . import bake_job, bake_report

AROUND = 2.0
"""How far around the prints the ground is looked at, for those that are moved [m]."""
FALLBACK_SOLE = 0.25
"""Length of a sole, of prints that do not say with what they were pressed [m]."""


@dataclass(frozen=True)
class EditableBake:
    """A bake as it is on the ground, with all that its steps are pressed again on.

    Attributes
    ----------
    left : BakeRecord
    made_with : BakeSettings
        The scene's settings, but for what the prints were pressed with.
    shot : Shot
        The undisturbed ground; nobody is on it.
    steps : EditedSteps
    """

    left: record.BakeRecord
    made_with: BakeSettings
    shot: Shot
    steps: EditedSteps

    def with_edits(self, edits: Mapping[str, StepEdit]) -> record.BakeRecord:
        """The record with other edits in place of those that it has."""
        return self.steps.left_with(self.left, edits)


def editable(scene: bpy.types.Scene) -> EditableBake:
    """The bake on the scene's ground, to be edited.

    Raises
    ------
    InputError
        If there is none, or its record does not say what it was made with.
    """
    ground = scene.softground.ground
    left = baked_ground.record_of(ground)
    made_with = _made_with(scene, left)
    names = painted_ground.names_of(ground, made_with.painted)
    surface = ground_mesh.undisturbed_surface(ground, made_with.unit_scale_m, names)
    low, high = _extent(left)
    terrain = ground_mesh.terrain_of(surface, np.stack([low - AROUND, high + AROUND]))
    shot = Shot((), low, high, None, surface, terrain)
    return EditableBake(
        left, made_with, shot, EditedSteps(left.footprints, ground_of(made_with, shot), made_with.cell_size_m)
    )


def edit(scene: bpy.types.Scene, bake: EditableBake, edits: Mapping[str, StepEdit]) -> None:
    """Show the bake on the scene's ground with other edits; edits that change nothing of a baked step are dropped.

    Raises
    ------
    InputError
        If a step is to be moved of which the record keeps too little, or the ground cannot be written.
    """
    ground = scene.softground.ground
    left = bake.with_edits({name: edit for name, edit in edits.items() if edit != UNCHANGED or is_copy(name)})
    shown, stamp = baked_ground.display_mesh_of(ground), staleness.stamp_of(ground)
    warnings, summary = ground_mesh.warnings_of(shown), ground_mesh.summary_of(shown)
    lengths = [step.pressed_by.pressing.sole.length for step in left.footprints if step.pressed_by]
    sole_length = min(lengths, default=FALLBACK_SOLE)
    surface, is_deleted = str(left.about["inputs"]["surface"]), bool(left.thrown) and debris_object.of(ground) is None
    debris = None
    if left.throws:
        left, debris = thrown_again(
            left,
            ground_of(bake.made_with, bake.shot),
            surface=surface,
            cell_size=bake.made_with.cell_size_m,
            gravity=bake.made_with.gravity_m_s2,
        )
    written = jobs.run(bake_job.write_prints(scene, bake.made_with, bake.shot, left, sole_length))
    if left.throws and not is_deleted:
        debris_object.put(ground, debris, surface=surface, units=bake.made_with)
    renewed = summary | bake_report.summary_of_prints(left.edited)
    ground_mesh.mesh_of(written.display_mesh)[ground_mesh.SUMMARY] = renewed
    ground_mesh.note_warnings(written.display_mesh, warnings)
    staleness.store_again(
        scene.softground.ground, stamp, bake.made_with.painted, _sole_hashes(scene, stamp, bake, edits)
    )


def _sole_hashes(
    scene: bpy.types.Scene, stamp: str, bake: EditableBake, edits: Mapping[str, StepEdit]
) -> dict[str, str]:
    """Hashes of the meshes whose soles press steps, of those that were not read again as they were noted."""
    soles, before = mesh_soles(edits), mesh_soles(bake.left.edits)
    noted: dict[str, str] = json.loads(stamp) if stamp else {}
    now = staleness.of_soles(scene, soles)
    same = {f"{staleness.SOLE}:{name}" for name, sole in soles.items() if before.get(name) == sole}
    return {key: noted.get(key, value) if key in same else value for key, value in now.items()}


def _made_with(scene: bpy.types.Scene, left: record.BakeRecord) -> BakeSettings:
    """The scene's settings, with those that the prints were pressed and put on the ground with."""
    now = settings.snapshot(scene)
    try:
        inputs = left.about["inputs"]
        on_ground = {
            name: type(value)(inputs[name])
            for name, value in now.between(Acts.WRITING, Acts.WRITING).items()
            if name in inputs
        }
        units = baked_ground.units_of(inputs)
        if inputs["surface"] not in SURFACES or inputs["pressure"] not in get_args(Pressure):
            raise ValueError("there is no such surface, or no such pressure")
        stiffness, layer_depth, rim = map(str, inputs["painted"])
        return replace(
            now,
            **on_ground,
            material=validate_material(inputs["material"], "record"),
            pressure=inputs["pressure"],
            painted=(stiffness, layer_depth, rim),
            frames=baked_ground.frames_of(inputs),
            cell_size_m=units["cell_size_m"],
            frame_rate=units["frame_rate"],
            time_stretch=units["time_stretch"],
            gravity_m_s2=units["gravity_m_s2"],
            unit_scale_m=units["unit_scale_m"],
            shoe_treads=tuple((str(who), str(sole), str(text)) for who, sole, text in inputs.get("shoe_treads", ())),
            weather=felt_in(inputs),
        )
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError, InputError):
        raise InputError(
            "The stored record of the footprints does not say what they were pressed with: bake again, and edit then."
        ) from None


def _extent(left: record.BakeRecord) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of all prints [m]."""
    footprints = (*left.footprints, *left.edited)
    if not footprints:
        raise InputError("The bake has no steps to edit: check that the feet touch the ground, and bake again.")
    return extent(footprints)
