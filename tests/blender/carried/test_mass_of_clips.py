"""What soles carry in every shared clip: mass is neither made nor lost, on the floor, in the air and in edits."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job, publish
from softground_addon.blender.reading import analysis
from tests.blender import shots
from tests.blender.ground.test_hard_ground import listed

DATA = shots.SHARED
sys.path.append(str(DATA.parent / "tools"))
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not DATA.exists(), reason=f"needs the reference data in {DATA}")]

WAY = 3.0
"""Length of a way in leg lengths that has steps on several strips."""
EXACT = 1e-9
"""Relative error of a sum of masses."""


def clips():
    """Name of every shared clip, with the folder of a list or None for a motion file."""
    for listing in ("rigs", "rigs2"):
        path = DATA / listing / "rigs.json"
        for clip in json.loads(path.read_text()) if path.exists() else ():
            yield pytest.param(listing, clip, id=f"{listing}-{clip['clip']}")
    for name in shots.MOTION_FILES:
        yield pytest.param(None, name, id=name)
    for path in sorted((DATA / "gait").glob("*.bvh")):
        if not any(path.name in motion.path for motion in shots.MOTION_FILES.values()):
            yield pytest.param(None, path.name, id=path.stem)


def opened(listing, clip, folder):
    if listing:
        import zoo

        zoo.imported(clip, DATA / listing, folder / "shot.blend")
    else:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        others = shots.MotionFile(f"gait/{clip}", 0.01, "-Z", "Y")
        shots.import_file(shots.MOTION_FILES.get(clip, others))
    scene = bpy.context.scene
    bpy.ops.softground.add_character()
    options = scene.softground
    options.sink_feet, options.relief, options.pressure = False, "OFF", "UNIFORM"
    return scene


def half_hard(scene):
    """A level ground of mud and a hard floor, in strips beside each other: two of each across a way, else one."""
    read = analysis.read(scene)
    (loads,) = read.loads
    leg, touching = loads.motion.leg_length, loads.contacts.touching
    height = float(read.shot.terrain.heights(np.zeros(1), np.zeros(1))[0])
    soles = [
        sole.landmark_positions()[touching[:, n], :, :2].reshape(-1, 2) for n, sole in enumerate(loads.motion.soles)
    ]
    soles = [places for places in soles if len(places)]
    places, middles = np.concatenate(soles), np.array([np.median(places, axis=0) for places in soles])
    goes_on = np.ptp(places, axis=0).max() > WAY * leg
    along = int(np.ptp(places if goes_on else middles, axis=0).argmax())
    low, high = places.min(axis=0) - leg, places.max(axis=0) + leg
    between = np.quantile(places[:, along], [0.25, 0.5, 0.75]) if goes_on else [middles[:, along].mean()]
    edges = [low[along], *between, high[along]]
    ground, floor = (
        strips(scene, name, [*pairwise(edges)][first::2], along, (low[1 - along], high[1 - along]), height)
        for first, name in enumerate(("Mud", "Floor"))
    )
    options = scene.softground
    options.ground, options.material.surface, options.debris = ground, "mud", True
    options.characters[0].dirty_soles = 0.5
    listed(floor)


def strips(scene, name, spans, along, across, height):
    """An object of level strips, each between two places along an axis."""
    corners = [
        (side, place) if along else (place, side)
        for start, end in spans
        for place, side in ((start, across[0]), (end, across[0]), (end, across[1]), (start, across[1]))
    ]
    faces = np.arange(len(corners)).reshape(-1, 4)[:, :: -1 if along else 1]  # seen from above
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(x, y, height) for x, y in corners], [], faces.tolist())
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def assert_booked(marks):
    booked = marks.carried
    whole = booked.brought + booked.picked_up
    assert booked.left_behind + booked.shed + booked.on_soles == pytest.approx(whole, rel=EXACT, abs=1e-300)
    assert float(marks.mass @ marks.area) == pytest.approx(booked.left_behind, rel=EXACT, abs=1e-300)
    assert min(vars(booked).values()) >= 0.0


def edited(steps, chance, spacing):
    """Steps as an artist may leave them: some are muted, some come earlier or later."""
    for step in steps:
        do = chance.integers(3)
        if step.footprint is None or do == 0:
            yield replace(step, footprint=None)
            continue
        shift = float(chance.integers(-20, 20)) * spacing * (do == 1)
        moved = replace(
            step.footprint,
            start_frame=step.footprint.start_frame + shift,
            end_frame=step.footprint.end_frame + shift,
        )
        yield replace(step, footprint=moved)


@pytest.mark.parametrize(("listing", "clip"), [*clips()])
def test_what_is_picked_up_is_left_shed_or_still_carried_whatever_is_edited(
    addon, tmp_path, monkeypatch, listing, clip
):
    scene = opened(listing, clip, Path(tmp_path))
    half_hard(scene)
    taken = []

    def keep(loads, steps, terrain, **options):
        marks = yield from slices(loads, steps, terrain, **options)
        taken.append((marks, steps, options["shed"]))
        return marks

    slices = publish.marks_of.slices
    monkeypatch.setattr(publish, "marks_of", SimpleNamespace(slices=keep))
    report = jobs.run(bake_job.bake(scene, write=False)).report
    marks, steps, shed = taken[-1]
    assert marks is not None
    (loads,) = analysis.read(scene).loads
    assert (marks.carried.left_behind > 0) == loads.contacts.hard.any()  # runs on the spot may stay on both
    assert_booked(marks)
    of_report = report["totals"]["carried_kg"]
    assert of_report["left_behind"] == pytest.approx(marks.carried.left_behind, rel=1e-6)
    chance = np.random.default_rng(1)
    for _ in range(20):
        assert_booked(marks.with_steps([*edited(steps, chance, 1.0)], shed))
    again = marks.with_steps(steps, shed)
    assert again.carried == marks.carried
    assert np.array_equal(again.mass, marks.mass)
