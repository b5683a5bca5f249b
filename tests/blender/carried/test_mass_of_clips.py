"""What soles carry in every shared clip: mass is neither made nor lost, on the floor, in the air and in edits."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job, publish
from softground_addon.blender.reading import analysis
from tests.blender import grounds, shots
from tests.blender.ground.test_hard_ground import listed

DATA = shots.SHARED
sys.path.append(str(DATA.parent / "tools"))
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not DATA.exists(), reason=f"needs the reference data in {DATA}")]

ABOVE = 1e-3
"""Height of the hard strips over the ground in leg lengths."""
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
    """A ground of mud under the feet, with two hard strips across it: each bears a quarter of what touches."""
    read = analysis.read(scene)
    (loads,) = read.loads
    level = float(read.shot.terrain.heights(np.zeros(1), np.zeros(1))[0])
    touching = loads.contacts.touching
    soles = enumerate(loads.motion.soles)
    places = np.concatenate([sole.landmark_positions()[touching[:, n], :, :2].reshape(-1, 2) for n, sole in soles])
    low, high = places.min(axis=0) - loads.motion.leg_length, places.max(axis=0) + loads.motion.leg_length
    along = int(np.ptp(places, axis=0).argmax())
    quarters = np.quantile(places[:, along], [0.25, 0.5, 0.75])
    corners = []
    for start, end in ((quarters[0], quarters[1]), (quarters[2], high[along])):
        first, last = low.copy(), high.copy()
        first[along], last[along] = start, end
        for x, y in (first, (last[0], first[1]), last, (first[0], last[1])):
            corners.append((x, y, level + ABOVE * loads.motion.leg_length))
    mesh = bpy.data.meshes.new("Strips")
    mesh.from_pydata(corners, [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    strips = bpy.data.objects.new("Strips", mesh)
    scene.collection.objects.link(strips)
    extent = 4 * float(np.abs([low, high]).max())
    scene.softground.ground = grounds.plane(scene, extent, 2, height=lambda x, y: 0.0 * x + level)
    scene.softground.material.surface, scene.softground.debris = "mud", True
    scene.softground.characters[0].dirty_soles = 0.5
    listed(strips)


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
    assert marks.carried.left_behind > 0
    assert_booked(marks)
    of_report = report["totals"]["carried_kg"]
    assert of_report["left_behind"] == pytest.approx(marks.carried.left_behind, rel=1e-6)
    chance = np.random.default_rng(1)
    for _ in range(20):
        assert_booked(marks.with_steps([*edited(steps, chance, 1.0)], shed))
    again = marks.with_steps(steps, shed)
    assert again.carried == marks.carried
    assert np.array_equal(again.mass, marks.mass)
