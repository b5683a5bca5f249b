"""Motion-capture files as users bring them, baked with the automatic set-up: prints where the feet were."""

from functools import cache
from itertools import pairwise

import bpy
import numpy as np
import pytest
from scipy.spatial import KDTree

from softground_addon.blender import jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.reading import analysis
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.record.typical_depth import typical_of
from tests.blender import shots
from tests.blender.responders import source_motion

pytestmark = pytest.mark.slow

STEPS = {"walk": 6, "run": 15, "jumping": 6, "jumping_jacks": 14}
"""Contacts counted in the motion: heel and toe markers for walk and run, by eye for the others."""

FORCES = (500.0, 6 * 77.5 * 9.81)
"""Between which the highest force is: two thirds of the weight, and what sprinters reach [N]."""

ALTERNATING = ("walk", "run")

UNDER_THE_FOOT = 0.01
"""Every print lies under its foot to this distance [m]."""


@cache
def bake_of(name):
    """The bake of a motion file and the motion that it was made from: plain values, made once."""
    shots.import_motion(name)
    scene = bpy.context.scene
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Snow")
    analysis.read(scene)
    predicted[name] = analysis.expected_depth(scene)
    result = jobs.run(bake_job.bake(scene))
    return name, result, source_motion(scene)


predicted = {}
"""Depth of the typical step of each file [m], before it was baked."""


@pytest.fixture
def baked(scene, request):
    return bake_of(request.param)


every_file = pytest.mark.parametrize("baked", sorted(shots.MOTION_FILES), indirect=True)


@every_file
def test_the_steps_are_those_that_one_counts_in_the_motion(baked):
    name, result, _ = baked
    contacts = [step["contact"] for step in result.report["steps"]]
    if name in STEPS:
        assert len(contacts) == STEPS[name]
    if name in ALTERNATING:
        assert all(a != b for a, b in pairwise(contacts))


@every_file
def test_the_force_is_that_of_somebody_who_walks_runs_or_jumps(baked):
    _, result, _ = baked
    assert FORCES[0] < result.report["totals"]["peak_force_n"] < FORCES[1]


@every_file
def test_the_typical_step_is_as_deep_as_predicted(baked):
    name, result, _ = baked
    assert predicted[name] == pytest.approx(result.report["totals"]["typical_depth_m"], rel=0.02)


@pytest.mark.parametrize("pressure", ["UNIFORM", "CENTRE_OF_PRESSURE"])
@pytest.mark.parametrize("cell_size", [0.005, 0.01])
@pytest.mark.parametrize("name", sorted(shots.MOTION_FILES))
def test_it_is_so_with_either_pressure_and_cells_of_any_size(scene, name, cell_size, pressure):
    shots.import_motion(name)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Snow")
    scene.softground.pressure, scene.softground.cell_size = pressure, cell_size
    loads, ground = analysis.read(scene).loads, SoftGround(FlatTerrain(), settings.snapshot(scene).material, pressure)
    pressed = [footprint for result in simulate(loads, ground, cell_size) for footprint in result.footprints]
    assert analysis.expected_depth(scene) == pytest.approx(typical_of(pressed), rel=0.02)


@pytest.mark.parametrize("name", sorted(shots.MOTION_FILES))
def test_every_file_bakes_with_the_impulse_model_too(scene, name):
    shots.import_motion(name)
    bpy.ops.softground.add_character()
    scene.softground.characters[0].force_model = "IMPULSE"
    report = jobs.run(bake_job.bake(scene, write=False)).report
    assert report["steps"]
    assert FORCES[0] < report["totals"]["peak_force_n"] < FORCES[1]


def undersides(sole, first, last):
    """World places (N, 2) of points all over the posed patches of a sole, at the frames of a contact."""
    places = []
    for number, patch in enumerate(sole.sole.patches):
        row, column = np.nonzero(patch.signed_distance <= 0)
        flat = patch.origin + np.stack([column, row], axis=1) * patch.spacing
        points = np.column_stack([flat, patch.heights[row, column]])
        pose = sole.transforms[first:last, number]
        posed = np.einsum("fij,nj->fni", pose[:, :3, :3], points) + pose[:, None, :3, 3]
        places.append(posed[..., :2].reshape(-1, 2))
    return np.concatenate(places)


@every_file
def test_every_print_lies_under_its_foot_and_nowhere_else(baked):
    """Each pressed cell has been under the sole as it stood at some frame of the contact, to a centimetre."""
    _, result, motion = baked
    steps = 4  # feet that slide move by centimetres from frame to frame
    soles = {sole.sole.name: sole for sole in motion.resampled(steps).soles}
    for footprint in result.footprints:
        first = max(0, int((footprint.start_frame - motion.frames[0]) * steps) - 1)
        last = int((footprint.end_frame - motion.frames[0]) * steps) + 2
        row, column = np.divmod(footprint.contact_cells, footprint.window.columns)
        centre = np.stack([footprint.window.column + column, footprint.window.row + row], axis=1) + 0.5
        distance, _ = KDTree(undersides(soles[footprint.sole], first, last)).query(centre * footprint.cell_size)
        assert distance.max() < UNDER_THE_FOOT
