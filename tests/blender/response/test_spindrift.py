"""Spindrift: what ploughs through the top of powder throws it, and what flies is missing from what lies."""

import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import step_edits
from softground_addon.blender.debris import debris_object
from softground_addon.blender.ground import baked_ground
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.record.throws import ThrowKind
from tests.blender.response.test_carving import CELL, DEEP, bake, walker


def ploughed(scene):
    """Radius of each piece of spindrift [m], and the step that throws it."""
    points = debris_object.of(scene.softground.ground).data
    kind, step, radius = (np.empty(len(points.vertices), dtype) for dtype in (np.int32, np.int32, np.float32))
    for name, values in (("kind", kind), ("step", step), ("radius", radius)):
        points.attributes[name].data.foreach_get("value", values)
    return radius[kind == ThrowKind.PLOUGH], step[kind == ThrowKind.PLOUGH]


@pytest.mark.slow
def test_what_ploughs_through_powder_throws_some_of_it_which_does_not_lie_there_then(scene):
    armature = walker(scene, **DEEP)
    without, still = bake(scene)
    assert not still.throws
    scene.softground.debris = True
    report, record_of_bake = bake(scene)
    volumes = report["carved"][armature.name]
    totals = report["totals"]
    rims = sum(step["rim_m3"] for step in report["steps"])
    unplaced = sum(step.footprint.unplaced_rim_m3 for step in record_of_bake.steps)
    risen = 2 * scene.softground.material.poisson_ratio * totals["compressed_m3"]
    assert rims + totals["thrown_m3"] + unplaced == pytest.approx(risen, rel=1e-6)
    assert volumes["cut_m3"] == pytest.approx(without["carved"][armature.name]["cut_m3"], rel=1e-9)
    assert volumes["cut_m3"] == pytest.approx(sum(volumes.values()) - volumes["cut_m3"], rel=1e-9)
    thrown = sum(of_step.get("wade", 0.0) for of_step in record_of_bake.thrown.values())
    assert volumes["thrown_m3"] == pytest.approx(thrown, rel=1e-9)
    assert 0.005 < thrown / volumes["loose_m3"] < 0.2
    in_events = sum(row["thrown_kg"] for row in report["events"] if row["phase"] == "wade")
    assert in_events == pytest.approx(thrown * SURFACES["snow"].density, rel=1e-3)
    lying = sum(carve.tile(carve.rim).sum() for carve in record_of_bake.laid_carves.values()) * CELL**2
    assert lying == pytest.approx(volumes["loose_m3"], rel=1e-6)
    radius, step = ploughed(scene)
    assert (4 / 3 * np.pi * radius.astype(float) ** 3).sum() == pytest.approx(thrown, rel=1e-3)
    assert set(step) == {throw.number for throw in record_of_bake.throws if throw.kind == ThrowKind.PLOUGH}
    again = record.load(record.dump(record_of_bake))
    assert again.thrown == record_of_bake.thrown
    for number, carve in record_of_bake.laid_carves.items():
        assert np.array_equal(again.laid_carves[number].tile(carve.rim), carve.tile(carve.rim))


@pytest.mark.slow
def test_it_flies_from_the_surface_ahead_of_the_leg_as_that_passes(scene):
    walker(scene, **DEEP)
    scene.softground.debris = True
    _, record_of_bake = bake(scene)
    for throw in record_of_bake.throws:
        if throw.kind != ThrowKind.PLOUGH:
            continue
        carve, weight = record_of_bake.carves[throw.number], throw.samples[:, 0]
        points, velocities = throw.followed()
        frames = throw.first + throw.spacing * np.flatnonzero(weight)
        assert (frames >= carve.start_frame).all()
        assert (frames <= carve.end_frame).all()
        assert (np.abs(points[weight > 0][..., 2]) < 0.1).all()
        assert (velocities[weight > 0][..., 1] < 0).all() or (velocities[weight > 0][..., 1] > 0).all()


@pytest.mark.slow
def test_it_goes_with_its_step_and_comes_back(scene):
    walker(scene, **DEEP)
    scene.softground.debris = True
    _, record_of_bake = bake(scene)
    number = int(ploughed(scene)[1].min())
    name = step_id(record_of_bake.footprints[number])
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), {name: StepEdit(mute=True)}))
    assert number not in ploughed(scene)[1]
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), {}))
    assert baked_ground.record_of(scene.softground.ground).thrown == record_of_bake.thrown
