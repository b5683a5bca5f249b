"""Feet that float above the prints of a bake are let down into them, with the prints left as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import bpy

from ...core.errors import InputError
from ...core.record.edits import mesh_soles
from ...core.settings import Acts, BakeSettings
from .. import settings
from ..characters.character_setup import characters_of
from ..ground import baked_ground, ground_mesh
from ..jobs import Job
from ..reading import staleness
from ..reading.shots import settings_of
from . import bake_report
from .bake_job import BakeResult, bake


def sink_feet(scene: bpy.types.Scene) -> Job[BakeResult]:
    """Bake the response only, with grounding, and switch that on once it is there.

    Raises
    ------
    SoftGroundError
        As `bake`, and if there is nobody with feet.
    """
    if not any(character.armature for character in characters_of(scene.softground)):
        raise InputError("No character here has feet to lower: add a character with an animated armature.")
    wanted = replace(settings_of(scene, grounded=True), output="RESPONSE")
    hashes = {} if bake_report.stale_reasons(scene) else staleness.of_movers(scene.objects, wanted)
    if hashes and wanted.ground:
        edits = baked_ground.edits_of(settings.resolve(wanted.ground))
        hashes |= staleness.of_soles(scene.objects, mesh_soles(edits))
    result = yield from bake(scene, wanted=wanted)
    options = scene.softground
    options.grounding.by_button |= not options.grounding.use
    options.grounding.use = True
    if options.output == "PRINTS":
        options.output = "BOTH"
    if wanted.ground is not None and baked_ground.is_baked(settings.resolve(wanted.ground)):
        _note(settings.resolve(wanted.ground), wanted, result, hashes)
    return result


def _note(ground: bpy.types.Object, wanted: BakeSettings, result: BakeResult, hashes: Mapping[str, str]) -> None:
    """Note with the ground's bake that nothing floats any more; with the same prints as before it is up to date."""
    mesh = ground_mesh.mesh_of(baked_ground.display_mesh_of(ground))
    was, now = ground_mesh.summary_of(baked_ground.display_mesh_of(ground)), bake_report.summary(result.report)
    mesh[ground_mesh.SUMMARY] = was | {bake_report.FLOATING: now[bake_report.FLOATING]}
    if hashes and all(was.get(key) == now[key] for key in ("steps", "max_depth_m", "peak_force_n")):
        staleness.store(wanted.inputs(Acts.WRITING), ground, hashes)
