"""Feet that float above the prints of a bake are let down into them, with the prints left as they are."""

from __future__ import annotations

from contextlib import suppress

import bpy

from ...core.errors import InputError
from ..characters.character_setup import characters_of
from ..ground import baked_ground, ground_mesh
from ..jobs import Job
from ..reading import staleness
from ..response import response_job
from . import bake_report
from .bake_job import BakeResult, bake


def floating_mm(scene: bpy.types.Scene) -> float:
    """How far the feet float above the prints of the scene's last bake [mm]; 0 where there is none."""
    ground = scene.softground.ground
    summary = ground_mesh.summary_of(baked_ground.carrier_of(ground)) if ground else {}
    return float(summary.get(bake_report.FLOATING, 0.0))


def sink_feet(scene: bpy.types.Scene) -> Job[BakeResult]:
    """Switch grounding on and bake the response only; a job that fails or is closed switches it off again.

    Raises
    ------
    SoftGroundError
        As `bake`, and if there is nobody with feet.
    """
    options = scene.softground
    if not response_job.rigged(characters_of(scene)):
        raise InputError("Nothing here has feet to let down: add a character with an animated armature.")
    settings = options.grounding.use, options.output
    up_to_date = not bake_report.stale_reasons(scene)
    options.grounding.use = True
    if options.output == "PRINTS":
        options.output = "BOTH"
    done = False
    try:
        result = yield from bake(scene, response_only=True)
        done = True
    finally:
        if not done:
            with suppress(ReferenceError):  # the scene itself may have been deleted
                scene.softground.grounding.use, scene.softground.output = settings
    _note(scene, result, up_to_date)
    return result


def _note(scene: bpy.types.Scene, result: BakeResult, up_to_date: bool) -> None:
    """Note with the ground's bake that nothing floats any more; with the same prints as before it is up to date."""
    ground = scene.softground.ground
    if ground is None or not baked_ground.is_baked(ground):
        return
    mesh = ground_mesh.mesh_of(baked_ground.carrier_of(ground))
    was, now = ground_mesh.summary_of(baked_ground.carrier_of(ground)), bake_report.summary(result.report)
    mesh[ground_mesh.SUMMARY] = was | {bake_report.FLOATING: now[bake_report.FLOATING]}
    if up_to_date and all(was.get(key) == now[key] for key in ("steps", "max_depth_m", "peak_force_n")):
        staleness.store(bake_report.inputs_of(scene), scene)
